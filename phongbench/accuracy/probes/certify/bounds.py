"""Proven bounds of the model error: no cosine in [0, 1] is worse.

The error of a formula in exact arithmetic is a function of one number, the deficit d = 1 - cos(angle) of unit vectors.
The kernel's own plain body and exact Phong's run on sets of numbers (sets.py): on intervals, and on Taylor series with
ball coefficients, whose value at the middle of a box, with what its last coefficient leaves open, bounds the error over
the box. Boxes are halved, the worst first, until the bound is within `TIGHT` of an error that occurs, or below
`NOTHING`. Plain interval bisection needs some hundred times as many boxes around a flat maximum.

Rows have coverage `certified` and precision `exact`: model_max and max_abs are the bound, an upper one, rounded up; all
other metrics are missing, since nothing was sampled. Coefficients and tables are those of float64. Formulas of kind
`exact` have no model error. Needs python-flint; without it there are no rows, and the run says so.
"""

import heapq
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from importlib.util import find_spec
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from phongbench.accuracy import tables
from phongbench.accuracy.probes import consistency
from phongbench.accuracy.probes.certify.sets import TooWideError, along, ends, every_path
from phongbench.accuracy.probes.exhaustive import COSINES, exponents
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.accuracy.sweep import Sweep
from phongbench.formulas.formula import Formula
from phongbench.formulas.lambda_forms import deficit_of_angle
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation, Setting
from phongbench.inputs.plan import Cell, Plan
from phongbench.results.schema import ACCURACY, EXACT

#: a bound this close to an error that occurs is tight, as a share and, where a formula is Phong, absolutely
TIGHT, NOTHING = consistency.TIGHT
#: halvings until a bound is taken as it is, and until one that is still infinite is given up
HALVINGS, HOPELESS = 1500, 200
#: seconds a law takes, for the forecast only
SECONDS = 0.003
ABSENT = "no certified bounds: python-flint is not installed; pip install 'phongbench[certify]' brings it"

#: highlight coordinates u = exponent * d where boxes begin; the lobe lies in 0 .. 12
_CUTS = (0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0)


def measure(context: ProbeContext) -> Mapping[str, pd.DataFrame]:
    """Certified rows of every formula, form and setting of the plan."""
    if find_spec("flint") is None:
        context.note(ABSENT)
        return {}
    cells = list(laws(context.plan, context.registry, context.sweep))
    known: dict[tuple[Formula, float], float] = {}
    bounded = []
    for position, cell in enumerate(cells):
        form, setting = cell.lambda_form, cell.setting
        # of unit vectors both forms are the same number
        key = (replace(cell.formula, lambda_form="dot") if form == "difference" else cell.formula, cell.alpha)
        if key not in known:
            known[key] = largest(error_of(context.registry[cell.approximation], form, setting), setting.exponent)
        if math.isfinite(known[key]):
            bounded.append((position, known[key]))
        context.advance(1 / len(cells))
    left = len(cells) - len(bounded)
    if left:
        context.detail(
            f"{left} of {len(cells)} laws have no certified bound: their bodies take numbers apart bit by bit"
        )
    return {"accuracy": _rows(context.sweep, cells, bounded)} if bounded else {}


def seconds(plan: Plan, jobs: int) -> float:
    """What the bounds take, on one core."""
    return 0.0 if find_spec("flint") is None else SECONDS * sum(1 for _ in laws(plan, REGISTRY))


def laws(plan: Plan, registry: Mapping[str, Approximation], sweep: Sweep | None = None) -> Iterator[Cell]:
    """Every formula and exponent whose error is a function of the angle, as exact cells; without those that failed."""
    failed = {(sweep.cells[p].formula, sweep.cells[p].alpha) for p in sweep.failures} if sweep else set()
    closely = exponents(plan)
    for spec in (registry[name] for name in plan.approximations):
        for formula, alpha in plan.formulas(spec) if spec.kind != "exact" else ():
            # quick looks at few of them, as with its cosines
            chosen = plan.preset != "quick" or (alpha in closely and formula.space == plan.spaces[0])
            if chosen and (formula, alpha) not in failed:
                yield Cell(formula, alpha, EXACT)


