"""The rows of a run, cut as claims, figures and tables want them; each cut is made once and is in a fixed order."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from phongbench.analysis.choices import Choices
from phongbench.analysis.front import framed
from phongbench.analysis.mesh_edges import lyon
from phongbench.inputs.strata import CONFIGURATIONS
from phongbench.results.frames import as_given, plain
from phongbench.results.records import Records
from phongbench.results.schema import CASE, RAW, TABLES

if TYPE_CHECKING:
    import pandas as pd

#: lambda forms in the order in which they are shown
FORMS = ("dot", "difference", "cross", "tan2", "none")
#: the exponents that single-exponent views prefer: amid the classic range, and where wrong lengths begin to hurt
HEADLINE_ALPHA, STABILITY_ALPHA = 50.0, 128.0
#: coverages that reach beyond samples, from below
_THOROUGH = ("searched", "exhaustive")


def _table(name: str) -> cached_property[pd.DataFrame]:
    return cached_property(lambda rows: ordered(rows.stored(name), TABLES[name].key))


@dataclass(frozen=True)
class Rows:
    """A run's tables in a fixed order, and the cuts that are made of them.

    run  phongbench.results.runs.Run, or anything with its manifest and tables; a table it lacks has no rows
    """

    run: Any

    timing = _table("timing")
    worst = _table("worst")
    meshes = _table("meshes")
    behaviour = _table("behaviour")
    smoothness = _table("smoothness")
    scenes = _table("scenes")
    skips = _table("skips")
    scene_times = _table("scene_times")
    far = _table("far")
    inverse = _table("inverse")
    emitted = _table("emitted")
    incidence = _table("incidence")
    incidence_times = _table("incidence_times")
    moments = _table("moments")
    cuts = _table("cuts")
    costs = _table("costs")

    @property
    def accuracy(self) -> pd.DataFrame:
        """It is large: in the order of its file, its text categories; what `at` cuts of it has strings."""
        return self.stored("accuracy")

    def stored(self, name: str) -> pd.DataFrame:
        """A table in the order of its file, without the rows of formulas that remove lengths or make their pair."""
        if name not in self._kept:
            rows = self.raw(name)
            self._kept[name] = as_given(rows) if RAW.keys() <= set(TABLES[name].names) else rows
        kept: pd.DataFrame = self._kept[name]
        return kept

    def raw(self, name: str) -> pd.DataFrame:
        """A table as the run has it."""
        compact = getattr(self.run, f"compact_{name}", None)
        rows: pd.DataFrame | None = getattr(self.run, name, None) if compact is None else compact
        return TABLES[name].frame() if rows is None else rows

    @property
    def name(self) -> str:
        """The run's name as its manifest tells it; written by users, so escape it."""
        return str(self.run.manifest.get("run", self.run.path.name))

    @property
    def partial(self) -> bool:
        """Whether the run was interrupted: it has the rows of the stages that it finished."""
        return bool(self.run.manifest.get("state") == "partial")

    @property
    def awaits_timing(self) -> bool:
        """Whether the run was interrupted before a timing that its plan asks for."""
        return self.partial and self.stored("timing").empty and bool(self.run.manifest["plan"].get("timing"))

    @cached_property
    def choices(self) -> Choices:
        """Its fronts and choices."""
        return Choices(*(Records.of(self.stored(name)) for name in ("accuracy", "timing", "costs")))

    @property
    def alphas(self) -> list[float]:
        """The swept exponents, ascending."""
        return self.choices.alphas

    @cached_property
    def gammas(self) -> list[int]:
        """The swept gammas, ascending."""
        return sorted(int(gamma) for gamma in self.accuracy["gamma"].dropna().unique())

    @cached_property
    def alpha(self) -> float:
        """The exponent of views that show only one."""
        return nearest(self.alphas, HEADLINE_ALPHA)

    @property
    def precisions(self) -> list[str]:
        """The swept precisions, float32 first."""
        return self.choices.precisions

    @property
    def precision(self) -> str:
        """The precision that claims are judged at, see `Choices.precision`."""
        return self.choices.precision

    @property
    def working_set(self) -> str:
        """The smallest working set that was timed, or "" without timing."""
        return self.choices.working_set

    @property
    def twin_differs(self) -> list[str]:
        """Working sets whose speed claims are withheld, see `Choices.twin_differs`."""
        return self.choices.twin_differs

    @cached_property
    def highlight(self) -> pd.DataFrame:
        """Gated rows on unit vectors against the true angle, stratum highlight: one row per cell and exponent."""
        return self.cut(stratum="highlight", truth="angle", perturbation="none", length_error=0.0, gated=True)

    @cached_property
    def half_space(self) -> pd.DataFrame:
        """Gated rows of formulas of (N, H) over all configurations of unit N, L and V, against Phong's true angle."""
        return self.cut(stratum=CONFIGURATIONS, space="half", truth="angle", perturbation="none", gated=True)

    @cached_property
    def lengths(self) -> pd.DataFrame:
        """Rows on vectors of deliberately wrong length against the true angle, with unit ones at length error 0."""
        return self.cut(stratum="lengths", truth="angle")

    @cached_property
    def lyon_meshes(self) -> pd.DataFrame:
        """Lyon's rows on interpolated normals, see `mesh_edges.lyon`."""
        return lyon(Records.of(self.meshes)).of_frame(self.meshes)

    @cached_property
    def _judged(self) -> pd.DataFrame:
        """Gated rows of one precision against the true angle."""
        return ordered(at(self.accuracy, precision=self.precision, truth="angle", gated=True), CASE)

    def cut(self, **wanted: Any) -> pd.DataFrame:
        """Rows of accuracy in the order of its keys."""
        return ordered(at(self.accuracy, **wanted), TABLES["accuracy"].key)

    @cached_property
    def largest_errors(self) -> pd.DataFrame:
        """One row per cell and exponent at the judged precision: its largest known error on unit vectors.

        It is that of the samples of the highlight, or a larger one that a search or a pass over all inputs has found.
        """
        rows = at(self._judged, perturbation="none", length_error=0.0)
        rows = rows[(rows["stratum"] == "highlight") | rows["coverage"].isin(_THOROUGH)]
        return _largest(rows, "max_abs", [column for column in CASE if column != "stratum"])

    @cached_property
    def largest_changes(self) -> pd.DataFrame:
        """One row per cell, exponent and wrong length at the judged precision, lengths changing it by `length_max`."""
        rows = self._judged
        return _largest(rows[(rows["stratum"] == "lengths") & (rows["perturbation"] != "none")], "length_max", CASE)

    @cached_property
    def judged_meshes(self) -> pd.DataFrame:
        """Gated rows on interpolated normals at the judged precision, or at float32 without any."""
        rows = at(self.meshes, gated=True)
        mine = at(rows, precision=self.precision)
        return (mine if len(mine) else at(rows, precision="float32")).reset_index(drop=True)

    @cached_property
    def incidence_precision(self) -> str:
        """The precision that reflectances are judged at: that of the others, or float32 where it was not measured."""
        return self.precision if (self.incidence["precision"] == self.precision).any() else "float32"

    @cached_property
    def judged_incidence(self) -> pd.DataFrame:
        """Errors of reflectances at the judged precision, glass first: of the two, it varies most."""
        rows = at(self.incidence, precision=self.incidence_precision)
        return rows.sort_values("material", ascending=False, kind="stable").reset_index(drop=True)

    @cached_property
    def judged_times(self) -> pd.DataFrame:
        """Times at the judged precision on one thread, all pairs lit, of rows with enough rounds for an interval."""
        return at(_certain(self.timing), precision=self.precision).reset_index(drop=True)

    @cached_property
    def raw_times(self) -> pd.DataFrame:
        """The same in every precision, with formulas that remove lengths or make their pair: recipe and normalise."""
        rows = self.raw("timing")
        return _certain(ordered(rows.assign(**{n: _said(rows, n) for n in RAW}), TABLES["timing"].key))

    def front(self, alpha: float, precision: str) -> pd.DataFrame:
        """The front at one exponent as a table, see `Choices.front`; of (N, H) see `half_space`."""
        key = (alpha, precision)
        if key not in self._kept:
            self._kept[key] = framed(self.choices.front(alpha, precision))
        kept: pd.DataFrame = self._kept[key]
        return kept

    @cached_property
    def _kept(self) -> dict[Any, Any]:
        """What was asked for before: tables and fronts."""
        return {}


