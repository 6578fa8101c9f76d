"""What changed between the times of two runs: ratios of ratios, which a faster or busier machine does not move.

A kernel's time over exact Phong's in the same run is compared with that in the other run, and only where both were
timed on one machine: another processor has other ratios.
"""

import math
from typing import Any

import pandas as pd

from phongbench.analysis.front import records
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.results.runs import Run
from phongbench.results.schema import KERNEL, TIMING
from phongbench.timing import statistics
from phongbench.timing.statistics import Interval

UNRESOLVED = "unresolved"
#: confidence of an interval made of two that hold with 99 %: both do with 98 % at least
LEVEL = 0.98
_RATIO = ("ratio", "ratio_low", "ratio_high")


def compare_times(before: Run, after: Run) -> dict[str, Any]:
    """The kernels that both runs timed, as plain data; the largest change first.

    why_not  why nothing is compared, or None
    level    of the intervals, LEVEL
    rows     name, precision, working_set, threads; before and after, times over exact Phong's; ratio, after / before,
             with its ends ratio_low and ratio_high; verdict: faster, slower or unresolved, see `change`
    """
    answer: dict[str, Any] = {"why_not": _why_not(before, after), "level": LEVEL, "rows": []}
    if answer["why_not"] is None:
        answer["rows"] = [_row(pair) for pair in records(_paired(before.timing, after.timing))]
        answer["rows"].sort(key=lambda row: (row["verdict"] == UNRESOLVED, -max(row["ratio"], 1 / row["ratio"])))
    return answer


def _why_not(*runs: Run) -> str | None:
    lacking = [run.id for run in runs if run.timing.empty]
    if lacking:
        return f"{' and '.join(dict.fromkeys(lacking))} has no times"
    machines = [run.manifest["provenance"].get("machine_fingerprint") for run in runs]
    if None in machines:
        return "the runs do not say which machine timed them"
    return None if machines[0] == machines[1] else "the runs were timed on different machines"


def _paired(before: pd.DataFrame, after: pd.DataFrame) -> pd.DataFrame:
    """One row for each kernel that both timed; what has no interval, such as exact Phong itself, is left out."""
    keys = [name for name in TIMING.key if name in before and name in after]
    values = list(_RATIO)
    first, second = (timing[[*keys, *values]].drop_duplicates(keys) for timing in (before, after))
    both = first.merge(second, on=keys, suffixes=("_a", "_b"))
    ends = both[[f"{name}_{side}" for name in values for side in "ab"]].astype(float)
    return both[((ends > 0) & (ends < float("inf"))).all(axis=1) & (both["ratio_low_a"] < both["ratio_high_a"])]


def _row(pair: dict[str, Any]) -> dict[str, Any]:
    before, after = (Interval(*(pair[f"{name}_{side}"] for name in _RATIO)) for side in "ab")
    kernel = {name: pair[name] for name in KERNEL if name in pair}
    known = pair["approximation"] in REGISTRY
    return {
        "name": str(Formula.of_row({**kernel, "beta_policy": "none"})) if known else str(pair["approximation"]),
        **{name: value for name, value in pair.items() if not name.endswith(("_a", "_b"))},
        **change(before, after),
    }


def change(before: Interval, after: Interval) -> dict[str, Any]:
    """How a ratio differs between two measurements: before, after, and after / before as `ratio`, with its interval.

    The interval holds with LEVEL where both do with 99 %; its ends are None where one of them has none. The verdict is
    `statistics.verdict`: what moved by less than 2 % is unresolved.
    """
    high = after.high / before.low if before.low > 0 else math.inf
    ratio = Interval(after.middle / before.middle, after.low / before.high, high)
    told = statistics.verdict(ratio)
    return {"before": before.middle, "after": after.middle, **ratio.columns(), "verdict": told}
