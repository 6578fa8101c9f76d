"""What the closed-form laws say about an error budget: bounds of errors, and work counted, without any run.

Only Lyon's own slope, the classic Gaussian and exact powers have laws, for unit vectors and for slightly wrong lengths.
Model error, change by lengths and rounding are added up, each at its largest, so the sum is a true bound.
"""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from phongbench.analysis.error_budget import Budget
from phongbench.analysis.kernel_times import multiplications
from phongbench.compiler.precisions import precision_named
from phongbench.errors import InputError
from phongbench.formulas import error_laws
from phongbench.formulas.rounding_law import rounding_bound
from phongbench.results.records import Row
from phongbench.results.schema import CELL, RAW

#: without times, work is counted: operations from vectors to each coordinate (the gate on a.b > 0 included), what a
#: logarithm or an exponential takes, and what the laws' formulas add
_FORM_WORK = {"none": 3, "dot": 4, "difference": 11, "cross": 17}
_TRANSCENDENTAL = 12
#: the wrong lengths of one or both vectors, relative to the largest allowed one
_LENGTHS = ((1, 0), (-1, 0), (1, 1), (-1, -1), (1, -1))


def cells(budget: Budget, notes: list[str]) -> list[Row]:
    """The formulas that a law speaks of: rows as of `measured_errors.cells`; `ratio` holds the work.

    notes   receives what to bear in mind
    Raises InputError for what no law speaks of, naming the command that measures it.
    """
    alphas = budget.alpha.values
    measure = f"measure it: phongbench run --alpha {','.join(f'{value:g}' for value in alphas)}"
    measure += "" if budget.precision == "float32" else f" --precision {budget.precision}"
    if alphas[0] < 5 or precision_named(budget.precision).rounds or budget.space != "reflect":
        raise InputError(
            "there is no run with times here, and the laws speak of alpha >= 5, float32 and float64, (R, V) only",
            f"alpha {budget.alpha}, {budget.precision}, {budget.space}",
            measure,
        )
    notes.append(
        "answered from the laws alone: there is no run with times here. Errors are closed-form, work is counted "
        "instead of timed, and only Lyon's own slope, the classic Gaussian and exact powers have laws. "
        f"{measure.capitalize()}"
    )
    columns = [*CELL, "error", "ratio"]
    every = [dict(zip(columns, row, strict=True)) for row in _formulas(budget)]
    bounded = [row for row in every if not math.isnan(row["error"])]
    if unknown := len(every) - len(bounded):
        notes.append(f"{unknown} formulas are left out: the laws do not reach so large a length error there")
    untimed = {"coverage": "law", "ns": None, "samples": None}
    return [{**row, **untimed, "ratio_low": row["ratio"], "ratio_high": row["ratio"]} for row in bounded]


def _formulas(budget: Budget) -> Iterator[tuple[Any, ...]]:
    """(cell.., error, work) of every formula with a law: |error| is largest at an end of a range."""
    alphas = budget.alpha.values

    def row(name: str, form: str, policy: str, gamma: int | None, work: float) -> tuple[Any, ...]:
        error = float(np.max([_error(name, form, gamma, alpha, budget) for alpha in alphas]))  # NaN where any is
        return (name, form, "reflect", policy, gamma, budget.precision, *RAW.values(), error, _FORM_WORK[form] + work)

    for form in ("dot", "difference", "cross"):
        if form == "cross" and alphas[0] < 10:
            continue
        for n in range(1, 9):
            yield row("lyon", form, "taylor", 2**n, 2 + n)
        if form != "cross":
            yield row("gaussian", form, "taylor", None, 1 + _TRANSCENDENTAL)
    if not budget.alpha.continuous and all(alpha == int(alpha) for alpha in alphas):
        yield row("integer-power", "none", "none", None, max(multiplications(int(alpha)) for alpha in alphas))
    yield row("phong", "none", "none", None, 1 + 2 * _TRANSCENDENTAL)


def _error(name: str, form: str, gamma: int | None, alpha: float, budget: Budget) -> float:
    """The largest error at one exponent: a law's with its tolerance, the lengths' and rounding; NaN without a law."""
    if name == "lyon":
        model = abs(float(error_laws.lyon_taylor(form, alpha, float(gamma or 1)))) * (1.04 if gamma == 2 else 1.01)
    else:
        model = abs(float(error_laws.gaussian_classic(alpha))) * 1.01 if name == "gaussian" else 0.0
    lengths = _length_change(form, gamma, alpha, budget.length_error)
    return model + lengths + rounding_bound(gamma, alpha, budget.precision)


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
