"""Kernels over one set of buffers, and the compiled epoch that times one of them without any Python inside.

Nothing here decides anything about rounds or statistics; see timing.py and clock.py.
"""

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench import clock, contenders, jit, kernels, sampling
from phongbench.clock import Epoch
from phongbench.contenders import Contender
from phongbench.errors import MeasurementError
from phongbench.lowering import Precision
from phongbench.provenance import MEMORY_CAP, Caches

Array = NDArray[Any]

WORKING_SETS = ("l1", "l2", "memory")
#: nanoseconds of an epoch that are not its loop: Python, counters, and two spins
OVERHEAD_NS = 70_000
_SPINS = 2000
#: one untimed pass for so many timed ones
_WARM = 10
#: how many values are compared with plain Python, and which share of them may differ: a table's value may land beyond
#: a step
_CHECKED, _STRAY = 512, 0.01


# compiled: an epoch, a spin, a digest


@jit.driver
def _read_clock(readings: Any, scratch: Any) -> None:
    for i in range(len(readings)):
        readings[i] = jit.nanoseconds(scratch)


def tick() -> float:
    """The smallest step of the clock that epochs are timed with, in nanoseconds; reading it takes about that long."""
    readings = np.zeros(1000, np.int64)
    _read_clock(readings, np.zeros(6, np.int64))
    return clock.tick(readings)


@jit.driver
def _spin(scratch: Any) -> Any:
    """Nanoseconds that a fixed chain of dependent instructions takes: longer when something else uses the core."""
    started = jit.nanoseconds(scratch)
    x = scratch[2] | 1
    for _ in range(_SPINS):
        x ^= x << 13
        x ^= x >> 7
        x ^= x << 17
    scratch[2] = x
    return jit.nanoseconds(scratch) - started


@jit.driver
def _run(
    kernel: Any, a: Any, b: Any, coefficients: Any, table: Any, out: Any, warm: int, repeats: int, scratch: Any
) -> None:
    """An epoch: spin, untimed passes, timed passes, spin. scratch[3:6] receives the three times.

    The last spin comes after one that is not looked at: for some microseconds after 512-bit instructions a core runs
    at half its pace (1.5 times 3 us here), so the first spin would accuse every vectorised kernel and acquit scalar
    ones.
    """
    scratch[3] = _spin(scratch)
    for _ in range(warm):
        kernel(a, b, coefficients, table, out)
    started = jit.nanoseconds(scratch)
    for _ in range(repeats):
        kernel(a, b, coefficients, table, out)
    scratch[4] = jit.nanoseconds(scratch) - started
    _spin(scratch)
    scratch[5] = _spin(scratch)


@jit.driver
def _digest(words: Any) -> Any:
    """A checksum of the bits, dependent on their places."""
    total = np.int64(0)
    for i in range(len(words)):
        total += words[i] * (2 * i + 1)
    return total


def elements_of(total_bytes: float, precision: Precision) -> int:
    """Pairs whose seven rows fill about this many bytes.

    A row is an odd multiple of 512 bytes: no two rows share their cache sets, no store is mistaken for a load 4096
    bytes away, and every vector width divides it.
    """
    lines = max(1, 2 * round((total_bytes / contenders.ROWS / 512 - 1) / 2) + 1)
    return lines * 512 // precision.carrier.itemsize


def memory_sizes(caches: Caches) -> tuple[int, ...]:
    """Bytes the working set "memory" may have, largest first.

    Four times the last-level cache, or MEMORY_CAP where that is more than the cap; small budgets may halve it down to
    twice the last level, and on servers whose last level is larger than the cap down to eight times the second.
    """
    largest = min(4 * caches.last, MEMORY_CAP)
    floor = min(largest, max(8 * caches.l2, 2 * caches.last if 2 * caches.last <= MEMORY_CAP else 0))
    return tuple(size for size in (largest >> k for k in range(16)) if size >= floor)


