"""How smooth each lobe is: does it ever grow away from its peak, how hard is its edge, which numbers does it strain?

Growth is looked for in the cell's own precision along one great circle, whose vectors are held in that precision: bands
that rounding draws are part of what a viewer sees. The edge is the formula's own, so it is looked at in float64: a
second difference over a step that is fine enough for it would be rounding alone in anything less.
"""

import math
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import pandas as pd

from phongbench.accuracy import tables
from phongbench.accuracy.coordinates import coordinate_row
from phongbench.accuracy.probes import single_cells
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.compiler.lowering import FLOAT64, Precision, precision_named
from phongbench.compiler.precisions import Array
from phongbench.formulas.kernel import Kernel
from phongbench.formulas.lambda_forms import cutoff_deficit
from phongbench.formulas.spec import Approximation
from phongbench.inputs.plan import Cell, Plan
from phongbench.inputs.strata import HIGHLIGHT_REACH
from phongbench.results.schema import SMOOTHNESS

#: angles of the circle: through the highlight, where alpha lambda is at most HIGHLIGHT_REACH, and from there to 180
FINE, COARSE = 2048, 512
#: the step of second differences, in units of 1 / sqrt(alpha), the width of a highlight
STEP = 1 / 32


@cache
def circle(precision: Precision, space: str, alpha: float) -> Array:
    """Coordinates of pairs at angles between R and V that grow from 0 to 180 degrees, finest in alpha's highlight."""
    end = math.acos(1 - min(HIGHLIGHT_REACH / alpha, 2.0))
    fine = np.linspace(0, end, FINE, endpoint=False)
    return along(precision, space, np.concatenate([fine, np.linspace(end, math.pi, COARSE)]))


def along(precision: Precision, space: str, angles: Array) -> Array:
    """Coordinates of pairs at these angles between R and V, on one great circle."""
    own = angles / 2 if space == "half" else angles
    # off every axis, so that no component is exact by luck
    pole, side = np.array([2.0, -3.0, 6.0]) / 7, np.array([6.0, -2.0, -3.0]) / 7
    a = np.repeat(pole[:, None], len(own), axis=1)
    return single_cells.coordinates(precision, a, pole[:, None] * np.cos(own) + side[:, None] * np.sin(own))


def rises(values: Array) -> tuple[int, float]:
    """(places where values grow, largest growth above what was reached before); NaN counts as 0."""
    known = np.array(values, np.float64)
    known[np.isnan(known)] = 0.0
    np.maximum(known, np.finfo(np.float64).min, out=known)
    lowest = np.minimum.accumulate(known)
    with np.errstate(invalid="ignore"):  # inf - inf, which fmax passes over
        return int(np.count_nonzero(known[1:] > known[:-1])), float(np.fmax.reduce(known - lowest))


def strained(precision: Precision, coordinate: Array, values: Array) -> tuple[int, int]:
    """(samples that overflowed, samples with a subnormal number), in what the formula is given or in what it makes.

    Fixed point does not overflow, it saturates: there, a number at either end of the range counts.
    """
    over, under = np.zeros(len(values), bool), np.zeros(len(values), bool)
    for numbers in (coordinate, values):
        size = np.abs(numbers)
        over |= (size >= precision.largest) if precision.saturates else np.isinf(numbers)
        under |= (size > 0) & (size < precision.tiny)
    return int(over.sum()), int(under.sum())


def end_of(spec: Approximation, cell: Cell) -> float:
    """The angle between R and V, in radians, where the lobe ends: at its cutoff, or where the gate closes; pi if never.

    An ungated cross form that goes dark shines again behind; its lobe ends at the cutoff all the same.
    """
    widest = math.pi / 2 if cell.gated else math.pi
    own = widest
    if spec.cutoff is not None:
        deficit = cutoff_deficit(cell.lambda_form, spec.cutoff(cell.setting))
        own = widest if deficit is None else min(widest, math.acos(max(-1.0, 1 - deficit)))
    return min(math.pi, 2 * own if cell.formula.space == "half" else own)


def kink(spec: Approximation, cell: Cell, kernel: Kernel) -> tuple[float, float]:
    """(second difference at the lobe's end over step^2 and alpha, angle of the end in degrees); NaN where no end is.

    Alpha is the largest second derivative of exact Phong, at its peak.

    kernel  the cell's in float64
    """
    alpha, end = cell.alpha, end_of(spec, cell)
    step = STEP / math.sqrt(alpha)
    if end + step >= math.pi:
        return math.nan, math.nan
    block = along(FLOAT64, cell.formula.space, end + step * np.array([-1.0, 0.0, 1.0]))
    before, at, after = single_cells.values_of(kernel, cell, block)
    return abs(float(before - 2 * at + after)) / step**2 / alpha, math.degrees(end)


def measure(context: ProbeContext) -> Mapping[str, pd.DataFrame]:
    """The table `smoothness`: one row for every cell of the sweep."""
    sweep = context.sweep
    chosen = [p for p, cell in enumerate(sweep.cells) if p not in sweep.failures and not cell.formula.raw]
    shapes: list[tuple[float, ...]] = []
    edges: dict[Any, tuple[float, float]] = {}
    for position in chosen:
        cell = sweep.cells[position]
        spec, (own, in_float64) = context.registry[cell.approximation], sweep.kernels(position)
        precision = precision_named(cell.precision)
        block = circle(precision, cell.formula.space, cell.alpha)
        key = (cell.formula, cell.alpha, cell.gated)
        if key not in edges:  # the same in every precision
            edges[key] = kink(spec, cell, in_float64)
        values = single_cells.values_of(own, cell, block)
        shapes.append((*rises(values), *edges[key], *strained(precision, block[coordinate_row(cell)], values)))
        context.advance(1 / len(chosen))
    circle.cache_clear()
    table = pd.DataFrame(shapes, columns=list(SMOOTHNESS.names[-6:]))
    frame = pd.concat([tables.of_cells(sweep, np.array(chosen, np.int64)), table], axis=1)
    frame["samples"] = FINE + COARSE
    frame = frame.astype({"rises": "int64", "overflows": "int64", "subnormals": "int64"})
    return {"smoothness": frame[SMOOTHNESS.names]}


def seconds(plan: Plan, jobs: int) -> float:
    """Measured: 0.1 ms a cell."""
    return 1e-4 * sum(1 for _ in plan.cells())
