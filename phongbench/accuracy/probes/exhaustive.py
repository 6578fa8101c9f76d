"""Every cosine there is: formulas of one number, measured over all values that a precision can hold.

A kernel of the cosine, and the `dot` form, see two directions through one number, x = a.b. So the input of this stratum
is x itself, lambda = 1 - x is computed in the working precision, and the truth is Phong of the angle that x names. What
is left out against pairs of vectors is the rounding of a.b; what is gained is that nothing is left to chance: the rows
are `exhaustive`. A seeded subset of the same numbers gives `sampled` rows, which can never be worse.

Domain, by precision: float16, bfloat16 and fixed point of up to 16 bits all of [-1, 1], half space [0, 1]; float32 all
8,388,609 cosines in [0.5, 1]. Wider ones have too many.
"""

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from phongbench.accuracy import tables
from phongbench.accuracy.accumulators import ErrorAccumulator
from phongbench.accuracy.batches import Batch
from phongbench.accuracy.cell_arrays import CellArrays
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.accuracy.reductions import measure_cells
from phongbench.accuracy.sweep import PIECE, SLAB, Measured, Sweep, cell_arrays
from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32, FLOAT64, Precision, precision_named
from phongbench.compiler.precisions import Array
from phongbench.formulas import coordinate_kernels
from phongbench.formulas.coordinate_kernels import coordinates_at
from phongbench.formulas.exact import truth_at, truth_kernel
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
    found, quick = [], plan.preset == "quick"
    for precision, space in product(map(precision_named, plan.precisions), plan.spaces):
        if precision.listed and space == "reflect":
            found += [Domain(precision, space, gated, -1.0, plan.alphas) for gated in (True, False)]
        elif precision.listed:
            found.append(Domain(precision, space, True, 0.0, plan.alphas))
        elif precision == FLOAT32 and not (quick and space == "half"):
            found.append(Domain(precision, space, True, 0.5, exponents(plan)))
    return found


def exponents(plan: Plan) -> tuple[float, ...]:
    """The exponents that get the costly treatment: all, but in quick those nearest to QUICK_EXPONENTS."""
    if plan.preset != "quick":
        return plan.alphas
    return tuple(sorted({min(plan.alphas, key=lambda a: abs(math.log(a / wanted))) for wanted in QUICK_EXPONENTS}))


def seen(cell: Cell) -> bool:
    """True if a cell sees two directions through their cosine alone."""
    return cell.lambda_form in ("none", "dot")


def measure(context: ProbeContext) -> Mapping[str, pd.DataFrame]:
    """Exhaustive and sampled rows of accuracy, and the worst inputs of the exhaustive ones."""
    work = [(d, cells) for d in domains(context.plan) if (cells := _cells_of(context.sweep, d))]
    total = sum(_size(d) * len(cells) for d, cells in work)
    exhaustive, sampled, worst = [], [], []
    for index, (domain, cells) in enumerate(work):
        values = domain.values
        whole = _batch(index, domain, cells, len(values))
        found = over(context, whole, values, total)
        exhaustive.append(_rows(context.sweep, found, "exhaustive"))
        worst.append(_worst(context.sweep, found))
        subset = _subset(values, context.plan)
        found = over(context, replace(whole, samples=len(subset)), subset, math.inf)
        sampled.append(_rows(context.sweep, found, "sampled"))
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
    starts = range(0, len(values), SLAB)
    alphas = tuple(dict.fromkeys(context.sweep.cells[c].alpha for c in batch.cells))
    cells = cell_arrays(context.sweep, batch, batch.cells, alphas)

    def slab(start: int) -> ErrorAccumulator:
        return _slab(batch, cells, alphas, values[start : start + SLAB])

    errors: ErrorAccumulator | None = None
    with ThreadPoolExecutor(max_workers=context.jobs) as pool:
        for part in pool.map(slab, starts):
            context.advance(int(part.samples) * len(batch.cells) / total)
            if errors is None:
                errors = part
            else:
                errors.merge(part)
    assert errors is not None
    return Measured(batch, batch.cells, errors)


def _belongs(cell: Cell, domain: Domain) -> bool:
    where = (cell.precision, cell.formula.space, cell.gated)
    return where == (domain.precision.name, domain.space, domain.gated) and cell.alpha in domain.alphas


