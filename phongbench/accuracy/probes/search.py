"""The largest error that a search finds over all pairs of nearly unit vectors: a lower bound of the true maximum.

Domain: pairs (a, b) of vectors that the precision holds, each with a length within one `eps` of 1, in the spaces in
which the plan studies lengths; truth `angle`. Rounded unit vectors all lie in it, so the result is at least what any
stratum of unit vectors shows by sampling.

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
from phongbench.accuracy.probes import search_rows
from phongbench.accuracy.probes.consistency import VECTORS
from phongbench.accuracy.probes.exhaustive import COSINES, exponents
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.accuracy.probes.search_rows import Worst
from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32, FLOAT64, precision_named
from phongbench.compiler.precisions import Array
from phongbench.formulas import coordinate_kernels
from phongbench.formulas.coordinate_kernels import COORDINATE_ROWS, COSINE_ROW, coordinates_at, values_at
from phongbench.formulas.exact import truth_at, truth_kernel
from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import Kernel
from phongbench.formulas.spec import Approximation
from phongbench.inputs.pairs import hold
from phongbench.inputs.plan import Cell, Plan
from phongbench.results.runs import as_given

#: boxes kept, points in each, and halvings
BOXES, POINTS, LEVELS = 16, 128, 14
#: leaves are searched around so many pairs of the last boxes, and each moves at most so often
LEAVES, MOVES = 6, 12
#: one step up, none, one step down, in each of six components
NEIGHBOURS = 3**6
#: seconds a cell takes, for the forecast only
SECONDS = 0.006


def measure(context: ProbeContext) -> Mapping[str, pd.DataFrame]:
    """A searched row of accuracy and its worst input for every cell."""
    families = _families(context)
    if not families:
        return {}
    stored = _stored(context.worst)
    random = np.random.default_rng(context.plan.seed).random((LEVELS, 4, BOXES * POINTS))
    total = sum(map(len, families))

    def search(family: Sequence[int]) -> list[Worst]:
        results: list[Worst] = []
        for position in family:
            seeds = stored.get(_key(context.sweep.cells[position]), [])
            results.append(_search(context, position, seeds, results[-1:], random))
            context.advance(1 / total)
        return results

    with ThreadPoolExecutor(max_workers=context.jobs) as pool:
        results = sorted((f for family in pool.map(search, families) for f in family), key=lambda f: f.position)
    return {"accuracy": search_rows.accuracy(context, results), "worst": search_rows.worst(context, results)}


def worst_error(spec: Approximation, formula: Formula, alpha: float, precision: str, reach: float) -> float:
    """The largest error that a search finds for one formula at one exponent: what is asked on demand, in a second.

    reach  how far lengths may be from 1, relative: the domain
    """
    searched = Cell(formula, alpha, precision)
    with np.errstate(all="ignore"):
        kernel = Kernel.of(spec, searched.setting, precision_named(precision))
    cell = _Cell(searched, kernel, reach)
    random = np.random.default_rng(0).random((LEVELS, 4, BOXES * POINTS))
    _, ends = _boxes(cell, None, random)
    _leaves(cell, ends)
    return float(cell.best[0])


def seconds(plan: Plan, jobs: int) -> float:
    """What the searches take."""
    closely = exponents(plan)
    return SECONDS * sum(1 for cell in plan.cells() if _wanted(plan, cell, closely)) / jobs


def _wanted(plan: Plan, cell: Cell, closely: Sequence[float]) -> bool:
    """False for ungated cells, and for float64, whose rounding is the truth's own; quick searches float32 if it can."""
    only = FLOAT32.name if plan.preset == "quick" and FLOAT32.name in plan.precisions else cell.precision
    chosen = cell.alpha in closely and cell.formula.space in plan.length_spaces and not cell.formula.raw
    return chosen and cell.gated and cell.precision != FLOAT64.name and cell.precision == only


def _families(context: ProbeContext) -> list[list[int]]:
    """Positions of the cells that differ in alpha alone, ascending: each is seeded by the one before it."""
    families: dict[tuple[Any, ...], list[int]] = {}
    closely = exponents(context.plan)
    for position, cell in enumerate(context.sweep.cells):
        if _wanted(context.plan, cell, closely) and position not in context.sweep.failures:
            key = (cell.formula, cell.precision)
            families.setdefault(key, []).append(position)
    return [sorted(family, key=lambda p: context.sweep.cells[p].alpha) for family in families.values()]


def _key(cell: Cell) -> tuple[Any, ...]:
    """What identifies a cell in the table of worst inputs."""
    f = cell.formula
    return f.approximation, f.lambda_form, f.space, f.slope, cell.alpha, f.gamma or 0, cell.precision, cell.gated