class Block:
    """All contenders of one precision over one set of buffers."""

    def __init__(
        self, working_set: str, precision: Precision, group: list[Contender], total_bytes: int, seed: int
    ) -> None:
        self.working_set, self.precision, self.contenders = working_set, precision, group
        self.cached = working_set != "memory"
        self.scratch = np.zeros(6, np.int64)
        self.allocate(total_bytes, seed)
        self.repeats = 1
        self.pass_ns: NDArray[np.float64] = np.zeros(len(group))
        self.digests: list[int] = []
        self.usual_spin = 0.0

    @staticmethod
    def prepare(precision: Precision, contender: Contender) -> None:
        """Compile the drivers for this precision."""
        block = Block("l1", precision, [contender], 1, 0)
        block.nanoseconds(0, 1)
        block.digest()
        _spin(block.scratch)
        tick()

    def allocate(self, total_bytes: int, seed: int) -> None:
        """Inputs of the highlight stratum, in one aligned piece of memory."""
        self.elements = elements_of(total_bytes, self.precision)
        row = self.elements * self.precision.carrier.itemsize
        raw = np.zeros(contenders.ROWS * row + 64, np.uint8)
        start = -raw.ctypes.data % 64
        arena = raw[start : start + contenders.ROWS * row].view(self.precision.carrier)
        rows = arena.reshape(contenders.ROWS, self.elements)
        a, b, self.out = rows[:3], rows[3:6], rows[6]
        highlight = next(s for s in sampling.STRATA if s.name == "highlight")
        a[:], b[:] = sampling.pairs(
            highlight, self.precision, seed=seed, start=0, count=self.elements, scale=1 / contenders.ALPHA
        )
        self.a, self.b = kernels.read_only(a), kernels.read_only(b)

    def enlarge(self, scale: float, total_bytes: int, seed: int) -> None:
        """Take larger buffers after calibration; passes are expected to take that much longer."""
        self.allocate(total_bytes, seed)
        self.pass_ns = self.pass_ns * scale

    def nanoseconds(self, index: int, repeats: int) -> int:
        """Nanoseconds of that many passes; the spins before and after are left in scratch."""
        c = self.contenders[index]
        _run(c.kernel, self.a, self.b, c.coefficients, c.table, self.out, self.warm(repeats), repeats, self.scratch)
        return int(self.scratch[4])

    def warm(self, repeats: int) -> int:
        """Untimed passes before so many timed ones: they bring inputs back into the cache, and the core to its pace."""
        return max(1, repeats // _WARM) if self.cached else 0

    def calibrate(self, tick: float) -> None:
        """Nanoseconds of a pass of each kernel, from two readings that agree; then the repeats that suit them all.

        The fastest formula fills an epoch, so slower ones take longer, libm's power many times longer; a bare copy may
        stay below an epoch, but not below the least number of ticks.
        """
        for index in range(len(self.contenders)):
            once = max(1, self.nanoseconds(index, 1))
            few = max(1, round(0.2 * clock.EPOCH_NS / once)) if self.cached else 1
            self.pass_ns[index] = clock.agreed(partial(self._reading, index, few))
        bare = (contenders.COPY, contenders.TRIAD)
        formulas = [ns for c, ns in zip(self.contenders, self.pass_ns, strict=True) if c.name not in bare]
        least = clock.repeats_for(float(self.pass_ns.min()), tick, 0.0)
        self.repeats = max(clock.repeats_for(min(formulas), tick), least)
        self.usual_spin = float(np.percentile([_spin(self.scratch) for _ in range(51)], 25))

    def _reading(self, index: int, repeats: int) -> float:
        return max(1, self.nanoseconds(index, repeats)) / repeats

    def verify(self, found: list[MeasurementError]) -> None:
        """Run every kernel once and compare it with plain Python; what differs is left out, and reported."""
        kept: list[int] = []
        self.digests = []
        a, b = (rows[:, :_CHECKED].astype(np.float64) for rows in (self.a, self.b))
        for index, c in enumerate(self.contenders):
            self.out.fill(np.nan)
            self.nanoseconds(index, 1)
            wrong = float(np.mean(~(np.abs(self.out[:_CHECKED] - c.plain(a, b)) <= c.tolerance)))
            if wrong > _STRAY:
                found.append(self.void(c, f"{wrong:.0%} of its values differ from the plain formula"))
            else:
                kept.append(index)
                self.digests.append(self.digest())
        self.contenders, self.pass_ns = [self.contenders[i] for i in kept], self.pass_ns[kept]

    def void(self, c: Contender, why: str) -> MeasurementError:
        """The problem that takes this contender's row away."""
        words = [str(part) for part in c.key if part is not None]
        return MeasurementError(
            f"{why}; its row is left out", f"{' '.join(words)}, {self.working_set}", "the kernel is wrong"
        )

    @property
    def where(self) -> str:
        """The block's name for people."""
        return f"{self.working_set}, {self.precision.name}"

    def digest(self) -> int:
        """Checksum of the output buffer."""
        return int(_digest(self.out.view(np.int64)))

    @property
    def round_seconds(self) -> float:
        """What a round is expected to take."""
        passes = self.repeats + self.warm(self.repeats)
        total = float((self.pass_ns * passes + OVERHEAD_NS).sum())
        return (total if self.cached else 1.15 * total) / 1e9  # reading a large output to check it

    def epoch(self, witness: clock.Witness, lying: set[int], index: int) -> Epoch:
        """One reading with its evidence; its output is compared with the verified one."""
        before = witness.see(0.0)
        nanoseconds = self.nanoseconds(index, self.repeats)
        after = witness.see(float(max(self.scratch[3], self.scratch[5])))
        if self.digest() != self.digests[index]:
            lying.add(index)
        return Epoch(float(nanoseconds), clock.disturbed(before, after, self.usual_spin))
