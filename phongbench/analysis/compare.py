"""What changed between two runs: their accuracy rows, cell by cell."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from phongbench.errors import InputError, UnknownNameError
from phongbench.results.runs import Run, require_rows
from phongbench.results.schema import ACCURACY, METRICS


@dataclass(frozen=True)
class Comparison:
    """Two runs side by side.

    equal    rows that agree in the metric
    changed  key columns, `before`, `after`, `change`; the largest change first
    only_a   rows that only the first run has
    only_b   rows that only the second run has
    """

    metric: str
    equal: int
    changed: pd.DataFrame
    only_a: int
    only_b: int

    @property
    def same(self) -> bool:
        """True if the runs have the same rows with the same values."""
        return self.changed.empty and not self.only_a and not self.only_b

    def as_dict(self, limit: int = 50) -> Mapping[str, Any]:
        """Plain data for JSON, with the `limit` largest changes."""
        rows = self.changed.head(limit).replace({np.nan: None}).astype(object).to_dict("records")
        return {
            "metric": self.metric,
            "same": self.same,
            "equal": self.equal,
            "changed": len(self.changed),
            "only_a": self.only_a,
            "only_b": self.only_b,
            "rows": [{k: None if pd.isna(v) else v for k, v in row.items()} for row in rows],
        }


def compare(a: Run, b: Run, *, metric: str = "max_abs", tolerance: float = 0.0) -> Comparison:
    """Compare two runs in one metric.

    tolerance  largest |change| that counts as equal, in the metric's unit, >= 0 and finite; 0 asks for the same bits
    Raises UnknownNameError for an unknown metric, InputError for another tolerance and for a run without accuracy rows.
    """
    if metric not in METRICS:
        raise UnknownNameError("metric", metric, METRICS)
    if not 0 <= tolerance < math.inf:
        fix = "give 0, or how much a value may change, e.g. 1e-6"
        raise InputError(f"a tolerance is a finite number of at least 0, not {tolerance:g}", "tolerance", fix)
    for run in (a, b):
        require_rows(run)
    key = ACCURACY.key
    first = a.accuracy[[*key, metric]].rename(columns={metric: "before"})
    second = b.accuracy[[*key, metric]].rename(columns={metric: "after"})
    merged = first.merge(second, on=key, how="outer", indicator=True)
    both = merged[merged["_merge"] == "both"].drop(columns="_merge")
    both = both.assign(change=both["after"].astype(float) - both["before"].astype(float))
    unequal = ~((both["change"].abs() <= tolerance) | (both["before"].isna() & both["after"].isna()))
    changed = both[unequal].sort_values("change", key=abs, ascending=False, kind="stable", ignore_index=True)
    sides = merged["_merge"].value_counts()
    return Comparison(metric, int((~unequal).sum()), changed, int(sides["left_only"]), int(sides["right_only"]))
