"""The sweep: every cell of a plan over every stratum, in compiled code, on all threads, the same bits for any number of
them.

The unit of work is a block: one slab of one batch, where a batch is a set of cells that see the same pairs (same
precision, space, stratum and scale). Within a block every piece of pairs is made once, its coordinates and lambda forms
once, the exact value once per alpha, and then every cell passes over it while it lies in the cache.
"""

import time
from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any

from phongbench.accuracy.accumulators import ErrorAccumulator
from phongbench.accuracy.batches import Batch, batches
from phongbench.accuracy.cell_arrays import CellArrays
from phongbench.accuracy.coordinates import Layout
from phongbench.accuracy.reductions import measure_cells
from phongbench.compiler.lowering import FLOAT64, precision_named
from phongbench.compiler.precisions import Array
from phongbench.formulas import coordinate_kernels
from phongbench.formulas.kernel import known_values, table_row
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation
from phongbench.inputs.pairs import pairs
from phongbench.inputs.plan import Cell, Plan

#: pairs made and measured together; their coordinates stay in the second-level cache
PIECE = 8192
#: pairs in a block; sums are merged in slab order, so the bits do not depend on who computed which slab
SLAB = 1 << 18


@dataclass
class Sweep:
    """A plan made ready: its cells, its batches, and what failed.

    failures  cell position -> message of a cell that cannot be measured
    """

    plan: Plan
    registry: Mapping[str, Approximation]
    cells: list[Cell]
    batches: list[Batch]
    failures: dict[int, str] = field(default_factory=dict)
    made: dict[tuple[Any, ...], CellArrays] = field(default_factory=dict, repr=False)

    @property
    def evaluations(self) -> int:
        """(sample, cell) pairs of the whole sweep."""
        return sum(c.evaluations for c in self.batches)


@dataclass(frozen=True)
class Measured:
    """What one batch gave: its errors, whose rows are `cells` in order, each once per truth."""

    batch: Batch
    cells: tuple[int, ...]
    errors: ErrorAccumulator

    @property
    def rows(self) -> int:
        """Rows of the errors."""
        return len(self.cells) * self.batch.truths


def prepare(plan: Plan, registry: Mapping[str, Approximation] = REGISTRY) -> Sweep:
    """The cells and batches of a plan; nothing is compiled or measured yet."""
    cells = list(plan.cells(registry))
    return Sweep(plan, registry, cells, batches(plan, cells, registry))


def compile_kernels(sweep: Sweep, progress: Callable[[int, int], None] | None = None) -> int:
    """Compile every loop the sweep needs, or load it from the cache.

    Cells whose kernel fails are noted in `failures`.
    """
    wanted: dict[tuple[Any, ...], list[int]] = {}
    for position, cell in enumerate(sweep.cells):
        try:
            known = known_values(sweep.registry[cell.approximation], cell.setting)
            table_row(sweep.registry[cell.approximation], cell.setting, FLOAT64)
        except Exception as problem:  # noqa: BLE001  whatever a user's own formula raises concerns its cell alone
            sweep.failures[position] = f"{type(problem).__name__}: {problem}"
            continue
        wanted.setdefault((cell.approximation, cell.precision, known), []).append(position)
    for done, ((name, precision, known), positions) in enumerate(wanted.items()):
        if progress:
            progress(done, len(wanted))
        try:
            for p in (precision_named(precision), FLOAT64):
                coordinate_kernels.values_kernel(sweep.registry[name], p, known)
        except Exception as problem:  # noqa: BLE001  as above
            sweep.failures |= dict.fromkeys(positions, f"{type(problem).__name__}: {problem}")
    if progress:
        progress(len(wanted), len(wanted))
    return len(wanted)


def compile_drivers(sweep: Sweep) -> None:
    """Compile, or load from the cache, what surrounds the kernels: a block without cells touches all of it."""
    for carrier in {c.precision.carrier: c for c in sweep.batches if c.stratum.name != "hostile"}.values():
        for space in ("reflect", "half"):
            _block(sweep, replace(carrier, cells=(), samples=1, space=space), 0)


