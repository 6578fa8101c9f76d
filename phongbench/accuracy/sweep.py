"""The sweep: every cell of a plan over every stratum, in compiled code, on all threads, the same bits for any number of
them.

The unit of work is a block: one slab of one batch, where a batch is a set of cells that see the same pairs (same
precision, space, stratum and scale). Within a block every piece of pairs is made once, its coordinates and lambda forms
once, the exact value once per alpha, and then every cell passes over it while it lies in the cache.
"""

from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any

from phongbench.accuracy.accumulators import ErrorAccumulator
from phongbench.accuracy.batches import Batch, batches
from phongbench.accuracy.cell_arrays import CellArrays
from phongbench.accuracy.coordinates import Layout
from phongbench.compiler.lowering import FLOAT64, Precision, precision_named
from phongbench.compiler.precisions import Array
from phongbench.formulas.kernel import Kernel, known_values, table_row
from phongbench.formulas.recipes import PAIR
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation
from phongbench.inputs.plan import Cell, Plan
from phongbench.timing.interleaved import THREAD_CLOCK, clocked

#: pairs made and measured together; their coordinates stay in the second-level cache
PIECE = 8192
#: pairs in a block; sums are merged in slab order, so the bits do not depend on who computed which slab
SLAB = 1 << 18
#: how many times as many pairs the larger of two trials has
FURTHER = 2


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
    # both made at first use; two threads may both make one, with equal content
    _kernels: dict[int, tuple[Kernel, Kernel]] = field(default_factory=dict, init=False, repr=False)
    _arrays: dict[tuple[Any, ...], CellArrays] = field(default_factory=dict, init=False, repr=False)

    @property
    def evaluations(self) -> int:
        """(sample, cell) pairs of the whole sweep."""
        return sum(b.evaluations for b in self.batches)

    def kernels(self, position: int) -> tuple[Kernel, Kernel]:
        """The compiled kernel of the cell at this position, in its own precision and in float64."""
        if position not in self._kernels:
            cell = self.cells[position]
            spec, own = cell.formula.spec(self.registry), precision_named(cell.precision)
            self._kernels[position] = Kernel.of(spec, cell.setting, own), Kernel.of(spec, cell.setting, FLOAT64)
        return self._kernels[position]

    def arrays(self, positions: tuple[int, ...], precision: Precision, truths: int) -> CellArrays:
        """Cells of one precision ready to be measured; most strata of an exponent share theirs."""
        key = (positions, precision, truths)
        if key not in self._arrays:
            cells = [(self.cells[p], *self.kernels(p)) for p in positions]
            self._arrays[key] = CellArrays.of(cells, precision, truths)
        return self._arrays[key]


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
    """Compile every loop the sweep needs, or load it from the cache; how many there are.

    Cells whose kernel fails are noted in `failures`.
    """
    loops: dict[tuple[Any, ...], list[int]] = {}
    for position, cell in enumerate(sweep.cells):
        spec = cell.formula.spec(sweep.registry)
        try:
            key = (cell.approximation, cell.precision, known_values(spec, cell.setting))
            table_row(spec, cell.setting, FLOAT64)
        except Exception as problem:  # noqa: BLE001  whatever a user's own formula raises concerns its cell alone
            sweep.failures[position] = f"{type(problem).__name__}: {problem}"
        else:
            loops.setdefault(key, []).append(position)
    for done, positions in enumerate(loops.values()):
        if progress:
            progress(done, len(loops))
        try:
            sweep.kernels(positions[0])
        except Exception as problem:  # noqa: BLE001  as above
            sweep.failures |= dict.fromkeys(positions, f"{type(problem).__name__}: {problem}")
    if progress:
        progress(len(loops), len(loops))
    return len(loops)


def compile_layouts(sweep: Sweep) -> None:
    """Compile, or load from the cache, the loops of coordinates and truths that lay the batches' pairs out."""
    kinds = {(b.precision, b.recipe, b.normalise, b.half_space_truth, b.truths): b for b in sweep.batches}
    for batch in kinds.values():
        Layout(batch, (), 1)


def compile_drivers(sweep: Sweep) -> None:
    """Compile, or load from the cache, what surrounds the kernels: blocks without cells touch all of it.

    Of each kind of pairs one, of formulas for unit vectors where these see it: what lays out other ones is no driver.
    """
    told = sorted((b for b in sweep.batches if b.stratum.name != "hostile"), key=lambda b: not b.raw)
    kinds = {(b.stratum.name, b.precision.carrier, b.recipe == PAIR, b.space): b for b in told}
    for batch in kinds.values():
        _block(sweep, replace(batch, cells=(), samples=1), 0)


def run(
    sweep: Sweep, *, jobs: int = 1, done: Collection[int] = (), progress: Callable[[int], None] | None = None
) -> Iterator[Measured]:
    """Measure every batch that is not in `done`, in order of their index.

    jobs      threads; the results do not depend on it
    done      indices of batches to leave out
    progress  called with the number of evaluations as blocks finish
    """
    merged: Measured | None = None
    chosen = [(batch, start) for batch in sweep.batches if batch.index not in done for start in slabs(batch)]
    for _, block in blocks(sweep, chosen, jobs):
        if progress:
            progress(int(block.errors.samples) * len(block.batch.cells))
        if merged is None:
            merged = block
        else:
            merged.errors.merge(block.errors)
        if merged.errors.samples == merged.batch.samples:
            yield merged
            merged = None


