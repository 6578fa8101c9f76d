"""Which formulas bend normals by no more than so much, by the rows of a run's probe `inverse`."""

import math
from collections.abc import Sequence
from typing import Any

from phongbench.analysis.error_budget import number
from phongbench.analysis.exponents import Exponents
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.results.formula_columns import FORMULA
from phongbench.results.records import Row, by, key
from phongbench.results.runs import Run

#: what is judged: pictures without noise under the four lights
JUDGED: dict[str, Any] = {"lights": 4, "noise": "none"}
_formula = key(FORMULA)
_MEASURE = "measure them: phongbench run --probe inverse"


def worst(run: Run | None, alpha: Exponents) -> list[Row]:
    """Each formula's mean angular error in degrees, the worst over surfaces and these exponents.

    returns  rows of FORMULA and mean_degrees, ascending
    Raises InputError for a run without such rows, and for exponents beyond those measured.
    """
    rows = None if run is None else run.records("inverse").at(**JUDGED)
    if run is None or not rows:
        place = None if run is None else run.id
        raise InputError("errors of normals are known of a run with the probe inverse only", place, _MEASURE)
    known = rows.distinct("alpha")
    alphas = alpha.around(known)
    if alphas is None:
        what = f"alpha {alpha} lies outside what was inverted, {known[0]:g} .. {known[-1]:g}"
        raise InputError(what, run.id, _MEASURE)
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows.at(alpha=alphas).rows([*FORMULA, "mean_degrees"]):
        groups.setdefault(_formula(row), []).append(row)
    whole = [mine for mine in groups.values() if len(mine) == len(alphas) * len(rows.distinct("surface"))]
    most = [max(mine, key=_degrees) for mine in whole]
    return sorted(most, key=by(["mean_degrees", *FORMULA]))


def within(
    cells: Sequence[Row], run: Run | None, alpha: Exponents, degrees: float | str, notes: list[str]
) -> list[Row]:
    """The cells whose formula's error of normals is within so many degrees; what that is, goes into the notes."""
    most = number(degrees, "inverse_error")
    if not (math.isfinite(most) and most > 0):
        raise InputError(f"an error of normals of {most:g} degrees", "inverse_error", "give degrees above 0, e.g. 0.1")
    errors = worst(run, alpha)
    least = {_formula(row): row["mean_degrees"] for row in errors if 0 <= _degrees(row) <= most}
    kept = [{**row, "mean_degrees": least[_formula(row)]} for row in cells if _formula(row) in least]
    others = [row for row in errors if row["approximation"] != "phong"]
    best = f"; of all but exact Phong, {Formula.of_row(others[0])} does least" if others else ""
    notes.append(
        f"{len(kept)} of {len(cells)} cells bend normals by at most {most:g} degrees, in the mean of a surface, "
        f"inverted from exact pictures under 4 lights{best}"
    )
    return kept


def _degrees(row: Row) -> float:
    """Its error; less than any where that is no number."""
    return -math.inf if row["mean_degrees"] is None else float(row["mean_degrees"])
