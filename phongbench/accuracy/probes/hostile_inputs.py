"""What a formula makes of input that should never arrive but does: zero, subnormal, huge, infinite and NaN vectors,
opposite directions, an undefined half vector, and exponents outside of any range.

Each formula, lambda form, space, precision and gating is evaluated once per case, at the setting of the plan nearest to
alpha = 50 and gamma = 8 with the formula's first slope policy: what happens here does not depend on them, but for the
cases about alpha, which bring their own.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pandas as pd

from phongbench.accuracy import tables
from phongbench.accuracy.probes import single_cells
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.compiler import elementary
from phongbench.compiler.lowering import Precision, precision_named
from phongbench.compiler.precisions import Array
from phongbench.errors import PhongbenchError
from phongbench.formulas.spec import ALPHA, Approximation, Setting
from phongbench.inputs.plan import Cell, Plan
from phongbench.results.schema import BEHAVIOUR

#: the setting that cells are chosen near
USUAL = Setting(50.0, 8)
#: exponents that no range allows, or its end
ALPHAS = {"alpha 0": 0.0, "alpha tiny": 1e-30, "alpha 1e5": 1e5, "alpha 1e30": 1e30}
#: where they are evaluated: cosines between R and V
PLACES = {"at the peak": 1.0, "at 60 degrees": 0.5, "at 90 degrees": 0.0}
#: directions that vectors are made along: the axes, their opposites, and two without a zero
_DIRECTIONS = np.array([*np.eye(3), *-np.eye(3), (0.36, 0.48, 0.8), (-2 / 3, 1 / 3, -2 / 3)], np.float64).T.copy()


@dataclass(frozen=True)
class Case:
    """One kind of hostile input.

    name   str           what the table calls it
    a, b   (3, n)        the pairs, before they are rounded to a precision
    exact  float         Phong of the angle between their directions; NaN where a direction is undefined
    alpha  float | None  the exponent it is evaluated with; None for the cell's own
    """

    name: str
    a: Array
    b: Array
    exact: float
    alpha: float | None = None


def cases(precision: Precision, space: str) -> tuple[Case, ...]:
    """All cases for a precision, whose ends decide what is subnormal and what is huge, and a space."""
    return _cases(precision, space)


@cache
def _cases(precision: Precision, space: str) -> tuple[Case, ...]:
    d, zero = _DIRECTIONS, np.zeros_like(_DIRECTIONS)
    small = 0.5 * precision.tiny if precision.smallest < precision.tiny else precision.tiny
    huge = 4 * math.sqrt(precision.largest)
    with np.errstate(invalid="ignore"):
        broken = np.where(np.arange(3)[:, None] == np.arange(d.shape[1]) % 3, np.nan, d)
        endless = np.where(np.arange(3)[:, None] == np.arange(d.shape[1]) % 3, np.inf, d)
    vectors = [
        Case("a is zero", zero, d, math.nan),
        Case("both are zero", zero, zero, math.nan),
        Case("both are subnormal", small * d, small * d, 1.0),
        Case("both are huge", huge * d, huge * d, 1.0),
        Case("a is huge", huge * d, d, 1.0),
        Case("a holds NaN", broken, d, math.nan),
        Case("a is infinite", endless, d, math.nan),
        Case("a = -b", d, -d, 0.0),
    ]
    if space == "half":  # N = L: R = L is opposite to V, and H = (L + V) / |L + V| is 0 / 0
        vectors.append(Case("L = -V", d, np.full_like(d, np.nan), 0.0))
    return (*vectors, *_exponents(space))


def _exponents(space: str) -> Iterator[Case]:
    for (name, alpha), (place, cosine) in ((x, y) for x in ALPHAS.items() for y in PLACES.items()):
        own = math.sqrt((1 + cosine) / 2) if space == "half" else cosine
        a = np.array([[0.0], [0.0], [1.0]])
        b = np.array([[math.sqrt(1 - own * own)], [0.0], [own]])
        yield Case(f"{name} {place}", a, b, elementary.power(cosine, alpha), alpha)


def outcome(values: Array, exact: float, top: float = 1.0) -> str:
    """What became of a case: the worst of its values decides.

    top      the precision's number nearest to 1
    returns  nan, infinite, above-one, negative; saturates, if every value is 0 or 1 and the exact one is another number
             or undefined; else value
    """
    if np.isnan(values).any():
        return "nan"
    if np.isinf(values).any():
        return "infinite"
    if (values > top).any():
        return "above-one"
    if (values < 0).any():
        return "negative"
    ends = ((values == 0) | (values == top)).all()
    return "saturates" if ends and not (values == min(exact, top)).all() else "value"


def setting_of(spec: Approximation, cell: Cell, case: Case) -> Setting | None:
    """The setting of a case; None if the formula does not take it.

    The general range of alpha is a rule of the command and the service, no shader keeps it: an alpha beyond its end is
    evaluated all the same, unless the formula itself refuses the range's nearest end or cannot make its coefficients.
    """
    if case.alpha is None:
        return cell.setting
    setting = replace(cell.setting, alpha=case.alpha)
    try:
        spec.check(replace(setting, alpha=min(max(case.alpha, ALPHA.low), ALPHA.high)))
        with np.errstate(all="ignore"):
            spec.coefficients(setting)
    except (PhongbenchError, ArithmeticError, ValueError):
        return None
    return setting


def measure(context: ProbeContext) -> Mapping[str, pd.DataFrame]:
    """The table `behaviour`: for each case what every formula makes of it."""
    sweep = context.sweep
    chosen = [c for c in single_cells.spread(sweep.cells, USUAL) if c not in sweep.failures]
    rows: list[tuple[Any, ...]] = []
    for position in chosen:
        cell = sweep.cells[position]
        rows += [(position, *row) for row in _outcomes(context.registry[cell.approximation], cell)]
        context.advance(1 / len(chosen))
    columns = ["cell", "own_alpha", "own_beta", "case", "outcome", "lowest", "highest", "exact"]
    table = pd.DataFrame(rows, columns=columns).astype({"own_alpha": float, "own_beta": float})
    keys = tables.of_cells(sweep, table["cell"].to_numpy(np.int64))
    frame = pd.concat([keys, table.drop(columns="cell")], axis=1)
    frame["alpha"], frame["beta"] = table["own_alpha"].to_numpy(), table["own_beta"].to_numpy()
    return {"behaviour": frame[BEHAVIOUR.names]}


def _outcomes(spec: Approximation, cell: Cell) -> Iterator[tuple[Any, ...]]:
    """(alpha, beta, case, outcome, lowest, highest, exact) of each case."""
    precision = precision_named(cell.precision)
    top = float(precision.rounded(1.0))
    for case, block in _blocks(precision, cell.formula.space):
        setting = setting_of(spec, cell, case)
        alpha = cell.alpha if case.alpha is None else case.alpha
        if setting is None:
            yield alpha, math.nan, case.name, "refused", math.nan, math.nan, case.exact
            continue
        values = np.asarray(single_cells.values(spec, cell, block, setting), np.float64)
        known = values[~np.isnan(values)]
        ends = (float(known.min()), float(known.max())) if len(known) else (math.nan, math.nan)
        with np.errstate(all="ignore"):
            beta = float(spec.coefficients(setting).get("beta", math.nan))
        yield alpha, beta, case.name, outcome(values, case.exact, top), *ends, case.exact


@cache
def _blocks(precision: Precision, space: str) -> tuple[tuple[Case, Array], ...]:
    """The cases with their coordinates, made once for all cells of a precision and space."""
    return tuple((case, single_cells.coordinates(precision, case.a, case.b)) for case in cases(precision, space))


def seconds(plan: Plan, jobs: int) -> float:
    """Measured: 0.4 ms a cell and case, for the cells that `measure` chooses."""
    chosen = len(single_cells.spread(list(plan.cells()), USUAL))
    return 4e-4 * chosen * (8 + len(ALPHAS) * len(PLACES))
