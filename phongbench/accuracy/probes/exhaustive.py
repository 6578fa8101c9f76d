"""Every cosine there is: formulas of one number, measured over all values that a precision can hold.

A kernel of the cosine, and the `dot` form, see two directions through one number, x = a.b. So the input of this stratum
is x itself, lambda = 1 - x is computed in the working precision, and the truth is Phong of the angle that x names. What
is left out against pairs of vectors is the rounding of a.b; what is gained is that nothing is left to chance: the rows
are `exhaustive`. A seeded subset of the same numbers gives `sampled` rows, which can never be worse.

Domain, by precision: float16, bfloat16 and fixed point of up to 16 bits all of [-1, 1], half space [0, 1]; float32 all
8,388,609 cosines in [0.5, 1]. Wider ones have too many.
"""

import math
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from itertools import product

import numpy as np
import pandas as pd

from phongbench.accuracy import tables
from phongbench.accuracy.accumulators import ErrorAccumulator
from phongbench.accuracy.batches import Batch
from phongbench.accuracy.coordinates import Piece
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.accuracy.sweep import PIECE, SLAB, Measured, Sweep
from phongbench.compiler.lowering import FLOAT32, Precision, precision_named
from phongbench.compiler.precisions import Array
from phongbench.inputs.plan import Cell, Plan
from phongbench.inputs.strata import Stratum

COSINES = Stratum("cosines")
#: quick looks closely at the exponents of its plan that are nearest to these, and at reflect space only
QUICK_EXPONENTS = (10.0, 50.0)
#: evaluations a second and thread, for the forecast only
RATE = 4e8


@dataclass(frozen=True)
class Domain:
    """The cosines of some cells: all numbers of a precision in [low, high]; and the exponents they are used for."""

    precision: Precision
    space: str
    gated: bool
    low: float
    alphas: tuple[float, ...]
    high: float = 1.0

    @property
    def values(self) -> Array:
        """Every number of the domain once, in the carrier, scattered so that any run of them is a fair sample."""
        count = _count(self.precision, self.low, self.high)
        step = round(count * (math.sqrt(5) - 1) / 2)
        while math.gcd(step, count) > 1:
            step += 1
        order = np.arange(count, dtype=np.int64)
        order *= step
        order %= count
        if self.precision != FLOAT32:
            return representables(self.precision, self.low, self.high)[order]
        order += _bits(self.low)  # the number itself: a third of the time of looking it up
        return order.astype(np.int32).view(np.float32)


def representables(precision: Precision, low: float, high: float) -> Array:
    """Every number of a precision in [low, high], ascending, in the carrier; one zero. float32 from a positive low."""
    if precision != FLOAT32:
        return precision.representables(low, high)
    return np.arange(_bits(low), _bits(high) + 1, dtype=np.int32).view(np.float32)


def _bits(number: float) -> int:
    return int(np.float32(number).view(np.int32))


def domains(plan: Plan) -> list[Domain]:
    """What is measured for a plan: gated cells in every space, the ungated `dot` form where negative cosines are."""
    chosen, quick = [], plan.preset == "quick"
    for precision, space in product(map(precision_named, plan.precisions), plan.spaces):
        if precision.listed and space == "reflect":
            chosen += [Domain(precision, space, gated, -1.0, plan.alphas) for gated in (True, False)]
        elif precision.listed:
            chosen.append(Domain(precision, space, True, 0.0, plan.alphas))
        elif precision == FLOAT32 and not (quick and space == "half"):
            chosen.append(Domain(precision, space, True, 0.5, exponents(plan)))
    return chosen


def exponents(plan: Plan) -> tuple[float, ...]:
    """The exponents that get the costly treatment: all, but in quick those nearest to QUICK_EXPONENTS."""
    if plan.preset != "quick":
        return plan.alphas
    return nearest_to(plan.alphas)


def nearest_to(alphas: Iterable[float]) -> tuple[float, ...]:
    """Those nearest to QUICK_EXPONENTS."""
    known = tuple(alphas)
    return tuple(sorted({min(known, key=lambda a: abs(math.log(a / wanted))) for wanted in QUICK_EXPONENTS}))


def seen(cell: Cell) -> bool:
    """True if a cell sees two directions through their cosine alone."""
    return cell.lambda_form in ("none", "dot") and not cell.formula.raw


