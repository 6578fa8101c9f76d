"""Kernels over one set of buffers: allocation, calibration, verification, and one epoch with its evidence.

Nothing here decides anything about rounds or statistics; see session.py, budget.py and rounds.py.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler.lowering import Precision
from phongbench.compiler.precisions import Array
from phongbench.errors import MeasurementError
from phongbench.formulas.kernel import read_only
from phongbench.formulas.recipes import PAIR
from phongbench.results.machine import MEMORY_CAP, Caches, cache_sizes
from phongbench.timing import epoch_loop
from phongbench.timing.interference import Witness, disturbed
from phongbench.timing.rounds import EPOCH_NS, Epoch, agreed, repeats_for
from phongbench.timing.timed_kernels import ROWS, TimedKernel, highlight_configurations, highlight_pairs

#: (precision, seed, count) -> a, b of shape (3, count); or a, V above L, and N
Inputs = Callable[[Precision, int, int], tuple[Array, ...]]

WORKING_SETS = ("l1", "l2", "memory")
#: nanoseconds of an epoch that are not its loop: Python, counters, and two spins; and what a second thread adds
OVERHEAD_NS, MEETING_NS = 70_000, 120_000
#: one untimed pass for so many timed ones
_WARM = 10
#: threads that start further apart than this did not run together
_APART_NS = 5_000
#: how many values are compared with plain Python, and which share of them may differ: a table's value may land beyond
#: a step
_CHECKED, _STRAY = 512, 0.01


def elements_of(total_bytes: float, precision: Precision) -> int:
    """Pairs whose seven rows fill about this many bytes.

    A row is an odd multiple of 512 bytes: no two rows share their cache sets, no store is mistaken for a load 4096
    bytes away, and every vector width divides it.
    """
    lines = max(1, 2 * round((total_bytes / ROWS / 512 - 1) / 2) + 1)
    return lines * 512 // precision.carrier.itemsize


def memory_sizes(caches: Caches) -> tuple[int, ...]:
    """Bytes the working set "memory" may have, largest first.

    Four times the last-level cache, or MEMORY_CAP where that is more than the cap; small budgets may halve it down to
    twice the last level, and on servers whose last level is larger than the cap down to eight times the second.
    """
    largest = min(4 * caches.last, MEMORY_CAP)
    floor = min(largest, max(8 * caches.l2, 2 * caches.last if 2 * caches.last <= MEMORY_CAP else 0))
    return tuple(size for size in (largest >> k for k in range(16)) if size >= floor)


def block_bytes() -> dict[str, int]:
    """Bytes of each working set on this machine, "memory" at its smallest."""
    caches = cache_sizes()
    return {"l1": caches.l1 // 2, "l2": caches.l2 // 2, "memory": memory_sizes(caches)[-1]}


def aligned_rows(*inputs: Array) -> Array:
    """A copy of these inputs, one above the other, in one aligned piece of memory; its last row is for results."""
    held = np.concatenate(inputs)
    count, row, size = held.shape[1], held.shape[1] * held.itemsize, len(held) + 1
    raw = np.zeros(size * row + 64, np.uint8)
    start = -raw.ctypes.data % 64
    rows = raw[start : start + size * row].view(held.dtype).reshape(size, count)
    rows[:-1] = held
    return rows


@dataclass(frozen=True)
class Share:
    """What one thread works on: its own inputs, output and scratch, in one aligned piece of memory.

    a, b     (3, n)    the pairs; b is (6, n), V above L, where recipes are timed too
    normals  (3, n)    for recipes; a without any
    """

    a: Array
    b: Array
    normals: Array
    out: Array
    scratch: NDArray[np.int64]

    @staticmethod
    def of(*inputs: Array) -> "Share":
        """A share with a copy of these inputs."""
        rows = aligned_rows(*inputs)
        scratch = np.zeros(epoch_loop.SCRATCH, np.int64)
        normals = rows[-4:-1] if len(inputs) == 3 else rows[:3]
        return Share(
            read_only(rows[:3]), read_only(rows[3 : 3 + len(inputs[1])]), read_only(normals), rows[-1], scratch
        )

    def first(self, kernel: TimedKernel) -> Array:
        """What this kernel takes first: a, or the normals of a recipe."""
        return self.a if kernel.recipe == PAIR else self.normals

    def digest(self) -> int:
        """Checksum of the output."""
        return int(epoch_loop.digest(self.out.view(np.int64)))


class Block:
    """All kernels of one precision over one set of buffers.

    lit      the share of pairs that are lit, where that is what the block is about; see skip_kernels.py
    pass_ns  (kernels,)  nanoseconds of a pass of each kernel, over the number of its threads
    repeats  (kernels,)  how many passes make an epoch of each
    differs  the kernels whose output differed from the verified one while they were timed
    """

    def __init__(
        self,
        working_set: str,
        precision: Precision,
        kernels: list[TimedKernel],
        total_bytes: int,
        seed: int,
        inputs: Inputs | None = None,
        lit: float | None = None,
    ) -> None:
        from_n_l_v = any(kernel.recipe != PAIR for kernel in kernels)
        self.inputs: Inputs = inputs or (highlight_configurations if from_n_l_v else highlight_pairs)
        self.working_set, self.precision, self.kernels = working_set, precision, kernels
        self.lit, self.cached = lit, working_set != "memory"
        self.pool: ThreadPoolExecutor | None = None
        self.allocate(total_bytes, seed)
        self.repeats: NDArray[np.int64] = np.ones(len(kernels), np.int64)
        self.pass_ns: NDArray[np.float64] = np.zeros(len(kernels))
        self.digests: list[int] = []
        self.differs: set[int] = set()
        self.usual_spin = 0.0

    @staticmethod
    def prepare(precision: Precision, kernels: list[TimedKernel]) -> None:
        """Compile the drivers for this precision, and what makes the inputs of these kernels; the first is run."""
        block = Block("l1", precision, kernels, 1, 0)
        block.nanoseconds(0, 1)
        block.shares[0].digest()
        epoch_loop.spin(block.shares[0].scratch)
        epoch_loop.tick()

    @property
    def threads(self) -> int:
        """The most threads any kernel runs on."""
        return max(kernel.threads for kernel in self.kernels)

    def allocate(self, total_bytes: int, seed: int) -> None:
        """Inputs for every thread, equal but in memory of its own."""
        self.elements = elements_of(total_bytes, self.precision)
        inputs = self.inputs(self.precision, seed, self.elements)
        self.shares = [Share.of(*inputs) for _ in range(self.threads)]

    def enlarge(self, scale: float, total_bytes: int, seed: int) -> None:
        """Take larger buffers after calibration; passes are expected to take that much longer."""
        self.shares = []
        self.allocate(total_bytes, seed)
        self.pass_ns = self.pass_ns * scale

    def keep(self, places: list[int]) -> None:
        """Leave out all kernels but these."""
        self.kernels, self.pass_ns, self.repeats = (
            [self.kernels[i] for i in places],
            self.pass_ns[places],
            self.repeats[places],
        )
        self.digests = [self.digests[i] for i in places] if self.digests else []
        self.shares = self.shares[: self.threads]

    def close(self) -> None:
        """Let go of the further threads."""
        if self.pool:
            self.pool.shutdown()
            self.pool = None

    def nanoseconds(self, index: int, repeats: int) -> float:
        """Nanoseconds of that many passes, from the first start to the last end; over the number of threads.

        Spins are left in each scratch.
        """
        timed = self.kernels[index]
        threads, kernel = timed.threads, timed.kernel
        loop, row, table = kernel.loop, kernel.coefficients, kernel.table
        meeting, warm = np.zeros(threads * epoch_loop.STRIDE, np.int64), self.warm(repeats)

        def work(me: int) -> None:
            mine = self.shares[me]
            a, b, out, scratch = mine.first(timed), mine.b, mine.out, mine.scratch
            epoch_loop.run(loop, a, b, row, table, out, warm, repeats, scratch, meeting, me)

        if threads > 1 and self.pool is None:
            self.pool = ThreadPoolExecutor(self.threads - 1)
        others = [self.pool.submit(work, me) for me in range(1, threads)] if self.pool else []
        work(0)
        for other in others:
            other.result()
        stamps = np.array([share.scratch[[epoch_loop.STARTED, epoch_loop.ENDED]] for share in self.shares[:threads]])
        return float(stamps[:, 1].max() - stamps[:, 0].min()) / threads

    def warm(self, repeats: int) -> int:
        """Untimed passes before so many timed ones: they bring inputs back into the cache, and the core to its pace.

        Beyond the cache too: without one, what a kernel follows in the order showed, and told the twin apart by 4 %.
        """
        return max(1, repeats // _WARM)

    def calibrate(self, tick: float) -> None:
        """Nanoseconds of a pass of each kernel, from two readings that agree, and the repeats that fill its epoch.

        Epochs are equally long, not equally many passes: with as many as the fastest formula needs, epochs of all were
        four times as long on the mean, libm's power thirty times, for intervals that were no narrower.
        """
        for index, kernel in enumerate(self.kernels):
            few = max(1, round(0.2 * EPOCH_NS / max(1.0, self.nanoseconds(index, 1)))) if self.cached else 1
            self.pass_ns[index] = agreed(partial(self._reading, index, few))
            self.repeats[index] = repeats_for(self.pass_ns[index] * kernel.threads, tick)
        scratch = self.shares[0].scratch
        self.usual_spin = float(np.percentile([epoch_loop.spin(scratch) for _ in range(51)], 25))

    def _reading(self, index: int, repeats: int) -> float:
        return max(1.0, self.nanoseconds(index, repeats)) / repeats

    def verify(self) -> list[MeasurementError]:
        """Run every kernel once and compare it with plain Python; what differs is left out, and reported."""
        problems: list[MeasurementError] = []
        right: dict[int, int] = {}
        mine = self.shares[0]
        for index, kernel in enumerate(self.kernels):
            for share in self.shares:
                share.out.fill(np.nan)
            self.nanoseconds(index, 1)
            a, b = (rows[:, :_CHECKED].astype(np.float64) for rows in (mine.first(kernel), mine.b))
            off = ~(np.abs(mine.out[:_CHECKED] - kernel.plain(a, b)) <= kernel.tolerance)
            if (wrong := float(off.mean())) > _STRAY:
                problems.append(self.void(kernel, f"{wrong:.0%} of its values differ from the plain formula"))
            else:
                right[index] = self.digest()
        self.keep(list(right))
        self.digests = list(right.values())
        return problems

    def void(self, kernel: TimedKernel, why: str) -> MeasurementError:
        """The problem that takes this kernel's row away."""
        key = kernel.key[:5] if kernel.as_given else kernel.key
        words = " ".join(str(part) for part in key if part is not None)
        return MeasurementError(f"{why}; its row is left out", f"{words}, {self.working_set}", "the kernel is wrong")

    @property
    def where(self) -> str:
        """The block's name for people."""
        return f"{self.working_set}, {self.precision.name}" + ("" if self.lit is None else f", {self.lit:.0%} lit")

    def digest(self, share: int = 0) -> int:
        """Checksum of a thread's output."""
        return self.shares[share].digest()

    def seconds_of(self, indices: list[int]) -> float:
        """What a round of these kernels is expected to take."""
        passes = np.array([repeats + self.warm(repeats) for repeats in self.repeats[indices].tolist()])
        threads = np.array([self.kernels[i].threads for i in indices])
        total = float((self.pass_ns[indices] * threads * passes + OVERHEAD_NS + MEETING_NS * (threads > 1)).sum())
        return (total if self.cached else 1.15 * total) / 1e9  # reading a large output to check it

    @property
    def round_seconds(self) -> float:
        """What a round of all kernels is expected to take."""
        return self.seconds_of(list(range(len(self.kernels))))

    def epoch(self, witness: Witness, index: int) -> Epoch:
        """One reading, nanoseconds of a pass, with its evidence; its outputs are compared with the verified one."""
        before, repeats = witness.see(0.0), int(self.repeats[index])
        nanoseconds = self.nanoseconds(index, repeats) / repeats
        used = [share.scratch for share in self.shares[: self.kernels[index].threads]]
        after = witness.see(float(max(max(s[epoch_loop.SPIN_BEFORE], s[epoch_loop.SPIN_AFTER]) for s in used)))
        if any(self.digest(me) != self.digests[index] for me in range(len(used))):
            self.differs.add(index)
        starts = [int(s[epoch_loop.STARTED]) for s in used]
        apart = max(starts) - min(starts) > _APART_NS
        return Epoch(nanoseconds, apart or disturbed(before, after, self.usual_spin))
