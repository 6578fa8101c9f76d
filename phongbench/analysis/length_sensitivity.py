"""How a highlight answers to wrong lengths: powers fitted to a run's rows, beside those of law 8.

A change by a small length error e goes like coefficient * e^exponent, and the exponent tells the lambda forms apart:
`dot` is of first order at the peak itself; `difference` is of first order on the flank only, and of second at the
peak, which opposite errors lay bare; `cross` is exact at the peak, and twice as steep on the flank.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from phongbench.formulas import error_laws

Array = NDArray[np.float64]

#: how lengths err, as the perturbation column names it: (e, d) of |a| = 1 + e, |b| = 1 + d, for an error e
WAYS = {"a": (1.0, 0.0), "both": (1.0, 1.0), "opposite": (1.0, -1.0)}
FORMS = ("dot", "difference", "cross")
#: a power is fitted over so many of the smallest length errors whose change is CLEAR of rounding and at most LARGE;
#: beyond LARGE the change has left its leading order
POINTS, CLEAR, LARGE = 3, 10.0, 0.1
COLUMNS = (
    "lambda_form", "perturbation", "precision", "alpha", "gamma", "points", "exponent", "coefficient", "law_exponent",
    "law_coefficient", "largest_ratio",
)  # fmt: skip


def law(form: str, way: str, alpha: float, gamma: float, e: Array) -> Array | None:
    """Law 8's largest change by lengths for one form, at most 1 where the law is of first order; None without a law.

    e  float64 (n,)  signed relative length errors, applied as the perturbation `way` says
    """
    first, second = (share * np.asarray(e) for share in WAYS[way])
    if form == "dot":
        return np.asarray(np.abs(error_laws.dot_peak(alpha, gamma, first, second) - 1.0))
    of_form = {"difference": error_laws.difference_length_change, "cross": error_laws.cross_length_change}.get(form)
    # Being of first order, these laws would pass the most that a value in [0, 1] can change.
    return None if of_form is None else np.asarray(np.minimum(of_form(alpha, first, second), 1.0))


def power_of(size: Array, change: Array) -> tuple[float, float]:
    """(exponent, coefficient) of change ~ coefficient * size^exponent, least squares of logarithms; NaN below two."""
    if len(size) < 2:
        return float("nan"), float("nan")
    exponent, start = np.polyfit(np.log(size), np.log(change), 1)
    return float(exponent), float(np.exp(start))


def small(rows: pd.DataFrame) -> pd.DataFrame:
    """Of one form, way and cell: the rows that a power is fitted to; vectors that are too long."""
    clear = (rows["length_max"] > CLEAR * rows["rounding_max"].fillna(0.0)) & (rows["length_max"] <= LARGE)
    return rows[(rows["length_error"] > 0) & clear].nsmallest(POINTS, "length_error")


def fits(accuracy: pd.DataFrame) -> pd.DataFrame:
    """Powers of Lyon's formula, Taylor slope, gated, (R, V): one row for each form, way, precision, alpha and gamma.

    accuracy  rows of a run
    returns   COLUMNS: the fitted power, the power fitted in the same way to the law at the same length errors, and the
              largest measured/law ratio (or its inverse) at those; without rows where fewer than two points are clear
    """
    chosen = accuracy[
        (accuracy["approximation"] == "lyon")
        & (accuracy["beta_policy"] == "taylor")
        & accuracy["gated"].astype(bool)
        & (accuracy["space"] == "reflect")
        & (accuracy["stratum"] == "lengths")
        & (accuracy["truth"] == "angle")
        & accuracy["perturbation"].isin(list(WAYS))
        & accuracy["lambda_form"].isin(FORMS)
    ]
    keys = ["lambda_form", "perturbation", "precision", "alpha", "gamma"]
    fitted = [row for key, rows in chosen.groupby(keys, sort=True, observed=True) for row in _fit(key, rows)]
    return pd.DataFrame(fitted, columns=list(COLUMNS)).astype({"gamma": "Int64", "points": "int64"})


def _fit(key: Any, rows: pd.DataFrame) -> Iterator[tuple[Any, ...]]:
    form, way, _, alpha, gamma = key
    used = small(rows)
    if len(used) < 2:
        return
    size, change = (used[name].to_numpy(np.float64) for name in ("length_error", "length_max"))
    expected = law(form, way, float(alpha), float(gamma), size)
    if expected is not None:
        ratio = float(np.exp(np.abs(np.log(change / expected)).max()))
        yield (*key, len(used), *power_of(size, change), *power_of(size, expected), ratio)
