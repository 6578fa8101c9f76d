"""What the report adds to the rows of a run: names of its cuts, and why a section has nothing to show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pandas as pd

from phongbench.analysis.rows import HEADLINE_ALPHA, STABILITY_ALPHA, Rows, at, nearest, plain
from phongbench.results.schema import CEILINGS, TWIN

__all__ = ["CEILINGS", "HEADLINE_ALPHA", "STABILITY_ALPHA", "TWIN", "Absent", "Study", "nearest", "plain"]


class Study(Rows):
    """Rows under the names that figures and tables use today."""

    @property
    def unit(self) -> pd.DataFrame:
        """`highlight`."""
        return self.highlight

    def at(self, rows: pd.DataFrame, **wanted: Any) -> pd.DataFrame:
        """`rows.at`."""
        return at(rows, **wanted)


@dataclass(frozen=True)
class Absent:
    """Why a section has nothing to show, and how to get it; both plain text, one sentence each."""

    reason: str
    fix: str