def measure(context: ProbeContext) -> Mapping[str, pd.DataFrame]:
    """Exhaustive and sampled rows of accuracy, and the worst inputs of the exhaustive ones."""
    work = [(d, cells) for d in domains(context.plan) if (cells := _cells_of(context.sweep, d))]
    total = sum(_size(d) * len(cells) for d, cells in work)
    exhaustive, sampled, worst = [], [], []
    for domain, cells in work:
        values = domain.values
        # alone in its tables, a batch is their first
        whole = Batch(0, domain.precision, domain.space, COSINES, 1.0, cells, len(values))
        rows, worst_rows = _rows(context.sweep, over(context, whole, values, total), "exhaustive")
        exhaustive.append(rows)
        worst.append(worst_rows)
        subset = _subset(values, context.plan)
        part = over(context, replace(whole, samples=len(subset)), subset, math.inf)
        sampled.append(_rows(context.sweep, part, "sampled")[0])
    if not work:
        return {}
    return {
        "accuracy": pd.concat([*exhaustive, *sampled], ignore_index=True),
        "worst": pd.concat(worst, ignore_index=True),
    }


def seconds(plan: Plan, jobs: int) -> float:
    """What the exhaustive passes take."""
    cells = [c for c in plan.cells() if seen(c)]
    evaluations = sum(_size(d) for d in domains(plan) for c in cells if _belongs(c, d))
    return evaluations / RATE / jobs


def over(context: ProbeContext, batch: Batch, values: Array, total: float) -> Measured:
    """Measure the cells of a batch over these cosines; slabs are merged in order, so threads change no bit."""
    cells, half = context.sweep.arrays(batch.cells, batch.precision, 1), batch.space == "half"

    def slab(start: int) -> ErrorAccumulator:
        errors, stop = ErrorAccumulator(len(batch.cells)), min(start + SLAB, len(values))
        for piece in range(start, stop, PIECE):
            x = values[piece : min(piece + PIECE, stop)]
            cells.measure(Piece.of_cosines(batch.precision, x, cells.alphas, half), errors)
        return errors

    errors = ErrorAccumulator(len(batch.cells))
    with ThreadPoolExecutor(max_workers=context.jobs) as pool:
        for part in pool.map(slab, range(0, len(values), SLAB)):
            context.advance(int(part.samples) * len(batch.cells) / total)
            errors.merge(part)
    return Measured(batch, batch.cells, errors)


def _belongs(cell: Cell, domain: Domain) -> bool:
    where = (cell.precision, cell.formula.space, cell.gated)
    return where == (domain.precision.name, domain.space, domain.gated) and cell.alpha in domain.alphas


def _cells_of(sweep: Sweep, domain: Domain) -> tuple[int, ...]:
    """Positions of the cells that are measured over a domain, those of one exponent together."""
    chosen = [p for p, c in enumerate(sweep.cells) if seen(c) and _belongs(c, domain) and p not in sweep.failures]
    return tuple(sorted(chosen, key=lambda position: sweep.cells[position].alpha))


def _size(domain: Domain) -> int:
    return _count(domain.precision, domain.low, domain.high)


@cache
def _count(precision: Precision, low: float, high: float) -> int:
    return _bits(high) - _bits(low) + 1 if precision == FLOAT32 else len(representables(precision, low, high))


def _subset(values: Array, plan: Plan) -> Array:
    """A seeded sample of the domain, never more than a quarter of it."""
    count = max(1, min(plan.samples, len(values) // 4))
    return values[np.random.default_rng(plan.seed).choice(len(values), count, replace=False, shuffle=False)]


def _rows(sweep: Sweep, measured: Measured, coverage: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The rows of accuracy and of worst, whose inputs are unit vectors with this cosine: (1, 0, 0) and its like."""
    alone = replace(sweep, batches=[measured.batch])
    part = tables.part([measured])
    worst = tables.worst(alone, [part]).assign(coverage=coverage)
    cosine = [float.fromhex(x) for x in worst["bx"]]
    worst["by"] = pd.Series([math.sqrt((1 - x) * (1 + x)).hex() for x in cosine], dtype="str", index=worst.index)
    return tables.accuracy(alone, [part]).assign(coverage=coverage), worst
