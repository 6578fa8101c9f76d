"""Which formulas bend normals by no more than so much, by the rows of a run's probe `inverse`."""

import math
from typing import Any

import pandas as pd

from phongbench.analysis.error_budget import number
from phongbench.analysis.exponents import Exponents
from phongbench.analysis.front import records
from phongbench.analysis.rows import at
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.results.formula_columns import FORMULA
from phongbench.results.runs import Run

#: what is judged: pictures without noise under the four lights
JUDGED: dict[str, Any] = {"lights": 4, "noise": "none"}
FORMULA_KEY = list(FORMULA)
_MEASURE = "measure them: phongbench run --probe inverse"


def worst(run: Run | None, alpha: Exponents) -> pd.DataFrame:
    """Each formula's mean angular error in degrees, the worst over surfaces and these exponents.

    returns  FORMULA and mean_degrees, ascending
    Raises InputError for a run without such rows, and for exponents beyond those measured.
    """
    rows = at(run.inverse, **JUDGED) if run is not None else pd.DataFrame()
    if run is None or rows.empty:
        place = None if run is None else run.id
        raise InputError("errors of normals are known of a run with the probe inverse only", place, _MEASURE)
    known = sorted(rows["alpha"].unique())
    alphas = alpha.around(known)
    if alphas is None:
        what = f"alpha {alpha} lies outside what was inverted, {known[0]:g} .. {known[-1]:g}"
        raise InputError(what, run.id, _MEASURE)
    groups = rows[rows["alpha"].isin(alphas)].groupby(FORMULA_KEY, dropna=False, observed=True)["mean_degrees"]
    whole = groups.max()[groups.size() == len(alphas) * rows["surface"].nunique()]
    return whole.reset_index().sort_values("mean_degrees", kind="stable")


def within(
    cells: pd.DataFrame, run: Run | None, alpha: Exponents, degrees: float | str, notes: list[str]
) -> pd.DataFrame:
    """The cells whose formula's error of normals is within so many degrees; what that is, goes into the notes."""
    most = number(degrees, "inverse_error")
    if not (math.isfinite(most) and most > 0):
        raise InputError(f"an error of normals of {most:g} degrees", "inverse_error", "give degrees above 0, e.g. 0.1")
    errors = worst(run, alpha)
    kept = cells.merge(errors[errors["mean_degrees"] <= most], on=FORMULA_KEY, how="inner")
    others = errors[errors["approximation"] != "phong"]
    best = f"; of all but exact Phong, {Formula.of_row(records(others)[0])} does least" if len(others) else ""
    notes.append(
        f"{len(kept)} of {len(cells)} cells bend normals by at most {most:g} degrees, in the mean of a surface, "
        f"inverted from exact pictures under 4 lights{best}"
    )
    return kept
