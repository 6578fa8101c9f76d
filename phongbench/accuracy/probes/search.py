"""The largest error that a search finds over all pairs of nearly unit vectors: a lower bound of the true maximum.

Domain: pairs (a, b) of vectors that the precision holds, each with a length within one `eps` of 1, in the spaces in
which the plan studies lengths; truth `angle`. Rounded unit vectors all lie in it, so the result is at least what any
stratum of unit vectors shows by sampling. Of formulas that remove lengths: pairs of any lengths from 1/2 to 2, and
from 0.001 to 1000, whose logarithms are two further sides of the boxes.

The six components hardly form boxes: almost no point of one is a unit vector. So the search has two stages.

1. Boxes of directions, (deficit, height, turn, azimuth), the deficit on a scale that is fine within the lobe and
   reaches to 90 degrees. Every box is sampled; its two best points become the middles of boxes half as wide; the best
   `BOXES` are kept. This finds the angle at which the formula errs most, and frames in which rounding adds to it.
2. Leaves in bit space: all 729 pairs whose components are at most one step away, from the best pairs of stage 1, from
   the stored worst inputs of the cell's samples, from its worst cosine and from the worst pair of its neighbour in
   alpha; the search moves to the best one until none is better.

All cells share the same random numbers, so equal plans give equal rows, for any number of threads.
"""

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from phongbench.accuracy.coordinates import coordinate_row
from phongbench.accuracy.probes import search_cells, search_rows
from phongbench.accuracy.probes.exhaustive import exponents
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.accuracy.probes.search_cells import LONGEST, NOT_UNIT, Family, domains, key_of, wanted
from phongbench.accuracy.probes.search_rows import Worst
from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT64, precision_named
from phongbench.compiler.precisions import Array
from phongbench.formulas import coordinate_kernels
from phongbench.formulas.coordinate_kernels import COORDINATE_ROWS, COSINE_ROW, OPEN_ROW, coordinates_at, values_at
from phongbench.formulas.exact import truth_at, truth_kernel
from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import Kernel
from phongbench.formulas.spec import Approximation
from phongbench.inputs.pairs import hold
from phongbench.inputs.plan import Cell, Plan

#: boxes kept, points in each, and halvings
BOXES, POINTS, LEVELS = 16, 128, 14
#: leaves are searched around so many pairs of the last boxes, and each moves at most so often
LEAVES, MOVES = 6, 12
#: one step up, none, one step down, in each of six components
NEIGHBOURS = 3**6
#: of the logarithm of a length so much is left for the leaves to move in
_INSIDE = 0.9999
#: seconds a cell takes, for the forecast only
SECONDS = 0.0105


def measure(context: ProbeContext) -> Mapping[str, pd.DataFrame]:
    """A searched row of accuracy and its worst input for every cell."""
    families = search_cells.families(context)
    if not families:
        return {}
    unit, any_length = (search_cells.stored(context.worst, but) for but in (NOT_UNIT, NOT_UNIT[1:]))
    random = _random(context.plan.seed)
    total = sum(len(positions) for _, positions in families)

    def search(family: Family) -> list[Worst]:
        longest, positions = family
        results: list[Worst] = []
        for position in positions:
            seeds = (unit if longest < LONGEST[-1] else any_length).get(key_of(context.sweep.cells[position]), [])
            results.append(_search(context, position, longest, seeds, results[-1:], random[longest > 1]))
            context.advance(1 / total)
        return results

    with ThreadPoolExecutor(max_workers=context.jobs) as pool:
        results = sorted(
            (f for family in pool.map(search, families) for f in family), key=lambda f: (f.position, f.longest)
        )
    return {"accuracy": search_rows.accuracy(context, results), "worst": search_rows.worst(context, results)}


def worst_error(spec: Approximation, formula: Formula, alpha: float, precision: str, reach: float) -> float:
    """The largest error that a search finds for one formula at one exponent: what is asked on demand, in a second.

    reach  how far lengths may be from 1, relative: the domain
    """
    searched = Cell(formula, alpha, precision)
    with np.errstate(all="ignore"):
        kernel = Kernel.of(spec, searched.setting, precision_named(precision))
    cell = _Cell(searched, kernel, reach)
    _, ends = _boxes(cell, None, _random(0)[False])
    _leaves(cell, ends)
    return float(cell.best[0])


