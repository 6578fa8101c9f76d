"""The rows of a run, cut the way the rules want them. Each cut is made once and is in a fixed order."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from phongbench.results.schema import ACCURACY_KEY, CELL_COLUMNS, COLUMNS, TWIN

#: what tells one accuracy row from another, but for how far its inputs were covered
KEY = [column for column in ACCURACY_KEY if column != "coverage"]
TIMED = ["approximation", "lambda_form", "space", "gamma", "precision", "working_set", "threads"]
MESHED = ["mesh", "edge_degrees", "normals", "pair", *(c for c in CELL_COLUMNS if c != "beta"), "truth"]
SKIPPED = ["scene", "width", "height", "depth", "name", "setting"]
SCENE_TIMED = ["scene", "kind", "name", "formula", "setting", "against", "elements", "depth"]
HELD = ["held", "term", "alpha", "distance"]
KEYS = {
    "accuracy": [*KEY, "coverage"],
    "timing": TIMED,
    "meshes": MESHED,
    "skips": SKIPPED,
    "scene_times": SCENE_TIMED,
    "far": HELD,
}
#: lambda forms in the order in which they are told
FORMS = ("dot", "difference", "cross", "tan2", "none")
#: coverages that reach beyond samples, from below
THOROUGH = ("searched", "exhaustive")
_PREFERRED = ("float32", "float64", "float16")


@dataclass(frozen=True)
class Rows:
    """The tables of a run as the rules read them; `of` makes them from a run."""

    accuracy: pd.DataFrame
    timing: pd.DataFrame
    meshes: pd.DataFrame
    skips: pd.DataFrame
    scene_times: pd.DataFrame
    far: pd.DataFrame

    @staticmethod
    def of(run: Any) -> Rows:
        """The rows of a phongbench.results.runs.Run, or of anything with tables of these names; no table, no rows."""
        further = (
            getattr(run, name, pd.DataFrame(columns=list(COLUMNS[name])))
            for name in ("meshes", "skips", "scene_times", "far")
        )
        return Rows(run.accuracy, run.timing, *further)

    @cached_property
    def precision(self) -> str:
        """The working precision that claims are judged in: float32 where it was swept."""
        found = set(self.accuracy["precision"].astype(str).unique())
        return next((name for name in _PREFERRED if name in found), _PREFERRED[0])

    @cached_property
    def alphas(self) -> list[float]:
        """The swept exponents, ascending."""
        return sorted(float(alpha) for alpha in self.accuracy["alpha"].unique())

    @cached_property
    def _gated(self) -> pd.DataFrame:
        """Rows of one precision against the true angle, with the a.b > 0 gate."""
        rows = self.accuracy
        meant = (rows["precision"] == self.precision) & (rows["truth"] == "angle") & rows["gated"].astype(bool)
        return ordered(rows[meant], KEY)

    @cached_property
    def unit(self) -> pd.DataFrame:
        """One row per cell and exponent: its largest known error on unit vectors.

        It is that of the samples of the highlight, or a larger one that a search or a pass over all inputs has found.
        """
        rows = self._gated
        plain = (rows["perturbation"] == "none") & (rows["length_error"] == 0.0)
        meant = (rows["stratum"] == "highlight") | rows["coverage"].isin(THOROUGH)
        return _largest(rows[plain & meant], "max_abs", [c for c in KEY if c != "stratum"])

    @cached_property
    def lengths(self) -> pd.DataFrame:
        """One row per cell, exponent and wrong length, what the lengths change being `length_max`."""
        rows = self._gated
        return _largest(rows[(rows["stratum"] == "lengths") & (rows["perturbation"] != "none")], "length_max", KEY)

    @cached_property
    def meshed(self) -> pd.DataFrame:
        """Rows on interpolated normals in the judged precision, gated."""
        rows = self.meshes
        if rows.empty:
            return rows
        mine = rows["precision"] == (self.precision if (rows["precision"] == self.precision).any() else "float32")
        return ordered(rows[mine & rows["gated"].astype(bool)], MESHED)

    @cached_property
    def timed(self) -> pd.DataFrame:
        """Timing rows in the judged precision on one thread, all pairs lit; too few rounds give no interval, no row."""
        rows = self.timing
        if rows.empty:
            return rows
        ends = rows[["ratio", "ratio_low", "ratio_high"]].astype("float64")
        mine = (
            (rows["precision"] == self.precision) & (rows["threads"] == 1) & ((ends > 0) & (ends < np.inf)).all(axis=1)
        )
        return ordered(rows[mine & rows["lit"].isna()] if "lit" in rows else rows[mine], TIMED)

    @cached_property
    def alarms(self) -> list[str]:
        """Working sets in which identical code was told apart: the run's speed claims are withheld."""
        if self.timing.empty:
            return []
        twins = self.timing[(self.timing["approximation"] == TWIN) & (self.timing["verdict"] != "unresolved")]
        return sorted(set(twins["working_set"].astype(str)))


def ordered(rows: pd.DataFrame, keys: list[str]) -> pd.DataFrame:
    """The rows sorted by their keys, names as plain strings: the order of a file must not show."""
    names = {c: "str" for c in keys if isinstance(rows[c].dtype, pd.CategoricalDtype)}
    return rows.astype(names).sort_values(keys, kind="stable").reset_index(drop=True)


def at(rows: pd.DataFrame, **wanted: Any) -> pd.DataFrame:
    """The rows whose columns equal the wanted values; a tuple or list means any of its values."""
    mask = np.ones(len(rows), bool)
    for column, value in wanted.items():
        held = rows[column]
        same = held.isin(list(value)) if isinstance(value, (tuple, list)) else held == value
        mask &= same.to_numpy(bool, na_value=False)
    return rows[mask]


def near_gamma(rows: pd.DataFrame, wanted: int) -> pd.DataFrame:
    """The rows of the gamma that is nearest to the wanted one, the smaller of two; all without any gamma."""
    gammas = sorted(int(gamma) for gamma in rows["gamma"].dropna().unique())
    return at(rows, gamma=min(gammas, key=lambda g: (abs(g - wanted), g))) if gammas else rows


def evidence(table: str, column: str, rows: pd.DataFrame) -> tuple[dict[str, Any], ...]:
    """Rows as evidence: their table, their key columns, and the value of the column that decides."""
    keys = KEYS[table]
    told = rows[keys].astype(object).where(rows[keys].notna(), None).to_dict("records")
    values = rows[column].tolist()
    return tuple(
        {"table": table, **{str(k): v for k, v in key.items()}, "column": column, "value": value}
        for key, value in zip(told, values, strict=True)
    )


def coverage(rows: pd.DataFrame) -> str:
    """How the errors of these rows were got: "sampled", or several words."""
    return ", ".join(sorted(set(rows["coverage"].astype(str))))


def forms_of(rows: pd.DataFrame, among: Iterable[str] = FORMS) -> list[str]:
    """The lambda forms that occur, in the order in which they are told."""
    found = set(rows["lambda_form"].astype(str))
    return [form for form in FORMS if form in found and form in among]


def _largest(rows: pd.DataFrame, column: str, keys: list[str]) -> pd.DataFrame:
    order = [*keys, column, "stratum", "coverage"]
    return (
        rows[rows[column].notna()]
        .sort_values(order, kind="stable")
        .drop_duplicates(keys, keep="last")
        .reset_index(drop=True)
    )
