"""The textbook claims, judged by the rows of a run: one file each, one line each in NAMES.

A verdict is computed by a stated rule, the docstring of the file's `judge`, and never written by hand.
"""

from importlib import import_module
from typing import Any

from phongbench.analysis.claims.claim import SIGNS, UNMEASURED, VERDICTS, Claim, Finding, Judgement, LackingRowsError
from phongbench.analysis.rows import Rows
from phongbench.errors import InputError
from phongbench.results.runs import Run, intact

__all__ = ["CLAIMS", "SIGNS", "VERDICTS", "Claim", "Finding", "Judgement", "LackingRowsError", "answer", "judge"]

#: modules of this package, in the order of the claims' letters
NAMES = (
    "enough_gamma",
    "large_gamma",
    "cross_form",
    "coarse_meshes",
    "cheap_roots",
    "blinn_cost",
    "blinn_exponent",
    "squarings",
    "far_lights",
    "mirror",
    "incidence",
    "reflections",
    "two_normals",
    "turning_normals",
    "cut_highlight",
)
CLAIMS: tuple[Claim, ...] = tuple(import_module(f"{__name__}.{name}").CLAIM for name in NAMES)


def judge(run: Any) -> list[Judgement]:
    """All claims judged by the rows of a run, in order.

    run  phongbench.results.runs.Run, anything with its tables, or the Rows of one
    Raises InputError for a run that has the rows of no claim: it says which flags give them. Claims that follow from
    formulas alone are no reason to answer.
    """
    rows = run if isinstance(run, Rows) else Rows(run)
    judgements = [claim.judge(rows) for claim in CLAIMS]
    measurable = [one for one in judgements if one.claim.needs]
    if all(one.verdict == UNMEASURED for one in measurable):
        reasons = (one.because.rstrip(".") for one in measurable if one.finding.lacking is not None)
        lacking = "; ".join(dict.fromkeys(reasons))
        raise InputError(
            f"the run has no rows that a claim could be judged by: {lacking}",
            str(rows.run.manifest.get("run", "")),
            "run a whole study: phongbench run, or phongbench run --preset standard",
        )
    return [one.over_enough(rows) for one in judgements]


def answer(run: Run) -> dict[str, Any]:
    """`judge` of a stored run as one document: the run, and the claims.

    Raises CorruptRunError for a run whose bytes have changed, and InputError for one that is partial or lacks all rows.
    """
    return {"run": run.id, "claims": [judgement.as_dict() for judgement in judge(intact(run))]}