def seconds(plan: Plan, jobs: int) -> float:
    """What the searches take."""
    closely = exponents(plan)
    return SECONDS * sum(len(domains(plan, cell)) for cell in plan.cells() if wanted(plan, cell, closely)) / jobs


def _random(seed: int) -> dict[bool, Array]:
    """What boxes are sampled at, by whether lengths are two of their sides."""
    sides = {False: np.random.default_rng(seed), True: np.random.default_rng([seed, 1])}
    return {more: draw.random((LEVELS, 6 if more else 4, BOXES * POINTS)) for more, draw in sides.items()}


class _Cell:
    """One cell's errors, and the worst pair met so far; the domain are lengths within `reach` of 1, and, of a formula
    that removes lengths, no shorter than 1 / (1 + reach).
    """

    def __init__(self, cell: Cell, kernel: Kernel, reach: float) -> None:
        self.precision, self.exponent = precision_named(cell.precision), cell.setting.exponent
        self.kernel, self.row, self.reach = kernel, coordinate_row(cell), reach
        self.gate = OPEN_ROW if cell.formula.raw else COSINE_ROW
        loops = (
            coordinate_kernels.coordinates_kernel(self.precision, cell.formula.normalise),
            coordinate_kernels.coordinates_kernel(FLOAT64),
            truth_kernel(cell.formula.space == "half", both=False),
        )
        self.addresses = np.array([*(jit.address(loop) for loop in loops), self.kernel.address])
        self.alpha = np.array([cell.alpha])
        self.best = np.full(9, -1.0)
        self.evaluations = 0

    def errors(self, pairs: Array) -> Array:
        """|value - exact| of pairs, float64 (n, 6); -1 where a length is too wrong, or anything is not finite."""
        held = np.ascontiguousarray(pairs.T, dtype=self.precision.carrier)
        hold(self.precision, held)
        out = np.empty((3, len(pairs)))
        row, table, rows = self.kernel.coefficients, self.kernel.table, (self.row, self.gate)
        _errors(self.addresses, self.alpha, row, table, rows, self.reach, held[:3], held[3:], out)
        self.evaluations += len(pairs)
        worst = int(np.argmax(out[0]))
        if out[0, worst] > self.best[0]:
            self.best[:3], self.best[3:] = out[:, worst], held[:, worst]
        return np.asarray(out[0])

    def pairs(self, points: Array) -> Array:
        """The pairs (n, 6) of points in the unit cube: of four sides unit vectors; two more are lengths' logarithms."""
        unit = _pairs(points[:4], self.exponent)
        if len(points) == 4:
            return unit
        lengths = np.exp2(_INSIDE * math.log2(1 + self.reach) * (2 * points[4:] - 1))
        return np.asarray(unit * np.repeat(lengths.T, 3, axis=1))


def _search(
    context: ProbeContext,
    position: int,
    longest: float,
    stored: Sequence[Array],
    before: Sequence[Worst],
    random: Array,
) -> Worst:
    searched = context.sweep.cells[position]
    reach = longest - 1 if longest > 1 else precision_named(searched.precision).eps
    cell = _Cell(searched, context.sweep.kernels(position)[0], reach)
    for candidate in stored:
        if candidate[0] > cell.best[0]:
            cell.best[:] = candidate
    place, ends = _boxes(cell, before[0].place if before else None, random)
    _leaves(cell, np.array([*ends, *(candidate[3:] for candidate in stored), *(f.pair for f in before)]))
    error, exact, value = (float(x) for x in cell.best[:3])
    return Worst(position, longest, error, exact, value, cell.best[3:].copy(), place, cell.evaluations)


def _boxes(cell: _Cell, place: Array | None, random: Array) -> tuple[Array, Array]:
    """Stage 1: where the best point of the last boxes is, and the pairs of its best points."""
    middles = np.full((random.shape[1], BOXES), 0.5)
    middles[0] = (np.arange(BOXES) + 0.5) / BOXES
    if place is not None:
        middles[:, -1] = place
    width = np.full((len(middles), 1), 0.5)
    width[0] = 0.5 / BOXES
    points = errors = np.empty(0)
    for level in random:
        points = np.repeat(middles, POINTS, axis=1) + width * (2 * level - 1)
        points = np.clip(points, 0.0, 1.0)
        errors = cell.errors(cell.pairs(points))
        each = errors.reshape(BOXES, POINTS)
        best_two = (np.argpartition(-each, 1, axis=1)[:, :2] + POINTS * np.arange(BOXES)[:, None]).ravel()
        middles = points[:, best_two[np.argsort(-errors[best_two], kind="stable")[:BOXES]]]
        width = width / 2
    best = np.argsort(-errors, kind="stable")[:LEAVES]
    return points[:, best[0]].copy(), cell.pairs(points[:, best])  # a view would keep all points as long as the row