def _stored(worst: pd.DataFrame) -> dict[tuple[Any, ...], list[Array]]:
    """The stored worst inputs on unit vectors, by cell: (error, exact, value, a, b) each.

    Those of the stratum `cosines` are none of the domain's, but near one: they seed, and count for nothing (-1).
    """
    if worst.empty:
        return {}
    worst = as_given(worst)
    unit = worst[~worst["stratum"].isin(["lengths", "hostile", VECTORS]) & (worst["truth"] == "angle")]
    names = ["approximation", "lambda_form", "space", "beta_policy", "alpha", "gamma", "precision", "gated"]
    keys = zip(*(unit[n].fillna(0) if n == "gamma" else unit[n] for n in names), strict=True)
    numbers = np.array(unit[["error", "exact", "value"]], float)
    numbers[(unit["stratum"] == COSINES.name).to_numpy()] = -1.0
    pairs = np.array([[float.fromhex(x) for x in unit[c]] for c in ("ax", "ay", "az", "bx", "by", "bz")]).T
    inputs: dict[tuple[Any, ...], list[Array]] = {}
    for key, number, pair in zip(keys, numbers, pairs.reshape(-1, 6), strict=True):
        inputs.setdefault(tuple(key), []).append(np.concatenate([number, pair]))
    return inputs


class _Cell:
    """One cell's errors, and the worst pair met so far; the domain are lengths within `reach` of 1."""

    def __init__(self, cell: Cell, kernel: Kernel, reach: float) -> None:
        self.precision, self.exponent = precision_named(cell.precision), cell.setting.exponent
        self.kernel, self.row, self.reach = kernel, coordinate_row(cell), reach
        loops = (
            coordinate_kernels.coordinates_kernel(self.precision),
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
        row, table = self.kernel.coefficients, self.kernel.table
        _errors(self.addresses, self.alpha, row, table, self.row, self.reach, held[:3], held[3:], out)
        self.evaluations += len(pairs)
        worst = int(np.argmax(out[0]))
        if out[0, worst] > self.best[0]:
            self.best[:3], self.best[3:] = out[:, worst], held[:, worst]
        return np.asarray(out[0])


def _search(
    context: ProbeContext, position: int, stored: Sequence[Array], before: Sequence[Worst], random: Array
) -> Worst:
    searched = context.sweep.cells[position]
    cell = _Cell(searched, context.sweep.kernels(position)[0], precision_named(searched.precision).eps)
    for candidate in stored:
        if candidate[0] > cell.best[0]:
            cell.best[:] = candidate
    place, ends = _boxes(cell, before[0].place if before else None, random)
    _leaves(cell, np.array([*ends, *(candidate[3:] for candidate in stored), *(f.pair for f in before)]))
    error, exact, value = (float(x) for x in cell.best[:3])
    return Worst(position, error, exact, value, cell.best[3:].copy(), place, cell.evaluations)


def _boxes(cell: _Cell, place: Array | None, random: Array) -> tuple[Array, Array]:
    """Stage 1: where the best point of the last boxes is, and the pairs of its best points."""
    middles = np.full((4, BOXES), 0.5)
    middles[0] = (np.arange(BOXES) + 0.5) / BOXES
    if place is not None:
        middles[:, -1] = place
    width = np.array([[0.5 / BOXES], [0.5], [0.5], [0.5]])
    points = errors = np.empty(0)
    for level in random:
        points = np.repeat(middles, POINTS, axis=1) + width * (2 * level - 1)
        points = np.clip(points, 0.0, 1.0)
        errors = cell.errors(_pairs(points, cell.exponent))
        each = errors.reshape(BOXES, POINTS)
        best_two = (np.argpartition(-each, 1, axis=1)[:, :2] + POINTS * np.arange(BOXES)[:, None]).ravel()
        middles = points[:, best_two[np.argsort(-errors[best_two], kind="stable")[:BOXES]]]
        width = width / 2
    best = np.argsort(-errors, kind="stable")[:LEAVES]
    return points[:, best[0]], _pairs(points[:, best], cell.exponent)


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
    addresses: Any, alpha: Any, coefficients: Any, table: Any, form: int, reach: float, a: Any, b: Any, out: Any
) -> None:
    """Fill the rows of `out`: |value - exact| or -1, exact, value."""
    n = a.shape[1]
    held, unit = np.empty((COORDINATE_ROWS, n), a.dtype), np.empty((COORDINATE_ROWS, n))
    a64, b64, values = np.empty((3, n)), np.empty((3, n)), np.empty(n, a.dtype)
    coordinates_at(addresses[0], a)(a, b, held)
    values_at(addresses[3], held)(held[form], held[COSINE_ROW], coefficients, table, values)
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