def _certain(times: pd.DataFrame) -> pd.DataFrame:
    """Times on one thread, all pairs lit, of rows with enough rounds for an interval."""
    rows = at(times, threads=1)
    ends = rows[["ratio", "ratio_low", "ratio_high"]].astype("float64")
    rows = rows[((ends > 0) & (ends < np.inf)).all(axis=1)]
    return (rows[rows["lit"].isna()] if "lit" in rows else rows).reset_index(drop=True)


def _said(rows: pd.DataFrame, column: str) -> pd.Series[Any]:
    """A column of RAW, with what goes without saying where a row or the whole table says nothing."""
    import pandas as pd

    usual = RAW[column]
    return rows[column].astype(object).fillna(usual) if column in rows else pd.Series(usual, rows.index, object)


def ordered(rows: pd.DataFrame, keys: Iterable[str]) -> pd.DataFrame:
    """The rows sorted by those keys that they have, categories as strings: the order of a file must not show."""
    known = [key for key in keys if key in rows.columns]
    return plain(rows).sort_values(known, kind="stable", ignore_index=True) if len(rows) else rows


def at(rows: pd.DataFrame, **wanted: Any) -> pd.DataFrame:
    """The rows whose columns equal the wanted values; a tuple or list means any of its values."""
    mask = np.ones(len(rows), bool)
    for column, value in wanted.items():
        held = rows[column]
        same = held.isin(list(value)) if isinstance(value, (tuple, list)) else held == value
        mask &= same.to_numpy(bool, na_value=False)
    return plain(rows[mask])


