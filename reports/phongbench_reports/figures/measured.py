"""What figures of measured rows share: their rows of Lyon's formula, its curve, and how they end."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from phongbench.analysis.rows import Rows, at, near
from phongbench.formulas.formula import Formula
from phongbench.formulas.lambda_forms import deficit_of_angle
from phongbench.formulas.registry import REGISTRY
from phongbench_reports.plots import Plate, Vector, footnote
from phongbench_reports.reproduce import reproduce
from phongbench_reports.text import alpha_is, basis, gamma_is


def lyon(rows: pd.DataFrame, *, alpha: float | None = None, gamma: int | None = None, **wanted: Any) -> pd.DataFrame:
    """Rows of Lyon's formula on (R, V), of Taylor's slope if no other is wanted.

    alpha, gamma  only the measured value nearest to it; None: all
    wanted        column = value, or a tuple of values
    """
    rows = at(rows, **{"approximation": "lyon", "beta_policy": "taylor", "space": "reflect", **wanted})
    rows = rows[rows["gamma"].notna()]
    rows = rows if alpha is None else near(rows, "alpha", alpha)
    return rows if gamma is None else near(rows, "gamma", gamma)


def values(row: Any, cosine: Vector) -> Vector | None:
    """The row's formula in float64 at these cosines between R and V; None where this process does not know it.

    The scalar body runs as plain Python: compiling it takes longer than a few hundred calls. A user's own approximation
    is known only while its run lasts; a report rebuilt later goes without its curve.
    """
    formula = Formula.of_row(row)
    if formula.approximation not in REGISTRY:
        return None
    own = np.sqrt((1.0 + cosine) / 2.0) if formula.space == "half" else cosine
    coordinate = own if formula.lambda_form == "none" else deficit_of_angle(formula.lambda_form, own)
    highlight = formula.spec().bound(formula.setting(float(row["alpha"])))
    return np.array([highlight(x) for x in coordinate.tolist()], dtype=np.float64)


def setting_of(study: Rows, data: pd.DataFrame) -> str:
    """The gamma, exponent and precision of a figure that shows one of each: "lyon, γ = 8, α = 50, float32"."""
    return f"lyon, {gamma_is(data['gamma'].iloc[0])}, {alpha_is(data['alpha'].iloc[0])}, {study.precision}"


def finished(study: Rows, figure: Figure, data: pd.DataFrame, note: str, takeaway: str, alt: str) -> Plate:
    """The figure with its note, which says what the marks mean, its sample counts, and the command that repeats it."""
    footnote(figure, f"{note}; {basis(data)}")
    return Plate(figure, data, takeaway, alt, basis(data), reproduce(study, data))
