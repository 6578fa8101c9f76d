"""The arithmetic of believable timing: orders, calibration, rounds of readings and what they amount to.

Nothing here knows a kernel; everything takes its readings as arguments, so a made-up clock tests all of it.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from phongbench.errors import MeasurementError
from phongbench.timing.statistics import Floats, Integers, Interval, ratio

#: an epoch is this many nanoseconds long, and at least this many ticks of the clock
EPOCH_NS, EPOCH_TICKS = 100_000, 1000
#: two readings agree when they differ by less than this
AGREEMENT = 0.1


def latin_square(size: int, rng: np.random.Generator) -> Integers:
    """A shuffled Latin square: every kernel once in each round (row) and once at each position (column).

    Williams' construction: for an even size every kernel also follows every other exactly once, so what one leaves
    behind in caches and clock frequency is spread evenly; a merely cyclic square would have the same predecessor
    everywhere. For an odd size no kernel follows another more than twice.
    """
    zigzag = np.array([(i + 1) // 2 if i % 2 else (size - i // 2) % size for i in range(size)], dtype=np.int64)
    square = (zigzag[None, :] + np.arange(size)[:, None]) % size
    return np.asarray(rng.permutation(size)[square[rng.permutation(size)]], dtype=np.int64)


def orders(size: int, rounds: int, rng: np.random.Generator) -> Iterator[Integers]:
    """The order of the kernels in each round: rows of Latin squares, a fresh one whenever the last is used up."""
    for start in range(0, rounds, size):
        yield from latin_square(size, rng)[: rounds - start]


def agreed(reading: Callable[[], float], tries: int = 8) -> float:
    """The smaller of the first two successive readings that agree; if none ever do, the smallest of all."""
    last = reading()
    best = last
    for _ in range(tries - 1):
        now = reading()
        if abs(now - last) <= AGREEMENT * min(now, last):
            return min(now, last)
        best, last = min(best, now), now
    return best


def repeats_for(nanoseconds: float, tick: float, least: float = EPOCH_NS) -> int:
    """How often a pass of this length must be repeated to make an epoch."""
    return max(1, math.ceil(max(least, EPOCH_TICKS * tick) / max(nanoseconds, 1e-3)))


def tick(readings: Integers) -> float:
    """The clock's step: the smallest difference between successive readings that is not 0."""
    steps = np.diff(readings)
    steps = steps[steps > 0]
    if not steps.size:
        raise MeasurementError("the clock does not advance between two readings", "timing", "time on another machine")
    return float(steps.min())


@dataclass(frozen=True, slots=True)
class Epoch:
    """One reading: nanoseconds of a pass of an epoch, NaN where there is none, and whether something disturbed it."""

    nanoseconds: float
    disturbed: bool = False


@dataclass(frozen=True)
class Readings:
    """All epochs of a block.

    used    float (rounds, kernels)  nanoseconds that count: the first undisturbed reading of a round, else the
                                     repeated one; NaN where a round left the kernel out
    clean   bool (rounds, kernels)   whether that reading is undisturbed
    marked  int (kernels,)           disturbed epochs, the repeated ones included
    """

    used: Floats
    clean: NDArray[np.bool_]
    marked: Integers

    def least(self, kernel: int) -> float:
        """The shortest undisturbed epoch, or the shortest of all where none is undisturbed."""
        return float(self._clean_ones(kernel).min())

    def median(self, kernel: int) -> float:
        """The median over undisturbed epochs, or over all where none is undisturbed."""
        return float(np.median(self._clean_ones(kernel)))

    def rounds(self, kernel: int) -> int:
        """In how many rounds the kernel was timed."""
        return int(np.isfinite(self.used[:, kernel]).sum())

    def ratio(self, kernel: int, other: int) -> Interval:
        """The kernel's time over another's, from the rounds that hold both."""
        both = np.isfinite(self.used[:, kernel]) & np.isfinite(self.used[:, other])
        return ratio(self.used[both, kernel], self.used[both, other])

    def with_further(self, further: "Readings", members: Sequence[int]) -> "Readings":
        """These readings with rounds appended in which only the members were timed, in that order."""
        columns = list(members)
        used = np.full((len(further.used), self.used.shape[1]), np.nan)
        clean = np.zeros(used.shape, np.bool_)
        marked = self.marked.copy()
        used[:, columns], clean[:, columns] = further.used, further.clean
        marked[columns] += further.marked
        return Readings(np.concatenate([self.used, used]), np.concatenate([self.clean, clean]), marked)

    def _clean_ones(self, kernel: int) -> Floats:
        column = self.used[:, kernel]
        there = np.isfinite(column)
        clean = there & self.clean[:, kernel]
        return column[clean] if clean.any() else column[there]


def run_rounds(
    epoch: Callable[[int], Epoch],
    kernels: int,
    rounds: int,
    rng: np.random.Generator,
    *,
    repeat: Callable[[], bool] = lambda: True,
    go_on: Callable[[int], bool] = lambda done: True,
    after_round: Callable[[int], None] = lambda done: None,
) -> Readings:
    """Time all kernels once per round, interleaved; a disturbed epoch is repeated once, and both readings are counted.

    epoch        kernel index -> Epoch
    repeat       whether there is time to repeat disturbed epochs
    go_on        rounds done -> whether to take another
    after_round  called with how many rounds are done
    """
    used: list[Floats] = []
    clean: list[NDArray[np.bool_]] = []
    marked = np.zeros(kernels, np.int64)
    for number, order in enumerate(orders(kernels, rounds, rng)):
        if not go_on(number):
            break
        times, undisturbed = np.empty(kernels), np.ones(kernels, np.bool_)
        for kernel in order.tolist():
            reading = epoch(kernel)
            marked[kernel] += reading.disturbed
            if reading.disturbed and repeat():
                reading = epoch(kernel)
                marked[kernel] += reading.disturbed
            times[kernel], undisturbed[kernel] = reading.nanoseconds, not reading.disturbed
        used.append(times)
        clean.append(undisturbed)
        after_round(number + 1)
    size = (len(used), kernels)
    return Readings(np.array(used).reshape(size), np.array(clean, np.bool_).reshape(size), marked)
