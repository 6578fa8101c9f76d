"""What changed between the times of two runs: ratios of ratios, which a faster or busier machine does not move.

A kernel's time over exact Phong's in the same run is compared with that in the other run, and only where both were
timed on one machine: another processor has other ratios.
"""

from typing import Any

import pandas as pd

from phongbench.analysis.front import records
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.results.runs import Run
from phongbench.results.schema import KERNEL, TIMING

FASTER, SLOWER, UNRESOLVED = "faster", "slower", "unresolved"


def compare_times(before: Run, after: Run) -> dict[str, Any]:
    """The kernels that both runs timed, as plain data; the largest change first.

    why_not  why nothing is compared, or None
    level    of the intervals, 0.98: both runs' intervals hold with 99 %, so both together with 98 % at least
    rows     name, precision, working_set, threads; before and after, times over exact Phong's; ratio, after / before,
             with its ends ratio_low and ratio_high; verdict: faster, slower or unresolved
    """
    answer: dict[str, Any] = {"why_not": _why_not(before, after), "level": 0.98, "rows": []}
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
    values = ["ratio", "ratio_low", "ratio_high"]
    first, second = (timing[[*keys, *values]].drop_duplicates(keys) for timing in (before, after))
    both = first.merge(second, on=keys, suffixes=("_a", "_b"))
    ends = both[[f"{name}_{side}" for name in values for side in "ab"]].astype(float)
    return both[((ends > 0) & (ends < float("inf"))).all(axis=1) & (both["ratio_low_a"] < both["ratio_high_a"])]


def _row(pair: dict[str, Any]) -> dict[str, Any]:
    low, high = pair["ratio_low_b"] / pair["ratio_high_a"], pair["ratio_high_b"] / pair["ratio_low_a"]
    kernel = {name: pair[name] for name in KERNEL if name in pair}
    known = pair["approximation"] in REGISTRY
    return {
        "name": str(Formula.of_row({**kernel, "beta_policy": "none"})) if known else str(pair["approximation"]),
        **{name: value for name, value in pair.items() if not name.endswith(("_a", "_b"))},
        "before": pair["ratio_a"],
        "after": pair["ratio_b"],
        "ratio": pair["ratio_b"] / pair["ratio_a"],
        "ratio_low": low,
        "ratio_high": high,
        "verdict": FASTER if high < 1 else SLOWER if low > 1 else UNRESOLVED,
    }