def run(
    sweep: Sweep, *, jobs: int = 1, done: Collection[int] = (), progress: Callable[[int], None] | None = None
) -> Iterator[Measured]:
    """Measure every batch that is not in `done`, in order of their index.

    jobs      threads; the results do not depend on it
    done      indices of batches to leave out
    progress  called with the number of evaluations as blocks finish
    """
    work = [(c, start) for c in sweep.batches if c.index not in done for start in range(0, c.samples, SLAB)]
    pending: deque[tuple[Batch, int, Future[Measured]]] = deque()
    merged: Measured | None = None
    with ThreadPoolExecutor(max_workers=jobs) as pool:
        try:
            queue = iter(work)
            while True:
                for batch, start in queue:
                    pending.append((batch, start, pool.submit(_block, sweep, batch, start)))
                    if len(pending) >= 4 * jobs:
                        break
                if not pending:
                    return
                batch, start, future = pending.popleft()
                part = future.result()
                if progress:
                    progress(min(SLAB, batch.samples - start) * len(batch.cells))
                if start == 0:
                    merged = part
                elif merged is not None:
                    merged.errors.merge(part.errors)
                if merged is not None and start + SLAB >= batch.samples:
                    yield merged
        finally:
            for _, _, future in pending:
                future.cancel()


def trial_rates(sweep: Sweep, samples: int = 2 * PIECE) -> dict[str, float]:
    """Evaluations per second and thread for each stratum of the sweep, from a short trial of its middle batch."""
    rates: dict[str, float] = {}
    for name in dict.fromkeys(c.stratum.name for c in sweep.batches):
        batches = [c for c in sweep.batches if c.stratum.name == name]
        batch = replace(batches[len(batches) // 2], samples=samples)
        _block(sweep, batch, 0)  # compiles, and fills the caches
        started = time.perf_counter()
        _block(sweep, batch, 0)
        rates[name] = batch.evaluations / (time.perf_counter() - started)
    return rates


def _block(sweep: Sweep, batch: Batch, start: int) -> Measured:
    """Measure one slab of a batch."""
    live = tuple(c for c in batch.cells if c not in sweep.failures)
    alphas = tuple(dict.fromkeys(sweep.cells[c].alpha for c in live))
    key = (live, batch.precision, batch.truths)
    # most strata of an alpha share their cells; two threads may both make them, with equal content
    if key not in sweep.made:
        sweep.made[key] = cell_arrays(sweep, batch, live, alphas)
    cells = sweep.made[key]
    errors = ErrorAccumulator(len(live) * batch.truths)
    count = min(SLAB, batch.samples - start)
    layout = _layout(batch, alphas, min(PIECE, count))
    for piece in range(start, start + count, PIECE):
        a, b = pairs(
            batch.stratum,
            batch.precision,
            seed=sweep.plan.seed,
            start=piece,
            count=min(PIECE, start + count - piece),
            scale=batch.scale,
            half_space=batch.space == "half",
        )
        held, given, unit, exact = layout.lay_out(a, b)
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
            unit,
            exact,
            errors.sums,
            errors.counts,
            errors.bins,
            errors.worst,
            batch.truths,
        )
    errors.samples = count
    return Measured(batch, live, errors)


def cell_arrays(sweep: Sweep, batch: Batch, live: Sequence[int], alphas: Sequence[float]) -> CellArrays:
    """What the compiled loops need to know of each cell; the rows of the errors follow the order of `live`."""
    chosen = [(sweep.cells[c], sweep.registry[sweep.cells[c].approximation]) for c in live]
    return CellArrays.of(chosen, alphas, batch.precision, batch.truths)


def _layout(batch: Batch, alphas: Sequence[float], size: int) -> Layout:
    return Layout(batch.precision, batch.space, batch.truths, alphas, size)


def exact_values(batch: Batch, alpha: float, a: Array, b: Array) -> Array:
    """The truths of pairs as the sweep computes them: float64 (truths, n), angle and, where the batch has it, given.

    a, b  (3, n) in the carrier of the batch's precision
    """
    return _layout(batch, (alpha,), a.shape[1]).lay_out(a, b)[3][0, : batch.truths].copy()