def error_of(spec: Approximation, form: str, setting: Setting) -> Callable[[Any], Any]:
    """Approximation minus exact Phong as a function of the deficit of unit vectors, for any kind of number."""
    values: dict[str, Any] = dict(spec.coefficients(setting))
    if spec.table is not None:
        values["table"] = spec.table(setting).tolist()
    exact = REGISTRY["phong"].kernel

    def error(deficit: Any) -> Any:
        cosine = 1.0 - deficit
        value = spec.kernel(cosine if form == "none" else deficit_of_angle(form, cosine), **values)
        reflected = 1.0 - 2.0 * deficit * (2.0 - deficit) if setting.space == "half" else cosine
        return value - exact(reflected, setting.alpha)

    return error


def largest(error: Callable[[Any], Any], exponent: float) -> float:
    """An upper bound of |error| over deficits in [0, 1]; infinite if there is none.

    exponent  of the lobe, which says where to look first
    """
    cuts = sorted({min(1.0, u / exponent) for u in _cuts(exponent)})
    reached = max(_at(error, cut) for cut in cuts)
    boxes: list[tuple[float, float, float]] = []

    def add(low: float, high: float) -> None:
        nonlocal reached
        reached = max(reached, _at(error, (low + high) / 2))
        heapq.heappush(boxes, (-bound(error, low, high, reached), low, high))

    for low, high in pairwise(cuts):
        add(low, high)
    for halvings in range(HALVINGS):
        worst = -boxes[0][0]
        if worst <= max(TIGHT * reached, NOTHING) or (halvings > HOPELESS and math.isinf(worst)):
            break
        _, low, high = heapq.heappop(boxes)
        add(low, (low + high) / 2)
        add((low + high) / 2, high)
    return -boxes[0][0]


def bound(error: Callable[[Any], Any], low: float, high: float, enough: float = 0.0) -> float:
    """An upper bound of |error| over deficits in [low, high]; a bound below `enough` need not be sharp."""
    plain = _bound_by_range(error, low, high)
    return plain if plain <= enough else min(plain, _bound_by_series(error, low, high))


def _cuts(exponent: float) -> Iterator[float]:
    yield from _CUTS
    last = _CUTS[-1]
    while last < exponent:
        last *= 2
        yield last


def _at(error: Callable[[Any], Any], deficit: float) -> float:
    """The error that the plain bodies find in float64: says where to look, and when to stop."""
    try:
        return abs(float(error(deficit)))
    except ArithmeticError:
        return 0.0


def _bound_by_range(error: Callable[[Any], Any], low: float, high: float) -> float:
    from phongbench.accuracy.probes.certify.intervals import Range

    try:
        values = [ends(value) for value, _ in every_path(lambda: error(Range(low, high)))]
    except TooWideError:
        return math.inf
    return max(max(-a, b) for a, b in values)


def _bound_by_series(error: Callable[[Any], Any], low: float, high: float) -> float:
    """Taylor: the series about the middle, and its last coefficient from anywhere in the box."""
    from phongbench.accuracy.probes.certify.taylor_balls import Jet, size_within

    middle, radius = (low + high) / 2, math.nextafter((high - low) / 2, math.inf)
    sizes = []
    try:
        for anywhere, path in every_path(lambda: error(Jet.variable(middle, radius))):
            centre = along(path, lambda: error(Jet.variable(middle, 0.0)))
            sizes.append(size_within(centre, anywhere, radius))
    except TooWideError:
        return math.inf
    return max(sizes)


def _rows(sweep: Sweep, cells: list[Cell], bounded: list[tuple[int, float]]) -> pd.DataFrame:
    """Rows of accuracy for the bounded ones of these cells: (position, largest error)."""
    positions, errors = np.array([p for p, _ in bounded]), np.array([error for _, error in bounded])
    frame = tables.of_cells(Sweep(sweep.plan, sweep.registry, cells, []), positions).assign(
        stratum=COSINES.name,
        perturbation=COSINES.perturbation,
        length_error=0.0,
        truth="angle",
        samples=0,
        coverage="certified",
        max_abs=errors,
        model_max=errors,
        codes_8bit=255 * errors,
    )
    frame[["nonfinite", "above_one", "negative", "excluded"]] = 0
    return frame.reindex(columns=ACCURACY.names)