def _cells_of(sweep: Sweep, domain: Domain) -> tuple[int, ...]:
    """Positions of the cells that are measured over a domain, those of one exponent together."""
    found = [
        position
        for position, cell in enumerate(sweep.cells)
        if seen(cell) and _belongs(cell, domain) and position not in sweep.failures
    ]
    return tuple(sorted(found, key=lambda position: sweep.cells[position].alpha))


def _size(domain: Domain) -> int:
    return _count(domain.precision, domain.low, domain.high)


@cache
def _count(precision: Precision, low: float, high: float) -> int:
    return _bits(high) - _bits(low) + 1 if precision == FLOAT32 else len(representables(precision, low, high))


def _batch(index: int, domain: Domain, cells: tuple[int, ...], samples: int) -> Batch:
    return Batch(index, domain.precision, domain.space, COSINES, 1.0, cells, samples)


def _subset(values: Array, plan: Plan) -> Array:
    """A seeded sample of the domain, never more than a quarter of it."""
    count = max(1, min(plan.samples, len(values) // 4))
    return values[np.random.default_rng(plan.seed).choice(len(values), count, replace=False, shuffle=False)]


def _slab(batch: Batch, cells: CellArrays, alphas: Sequence[float], values: Array) -> ErrorAccumulator:
    errors = ErrorAccumulator(len(batch.cells))
    loops = (
        coordinate_kernels.coordinates_kernel(batch.precision),
        coordinate_kernels.coordinates_kernel(FLOAT64),
        truth_kernel(batch.space == "half", both=False),
    )
    addresses, exponents = np.array([jit.address(loop) for loop in loops]), np.array(alphas)
    for start in range(0, len(values), PIECE):
        a, b, held, given, exact = _laid_out(addresses, exponents, values[start : start + PIECE])
        measure_cells(
            cells.rows,
            cells.coefficients,
            cells.coefficients_64,
            cells.tables,
            cells.tables_64,
            a,
            b,
            held,
            given,
            given,
            exact,
            errors.sums,
            errors.counts,
            errors.bins,
            errors.worst,
            1,
        )
    errors.samples = len(values)
    return errors


def _laid_out(addresses: Array, alphas: Array, x: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Pairs (1, 0, 0), (x, 0, 0), whose product is x without rounding, their coordinates, and the exact values."""
    a, b = np.zeros((3, len(x)), x.dtype), np.zeros((3, len(x)), x.dtype)
    a[0], b[0] = 1, x
    held, given = (
        np.empty((coordinate_kernels.COORDINATE_ROWS, len(x)), x.dtype),
        np.empty((coordinate_kernels.COORDINATE_ROWS, len(x))),
    )
    exact = np.empty((len(alphas), 2, len(x)))
    _lay_out(addresses, alphas, a, b, a.astype(np.float64), b.astype(np.float64), held, given, exact)
    return a, b, held, given, exact


@jit.driver
def _lay_out(
    addresses: Any, alphas: Any, a: Any, b: Any, a64: Any, b64: Any, held: Any, given: Any, exact: Any
) -> None:
    coordinates_at(addresses[0], a)(a, b, held)
    coordinates_at(addresses[1], a64)(a64, b64, given)
    truth = truth_at(addresses[2], a64)
    for k in range(len(alphas)):
        truth(given[0], given[4], alphas[k : k + 1], exact[k, 0], exact[k, 1])


def _rows(sweep: Sweep, found: Measured, coverage: str) -> pd.DataFrame:
    alone = replace(sweep, batches=[replace(found.batch, index=0)])
    part = tables.part([replace(found, batch=alone.batches[0])])
    return tables.accuracy(alone, [part]).assign(coverage=coverage)


def _worst(sweep: Sweep, found: Measured) -> pd.DataFrame:
    """The worst inputs as unit vectors with this cosine: (1, 0, 0) and (x, sqrt(1 - x^2), 0)."""
    alone = replace(sweep, batches=[replace(found.batch, index=0)])
    frame = tables.worst(alone, [tables.part([replace(found, batch=alone.batches[0])])])
    cosine = [float.fromhex(x) for x in frame["bx"]]
    frame["by"] = pd.Series([math.sqrt((1 - x) * (1 + x)).hex() for x in cosine], dtype="str", index=frame.index)
    return frame.assign(coverage="exhaustive")
