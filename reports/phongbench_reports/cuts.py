"""The rows of a run, cut the way figures and tables want them. Each cut is made once and kept."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import pandas as pd

from phongbench.analysis.front import CELL, front
from phongbench.analysis.mesh_edges import lyon
from phongbench.analysis.rows import at, ordered
from phongbench.compiler.precisions import in_order
from phongbench.results.runs import EXACT
from phongbench.results.schema import TWIN

if TYPE_CHECKING:
    from phongbench.results.runs import Run

#: The exponents single-exponent figures prefer: the middle of the classic range, and where lengths begin to hurt.
HEADLINE_ALPHA, STABILITY_ALPHA = 50.0, 128.0


def nearest(values: Sequence[float], wanted: float) -> float:
    """The value nearest to `wanted` on a log scale; the smaller of two equally near ones. Values must be positive."""
    return min(sorted(values), key=lambda value: abs(math.log(value / wanted)))


def near(rows: pd.DataFrame, column: str, wanted: float) -> pd.DataFrame:
    """The rows of the value that is nearest to the wanted one, see `nearest`, and those without a value."""
    values = [float(value) for value in rows[column].dropna().unique()]
    if not values:
        return rows
    return rows[rows[column].isna() | (rows[column] == nearest(values, wanted)).fillna(False)]


def plain(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows with categories as strings: they sort and compare alike, however a file held them."""
    held = [name for name in rows.columns if isinstance(rows[name].dtype, pd.CategoricalDtype)]
    return rows.astype(dict.fromkeys(held, "str"))


@dataclass(frozen=True)
class Study:
    """A run and its standard cuts.

    run   phongbench.results.runs.Run   path, manifest, and the frames accuracy, timing and worst
    """

    run: Run

    @property
    def name(self) -> str:
        """The run's name as its manifest has it; written by users, so escape it."""
        return str(self.run.manifest.get("run", self.run.path.name))

    @cached_property
    def accuracy(self) -> pd.DataFrame:
        """All accuracy rows in a fixed order, so that the order of a file never shows."""
        keys = [*CELL, "alpha", "stratum", "perturbation", "length_error", "truth", "gated", "coverage"]
        return ordered(plain(self.run.accuracy), keys)

    @cached_property
    def timing(self) -> pd.DataFrame:
        """All timing rows in a fixed order; empty for a run without timing."""
        rows = self.run.timing
        if rows.empty:
            return rows
        keys = ["working_set", "approximation", "lambda_form", "space", "gamma", "precision", "threads"]
        return ordered(rows, keys)

    @cached_property
    def alphas(self) -> list[float]:
        """The swept exponents, ascending."""
        return sorted(float(alpha) for alpha in self.accuracy["alpha"].unique())

    @cached_property
    def precisions(self) -> list[str]:
        """The swept precisions, float32 first."""
        swept = in_order(set(self.accuracy["precision"]) - {EXACT})
        first = [name for name in ("float32", "float16", "float64") if name in swept]
        return [*first, *(name for name in swept if name not in first)]

    @property
    def precision(self) -> str:
        """The precision that figures are drawn at: float32 where it was swept."""
        return self.precisions[0]

    @cached_property
    def alpha(self) -> float:
        """The exponent of figures that show only one."""
        return nearest(self.alphas, HEADLINE_ALPHA)

    @cached_property
    def working_set(self) -> str:
        """The smallest working set that was timed, or "" without timing."""
        timed = set(self.timing["working_set"]) if len(self.timing) else set()
        return next((name for name in ("l1", "l2", "memory") if name in timed), "")

    @cached_property
    def unit(self) -> pd.DataFrame:
        """Gated rows on unit vectors against the true angle, stratum highlight: one row per cell and alpha."""
        rows = self.accuracy
        plain = (rows["perturbation"] == "none") & (rows["length_error"] == 0.0) & rows["gated"].astype(bool)
        return rows[plain & (rows["stratum"] == "highlight") & (rows["truth"] == "angle")].reset_index(drop=True)

    @cached_property
    def lengths(self) -> pd.DataFrame:
        """Rows on vectors that are deliberately not unit length, against the true angle, with the unit rows at 0."""
        rows = self.accuracy
        return rows[(rows["stratum"] == "lengths") & (rows["truth"] == "angle")].reset_index(drop=True)

    @cached_property
    def meshes(self) -> pd.DataFrame:
        """Lyon's rows on interpolated normals in a fixed order, see `edges.lyon`; empty for a run without the probe."""
        keys = ["mesh", "edge_degrees", "normals", "pair", *CELL, "alpha", "truth"]
        rows = plain(lyon(self.run.meshes))
        return rows if rows.empty else ordered(rows, keys)

    def front(self, alpha: float, precision: str) -> pd.DataFrame:
        """The error/time front of formulas of (R, V) at one exponent in the smallest timed working set; kept.

        Formulas of (N, H) are left out: they agree with Phong on coplanar vectors only, where their errors were
        measured.
        """
        key = (alpha, precision)
        if key not in self._fronts:
            self._fronts[key] = front(
                self._reflect, self.timing, alpha=alpha, precision=precision, working_set=self.working_set
            )
        return self._fronts[key]

    @cached_property
    def _fronts(self) -> dict[tuple[float, str], pd.DataFrame]:
        return {}

    @cached_property
    def _reflect(self) -> pd.DataFrame:
        return at(self.unit, space="reflect")

    @cached_property
    def twin_differs(self) -> list[str]:
        """Working sets in which the A/A twin differs from itself: their speed claims are withheld."""
        if self.timing.empty:
            return []
        twins = self.timing[(self.timing["approximation"] == TWIN) & (self.timing["verdict"] != "unresolved")]
        return sorted(twins["working_set"].unique())


@dataclass(frozen=True)
class Absent:
    """Why a section has nothing to show, and how to get it; both plain text, one sentence each."""

    reason: str
    fix: str