def _leaves(cell: _Cell, pairs: Array) -> None:
    """Stage 2: move every pair to the worst of its neighbours in bit space until there is no worse one."""
    last = np.full(len(pairs), -1.0)
    for _ in range(MOVES):
        held = pairs.astype(cell.precision.carrier)
        hold(cell.precision, held)
        middle = held.astype(np.float64)
        octave = np.floor(np.log2(np.maximum(np.abs(middle), cell.precision.tiny)))
        step = np.maximum(np.exp2(octave) * cell.precision.eps, cell.precision.smallest)
        around = middle[:, None, :] + _STEPS * step[:, None, :]
        errors = cell.errors(around.reshape(-1, 6)).reshape(len(pairs), NEIGHBOURS)
        worst = np.argmax(errors, axis=1)
        reached = errors[np.arange(len(pairs)), worst]
        better = reached > last
        if not better.any():
            return
        pairs, last = around[better, worst[better]], reached[better]


#: every combination of one step down, none and one up in six components; staying comes first, so a tie does not move
_STEPS = np.array(sorted(product((-1.0, 0.0, 1.0), repeat=6), key=lambda steps: sum(map(abs, steps))))


def _pairs(points: Array, exponent: float) -> Array:
    """Unit vectors (n, 6) of points (4, n) in the unit cube: deficit, height, turn and azimuth.

    The deficit grows like expm1, from 0 to 1: about evenly in exponent * deficit within the lobe, by factors beyond.
    """
    deficit = np.expm1(points[0] * math.log1p(exponent)) / exponent
    height, turn, azimuth = 2 * points[1] - 1, 2 * np.pi * points[2], 2 * np.pi * points[3]
    radius, cos_turn, sin_turn = np.sqrt(1 - height * height), np.cos(turn), np.sin(turn)
    sine = np.sqrt(deficit * (2 - deficit))
    along, across = sine * np.cos(azimuth), sine * np.sin(azimuth)
    ax, ay = radius * cos_turn, radius * sin_turn
    bx = (1 - deficit) * ax + along * height * cos_turn - across * sin_turn
    by = (1 - deficit) * ay + along * height * sin_turn + across * cos_turn
    return np.stack([ax, ay, height, bx, by, (1 - deficit) * height - along * radius], axis=1)


# nine arguments, for compiled code takes no objects
@jit.driver
def _errors(
    addresses: Any, alpha: Any, coefficients: Any, table: Any, rows: Any, reach: float, a: Any, b: Any, out: Any
) -> None:
    """Fill the rows of `out`: |value - exact| or -1, exact, value. `rows` are those of the coordinate and the gate."""
    n = a.shape[1]
    held, unit = np.empty((COORDINATE_ROWS, n), a.dtype), np.empty((COORDINATE_ROWS, n))
    a64, b64, values = np.empty((3, n)), np.empty((3, n)), np.empty(n, a.dtype)
    coordinates_at(addresses[0], a)(a, b, held)
    values_at(addresses[3], held)(held[rows[0]], held[rows[1]], coefficients, table, values)
    for i in range(n):
        length_a = np.sqrt(np.float64(a[0, i]) ** 2 + np.float64(a[1, i]) ** 2 + np.float64(a[2, i]) ** 2)
        length_b = np.sqrt(np.float64(b[0, i]) ** 2 + np.float64(b[1, i]) ** 2 + np.float64(b[2, i]) ** 2)
        out[0, i] = max(abs(length_a - 1.0), abs(length_b - 1.0))
        for row in range(3):
            a64[row, i], b64[row, i] = a[row, i] / length_a, b[row, i] / length_b
    coordinates_at(addresses[1], a64)(a64, b64, unit)
    truth_at(addresses[2], a64)(unit[1], unit[4], alpha, out[1], out[2])
    for i in range(n):
        out[2, i] = values[i]
        error = abs(out[2, i] - out[1, i])
        out[0, i] = error if out[0, i] <= reach and np.isfinite(error) else -1.0