def nearest(values: Sequence[float], wanted: float) -> float:
    """The value nearest to `wanted` on a log scale; the smaller of two equally near ones. Values must be positive."""
    return min(sorted(values), key=lambda value: abs(math.log(value / wanted)))


def near(rows: pd.DataFrame, column: str, wanted: float) -> pd.DataFrame:
    """The rows of the value that is nearest to the wanted one, see `nearest`, and those without a value."""
    values = [float(value) for value in rows[column].dropna().unique()]
    return rows[rows[column].isna() | (rows[column] == nearest(values, wanted)).fillna(False)] if values else rows


def near_gamma(rows: pd.DataFrame, wanted: int) -> pd.DataFrame:
    """The rows of the gamma that is nearest to the wanted one, the smaller of two; all without any gamma."""
    gammas = sorted(int(gamma) for gamma in rows["gamma"].dropna().unique())
    return at(rows, gamma=min(gammas, key=lambda g: (abs(g - wanted), g))) if gammas else rows


def forms_of(rows: pd.DataFrame, among: Iterable[str] = FORMS) -> list[str]:
    """The lambda forms that occur, in the order in which they are shown."""
    present = set(rows["lambda_form"].astype(str))
    return [form for form in FORMS if form in present and form in among]


def _largest(rows: pd.DataFrame, column: str, keys: list[str]) -> pd.DataFrame:
    order = [*keys, column, "stratum", "coverage"]
    return (
        rows[rows[column].notna()]
        .sort_values(order, kind="stable")
        .drop_duplicates(keys, keep="last")
        .reset_index(drop=True)
    )
