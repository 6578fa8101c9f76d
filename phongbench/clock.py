"""The arithmetic of believable timing: orders, calibration, intervals, verdicts, evidence of disturbances.

Nothing here knows a kernel; everything takes its readings as arguments, so a made-up clock tests all of it.
"""

import math
import os
import resource
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from phongbench.errors import MeasurementError

#: confidence of every interval; the sign test reaches it from 8 rounds on
LEVEL = 0.99
MIN_ROUNDS = 8
#: a difference smaller than this is never claimed: code layout alone makes as much
CLAIM = 0.02
#: an epoch is this many nanoseconds long, and at least this many ticks of the clock
EPOCH_NS, EPOCH_TICKS = 100_000, 1000
#: two readings agree when they differ by less than this
AGREEMENT = 0.1
#: a spin that takes this much longer than usual is evidence that something else had the core
SPIN_SLACK = 1.25

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


# orders


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


# calibration


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


# statistics


@dataclass(frozen=True, slots=True)
class Interval:
    """A median and the exact sign-test interval around it."""

    middle: float
    low: float
    high: float


def sign_test_rank(count: int, level: float = LEVEL) -> int:
    """The largest k whose k-th smallest and k-th largest of `count` values enclose the median so surely; 0 if none."""
    outside, k, total = 0, 0, 2**count
    while k < count:
        outside += math.comb(count, k)
        if 2 * outside > (1 - level) * total:
            break
        k += 1
    return k


def sign_interval(values: Floats, level: float = LEVEL) -> Interval:
    """The median with its sign-test interval, which assumes no distribution; unbounded below 8 values."""
    ordered, k = np.sort(values), sign_test_rank(len(values), level)
    low, high = (float(ordered[k - 1]), float(ordered[-k])) if k else (-math.inf, math.inf)
    return Interval(float(np.median(ordered)), low, high)


def ratio(times: Floats, baseline: Floats, level: float = LEVEL) -> Interval:
    """Time over the baseline's, paired by round: rounds are slow together, so quotients are quieter than times."""
    logs = sign_interval(np.log(times) - np.log(baseline), level)
    return Interval(math.exp(logs.middle), math.exp(logs.low), math.exp(logs.high) if logs.high < 700 else math.inf)


def verdict(found: Interval) -> str:
    """faster, slower or unresolved: the whole interval lies on one side of 1, and the median at least CLAIM away."""
    if found.high < 1 and found.middle <= 1 - CLAIM:
        return "faster"
    return "slower" if found.low > 1 and found.middle >= 1 + CLAIM else "unresolved"


# evidence


@dataclass(frozen=True, slots=True)
class Evidence:
    """What was seen around an epoch.

    switches  int    involuntary context switches of the thread so far
    stolen    int    ticks the hypervisor has taken from this machine so far
    spin      float  nanoseconds that a fixed piece of work took just now
    """

    switches: int
    stolen: int
    spin: float


def disturbed(before: Evidence, after: Evidence, usual_spin: float) -> bool:
    """True if something other than the kernel had the core: never judged by the epoch's own time."""
    slow = max(before.spin, after.spin) > SPIN_SLACK * usual_spin
    return slow or after.switches > before.switches or after.stolen > before.stolen


class Witness:
    """Reads the counters of the system that are evidence; a counter it does not have stays at 0."""

    def __init__(self, stat: Path = Path("/proc/stat")) -> None:
        self._stat: int | None = None
        with suppress(OSError):
            self._stat = os.open(stat, os.O_RDONLY)

    def see(self, spin: float) -> Evidence:
        """The counters now; about 3 microseconds."""
        usage = resource.getrusage(getattr(resource, "RUSAGE_THREAD", resource.RUSAGE_SELF))
        return Evidence(usage.ru_nivcsw, self._stolen(), spin)

    def _stolen(self) -> int:
        if self._stat is None:
            return 0
        fields = os.pread(self._stat, 256, 0).split(b"\n", 1)[0].split()
        return int(fields[8]) if len(fields) > 8 else 0

    def close(self) -> None:
        """Let go of the counters."""
        if self._stat is not None:
            os.close(self._stat)
            self._stat = None


# rounds


@dataclass(frozen=True, slots=True)
class Epoch:
    """One reading: nanoseconds of an epoch, and whether something disturbed it."""

    nanoseconds: float
    disturbed: bool


@dataclass(frozen=True)
class Readings:
    """All epochs of a block.

    used      float (rounds, kernels)  nanoseconds that count: the first undisturbed reading of a round, else the
                                       repeated one; NaN where a round left the kernel out
    clean     bool (rounds, kernels)   whether that reading is undisturbed
    marked    int (kernels,)           disturbed epochs, the repeated ones included
    every     list of (round, kernel, Epoch)  every reading, in the order taken: none is ever dropped
    """

    used: Floats
    clean: NDArray[np.bool_]
    marked: Integers
    every: list[tuple[int, int, Epoch]]

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
        used = np.full((len(further.used), self.used.shape[1]), np.nan)
        clean = np.zeros(used.shape, np.bool_)
        marked = self.marked.copy()
        columns = list(members)
        used[:, columns], clean[:, columns] = further.used, further.clean
        marked[columns] += further.marked
        every = [(len(self.used) + n, columns[k], epoch) for n, k, epoch in further.every]
        return Readings(
            np.concatenate([self.used, used]), np.concatenate([self.clean, clean]), marked, [*self.every, *every]
        )

    def _clean_ones(self, kernel: int) -> Floats:
        column, clean = self.used[:, kernel], self.clean[:, kernel]
        return column[clean] if clean.any() else column[np.isfinite(column)]


def contested(intervals: Sequence[Interval]) -> list[int]:
    """Places of the intervals that overlap a neighbour in the order of the medians: which is shorter is not decided."""
    order = sorted(range(len(intervals)), key=lambda i: (intervals[i].middle, i))
    unsure = set()
    for left, right in pairwise(order):
        if intervals[left].high >= intervals[right].low:
            unsure |= {left, right}
    return sorted(unsure)


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
    """Time all kernels once per round, interleaved; a disturbed epoch is repeated once, and both readings are kept.

    epoch        kernel index -> Epoch
    repeat       whether there is time to repeat disturbed epochs
    go_on        rounds done -> whether to take another
    after_round  told how many rounds are done
    """
    used: list[Floats] = []
    clean: list[NDArray[np.bool_]] = []
    marked = np.zeros(kernels, np.int64)
    every: list[tuple[int, int, Epoch]] = []
    for number, order in enumerate(orders(kernels, rounds, rng)):
        if not go_on(number):
            break
        times, quiet = np.empty(kernels), np.ones(kernels, np.bool_)
        for kernel in order.tolist():
            reading = epoch(kernel)
            every.append((number, kernel, reading))
            marked[kernel] += reading.disturbed
            if reading.disturbed and repeat():
                reading = epoch(kernel)
                every.append((number, kernel, reading))
                marked[kernel] += reading.disturbed
            times[kernel], quiet[kernel] = reading.nanoseconds, not reading.disturbed
        used.append(times)
        clean.append(quiet)
        after_round(number + 1)
    size = (len(used), kernels)
    return Readings(np.array(used).reshape(size), np.array(clean, np.bool_).reshape(size), marked, every)