def slabs(batch: Batch) -> range:
    """The pairs at which the slabs of a batch begin."""
    return range(0, batch.samples, SLAB)


def blocks(sweep: Sweep, chosen: Iterable[tuple[Batch, int]], jobs: int = 1) -> Iterator[tuple[int, Measured]]:
    """These blocks in order, each a batch and where its slab begins; the latter is given back with what was measured.

    A few are measured ahead, so that no thread waits.
    """
    pending: deque[tuple[int, Future[Measured]]] = deque()
    with ThreadPoolExecutor(max_workers=jobs) as pool:
        try:
            for batch, start in chosen:
                pending.append((start, pool.submit(_block, sweep, batch, start)))
                if len(pending) >= 4 * jobs:
                    first, block = pending.popleft()
                    yield first, block.result()
            while pending:
                first, block = pending.popleft()
                yield first, block.result()
        finally:
            for _, block in pending:
                block.cancel()


def trial(sweep: Sweep, samples: int = PIECE) -> Callable[[Batch, int], float]:
    """Predicts the seconds of a block on one thread, by its batch and its pairs, from short trials.

    Of a kind of batches the one with the fewest and the one with the most cells are tried, with few pairs and with
    more: a block takes so long, every pair of it so long more, and both grow with the cells. What other programs take
    of the processor meanwhile is not counted.
    """
    kinds: dict[tuple[Any, ...], list[Batch]] = {}
    for batch in sweep.batches:
        kinds.setdefault(_kind(batch), []).append(batch)
    costs: dict[tuple[Any, ...], Callable[[int, int], float]] = {}

    def seconds(batch: Batch, pairs: int) -> float:
        kind = _kind(batch)
        if kind not in costs:
            costs[kind] = _cost(sweep, kinds[kind], samples)
        return costs[kind](len(batch.cells), pairs)

    return seconds


def _kind(batch: Batch) -> tuple[Any, ...]:
    """What is the same in batches whose blocks, pairs and cells cost the same."""
    return batch.stratum.name, batch.precision, batch.recipe, batch.normalise, batch.truths


def _cost(sweep: Sweep, alike: list[Batch], samples: int) -> Callable[[int, int], float]:
    """Seconds of a block of one kind, by the number of its cells and of its pairs."""
    few, many = min(alike, key=lambda b: len(b.cells)), max(alike, key=lambda b: len(b.cells))
    tried = (few, many) if many is not few else (few,)
    ends = [(len(batch.cells), *_tried(sweep, batch, samples)) for batch in tried]

    def seconds(cells: int, pairs: int) -> float:
        (n, block, pair), (m, block_m, pair_m) = ends[0], ends[-1]
        share = (cells - n) / (m - n) if m > n else 0.0
        return block + share * (block_m - block) + pairs * (pair + share * (pair_m - pair))

    return seconds


def _tried(sweep: Sweep, batch: Batch, samples: int) -> tuple[float, float]:
    """Seconds of a block of a batch whatever its pairs, and of each pair with all cells; from two sizes of blocks."""
    small, large = (min(count, batch.samples) for count in (samples, FURTHER * samples))
    took = {count: _clocked_block(sweep, replace(batch, samples=count)) for count in (small, large)}
    if large < 2 * small:  # a whole block, of few pairs
        return 0.0, took[large] / large
    pair = max(0.0, took[large] - took[small]) / (large - small)
    return max(0.0, took[small] - small * pair), pair


def _clocked_block(sweep: Sweep, batch: Batch) -> float:
    """Seconds of the first block of a batch, by the second time: the first compiles, and fills the caches."""
    _block(sweep, batch, 0)
    return clocked(lambda: _block(sweep, batch, 0), THREAD_CLOCK)()


def _block(sweep: Sweep, batch: Batch, start: int) -> Measured:
    """Measure one slab of a batch."""
    live = tuple(c for c in batch.cells if c not in sweep.failures)
    cells, errors = sweep.arrays(live, batch.precision, batch.truths), ErrorAccumulator(len(live) * batch.truths)
    stop = min(start + SLAB, batch.samples)
    layout = Layout(batch, cells.alphas, min(PIECE, stop - start))
    for piece in range(start, stop, PIECE):
        a, b = batch.pairs(sweep.plan.seed, piece, min(PIECE, stop - piece))
        cells.measure(layout.lay_out(a, b), errors)
    return Measured(batch, live, errors)


def exact_values(batch: Batch, alpha: float, a: Array, b: Array) -> Array:
    """The truths of pairs as the sweep computes them: float64 (truths, n), angle and, where the batch has it, given.

    a, b  (3, n) in the carrier of the batch's precision
    """
    return Layout(batch, (alpha,), a.shape[1]).lay_out(a, b).exact[0, : batch.truths].copy()
