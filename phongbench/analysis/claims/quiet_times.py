"""What rules on speed share: where times are taken, and when none may be claimed."""

from phongbench.analysis.claims.claim import LackingRowsError
from phongbench.analysis.claims.words import listed
from phongbench.analysis.rows import Rows

PLACES = ("l1", "l2", "memory")
#: a ratio below this is faster: differences of less than 2 % are not claimed
FASTER = 0.98


def quiet(rows: Rows) -> None:
    """LackingRowsError for a run that was not timed, or in which identical code differed in time."""
    if rows.timing.empty:
        raise LackingRowsError(
            "the run was not timed", "time it: phongbench run without --no-timing, or with a --timing-budget"
        )
    if rows.twin_differs:
        raise LackingRowsError(
            f"identical code differed in time in {listed(rows.twin_differs)}, so the run's speed claims are withheld",
            "time it again on a quiet machine: phongbench run",
        )
