"""What rules on speed share: where times are taken, and when none may be claimed."""

from phongbench.analysis.claims.claim import LackingRowsError
from phongbench.analysis.claims.words import listed
from phongbench.analysis.rows import Rows

PLACES = ("l1", "l2", "memory")
#: a ratio below this is faster: differences of less than 2 % are not claimed
FASTER = 0.98


def quiet(rows: Rows) -> None:
    """LackingRowsError for a run that was not timed, or that told identical code apart."""
    if rows.timing.empty:
        raise LackingRowsError(
            "the run was not timed", None, "time it: phongbench run without --no-timing, or with a --timing-budget"
        )
    if rows.twin_differs:
        raise LackingRowsError(
            f"the run told identical code apart in {listed(rows.twin_differs)}, so its speed claims are withheld",
            None,
            "time it again on a quiet machine: phongbench run",
        )
