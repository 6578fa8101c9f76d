"""What the closed-form laws say about a budget where there is no run: errors with their tolerances, and work counted.

Only Lyon's own slope, the classic Gaussian and exact powers have laws, for unit vectors and for slightly wrong lengths.
An answer from here is a bound: model error, change by lengths and rounding are added up, each at its largest.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from phongbench.analysis.exponents import Exponents
from phongbench.analysis.kernel_times import multiplications
from phongbench.compiler.lowering import precision_named
from phongbench.errors import InputError
from phongbench.formulas import error_laws
from phongbench.results.schema import CELL

#: without times, work is counted: operations from vectors to each coordinate (the gate on a.b > 0 included), what a
#: logarithm or an exponential takes, and what the laws' formulas add
_FORM_WORK = {"none": 3, "dot": 4, "difference": 11, "cross": 17}
_TRANSCENDENTAL = 12
#: the wrong lengths of one or both vectors, relative to the largest allowed one
_LENGTHS = ((1, 0), (-1, 0), (1, 1), (-1, -1), (1, -1))


@dataclass(frozen=True)
class Wish:
    """What is asked for.

    alpha         exponents of exact Phong
    max_error     largest absolute error allowed, > 0; 1/255 is one 8-bit code
    length_error  how wrong the vectors' lengths may be, relative, >= 0: 0.01 is up to 1 % too long or too short
    precision     a name that `precision_named` knows
    space         reflect, or half: (N, H) agrees with Phong on coplanar vectors only
    working_set   whose times count: l1, l2 or memory
    """

    alpha: Exponents
    max_error: float
    length_error: float = 0.0
    precision: str = "float32"
    space: str = "reflect"
    working_set: str = "l1"


def cells(wish: Wish, notes: list[str]) -> pd.DataFrame:
    """The formulas that a law speaks of: columns as of `front.joined`, with the law's error; `ratio` holds the work.

    notes   receives what to bear in mind
    Raises InputError for what no law speaks of, naming the command that measures it.
    """
    low, high = wish.alpha.values[0], wish.alpha.values[-1]
    measure = f"measure it: phongbench run --alpha {','.join(f'{value:g}' for value in wish.alpha.values)}"
    if low < 5 or precision_named(wish.precision).rounds or wish.space != "reflect":
        raise InputError(
            "there is no run with times here, and the laws speak of alpha >= 5, float32 and float64, (R, V) only",
            f"alpha {wish.alpha}, {wish.precision}, {wish.space}",
            measure,
        )
    notes.append(
        "answered from the laws alone: there is no run with times here. Errors are closed-form, work is counted "
        "instead of timed, and only Lyon's own slope, the classic Gaussian and exact powers have laws. "
        f"{measure.capitalize()}"
    )
    columns = [*CELL, "error", "ratio"]
    ends = sorted({low, *wish.alpha.values, high})
    found = pd.DataFrame([dict(zip(columns, row, strict=True)) for row in _lawful(wish, ends)], columns=columns)
    unknown = found["error"].isna()
    if unknown.any():
        notes.append(f"{int(unknown.sum())} formulas are left out: the laws do not reach so large a length error there")
    found = found[~unknown].astype({"gamma": "Int64"})
    return found.assign(coverage="law", ns=np.nan, samples=np.nan, ratio_low=found["ratio"], ratio_high=found["ratio"])


def _lawful(wish: Wish, alphas: list[float]) -> Iterator[tuple[Any, ...]]:
    """(cell.., error, work) of every formula with a law: |error| is largest at an end, or it is listed."""

    def row(name: str, form: str, policy: str, gamma: int | None, work: float) -> tuple[Any, ...]:
        errors = [_law(name, form, gamma, alpha, wish) for alpha in alphas]
        error = float(np.max(errors))  # NaN where any is
        return (name, form, "reflect", policy, gamma, wish.precision, error, _FORM_WORK[form] + work)

    for form in ("dot", "difference", "cross"):
        if form == "cross" and alphas[0] < 10:
            continue
        for n in range(1, 9):
            yield row("lyon", form, "taylor", 2**n, 2 + n)
        if form != "cross":
            yield row("gaussian", form, "taylor", None, 1 + _TRANSCENDENTAL)
    if not wish.alpha.continuous and all(alpha == int(alpha) for alpha in alphas):
        yield row("integer-power", "none", "none", None, max(multiplications(int(alpha)) for alpha in alphas))
    yield row("phong", "none", "none", None, 1 + 2 * _TRANSCENDENTAL)


def _law(name: str, form: str, gamma: int | None, alpha: float, wish: Wish) -> float:
    """A law's error with its tolerance, the change by wrong lengths and the rounding added; NaN where none speaks."""
    if name == "lyon":
        model = abs(float(error_laws.lyon_taylor(form, alpha, float(gamma or 1)))) * (1.04 if gamma == 2 else 1.01)
    else:
        model = abs(float(error_laws.gaussian_classic(alpha))) * 1.01 if name == "gaussian" else 0.0
    # Rounding of lambda moves the peak by alpha / 2 spacings (law 11), that of the vectors' lengths by more.
    spacing = precision_named(wish.precision).eps
    return float(model + _length_change(form, gamma, alpha, wish.length_error) + 2 * alpha * spacing)


def _length_change(form: str, gamma: int | None, alpha: float, size: float) -> float:
    """The laws' largest change by lengths that are up to `size` wrong; NaN beyond what they were tested for."""
    if not size:
        return 0.0
    pairs = [(size * e, size * d) for e, d in _LENGTHS]
    if form in ("dot", "none"):
        inside = alpha * ((1 + size) ** 2 - 1) <= 0.1 and (gamma is None or gamma >= 8)
        return max(1.05 * float(error_laws.dot_length_change(alpha, e, d)) for e, d in pairs) if inside else math.nan
    if size > 0.01 or alpha * size > 2 or (gamma is not None and gamma < 16):
        return math.nan
    change = error_laws.difference_length_change if form == "difference" else error_laws.cross_length_change
    return max(1.06 * float(change(alpha, e, d)) for e, d in pairs)
