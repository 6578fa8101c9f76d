"""Timed programs in shuffled rounds, in the worker's process: what one call takes, from programs of two lengths."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np

from phongbench.targets.webgpu import clock
from phongbench.targets.webgpu.clock import Passes
from phongbench.timing.rounds import Epoch, Readings, agreed, run_rounds
from phongbench.timing.statistics import MIN_ROUNDS

#: rounds at most; and how long the shorter pass is at least, by timestamps and by the wall, which jitters
MOST_ROUNDS, LEAST_NS, LEAST_WALL_NS = 48, 1e6, 5e6
#: readings of an epoch, of which the least of each program counts: what else runs only adds
READINGS = 3
#: rounds that a copy is part of, one reading in each: it takes longer than all formulas, and no answer hangs on it
COPIES = MIN_ROUNDS
#: repeats of a program's calls at most: a shorter pass stays shorter
MOST_REPEATS = 1 << 20
#: bytes of a vector, which a thread of a copy moves
MOVED = 16
#: readings of the clock's check, short and long
_CHECKS, _LONGER = 3, 8


@dataclass(frozen=True, slots=True)
class Timed:
    """What is timed: a shorter and a longer program, whose times differ by calls alone.

    name    of it
    texts   both, in WGSL; of a copy, twice the same
    calls   of `highlight` that each makes in a repeat; of a copy, in how many dispatches
    copied  bytes that it copies, 0 where it is no copy
    """

    name: str
    texts: tuple[str, str]
    calls: tuple[int, int]
    copied: int = 0

    def threads(self, most: int) -> int:
        """How many make its calls: as many as there are, or for a copy one for each vector."""
        return self.copied // MOVED if self.copied else most


class Pair(Protocol):
    """Both programs of something timed, made ready."""

    def run(self, repeats: int, places: Sequence[int]) -> Passes:
        """Run the shorter (0) and the longer (1) in this order, however often, as one submission, and wait."""


@dataclass(frozen=True)
class Times:
    """What the rounds gave.

    names    of what was timed, in the order of the columns
    used     float64 (rounds, names)  nanoseconds that the longer program takes more, a call; NaN where not more
    marked   epochs that were taken again, by name
    clock    clock.TIMESTAMPS or clock.WALL
    fault    why timestamps are not believed; None where they are
    refused  name -> what the device says of a program that it does not take
    """

    names: tuple[str, ...]
    used: np.ndarray
    marked: tuple[int, ...]
    clock: str
    fault: str | None
    refused: dict[str, str]

    @property
    def readings(self) -> Readings:
        """As `timing.rounds` has them."""
        return Readings(self.used, np.isfinite(self.used), np.array(self.marked, np.int64))


def measure(pairs: Sequence[tuple[Timed, Pair]], threads: int, *, clocks: bool, seconds: float, seed: int) -> Times:
    """Time them in rounds that hold each once, in an order that differs between rounds.

    threads  that make the calls of a formula
    clocks   whether the device has timestamps
    seconds  what the rounds may take; they are MIN_ROUNDS at least and MOST_ROUNDS at most
    """
    why = checked(pairs[0][1]) if clocks else "the device has no timestamps"
    epochs = _Epochs(pairs, threads, _Reader(why is None))
    for index in range(len(pairs)):
        epochs.read(index)
    rounds = int(np.clip(epochs.rounds_in(seconds), MIN_ROUNDS, MOST_ROUNDS))
    found = run_rounds(epochs.read, len(pairs), rounds, np.random.default_rng(seed))
    names = tuple(one.name for one, _ in pairs)
    clocked = clock.TIMESTAMPS if why is None else clock.WALL
    return Times(names, found.used, tuple(found.marked.tolist()), clocked, why, {})


class _Epochs:
    """Readings of timed things, by their place; what each takes is known once all were read.

    pairs, threads  as for `measure`
    """

    def __init__(self, pairs: Sequence[tuple[Timed, Pair]], threads: int, reader: "_Reader") -> None:
        self._pairs, self._reader = pairs, reader
        self._repeats = [reader.repeats(pair) for _, pair in pairs]
        self._calls = [
            (one.calls[1] - one.calls[0]) * one.threads(threads) * repeats
            for (one, _), repeats in zip(pairs, self._repeats, strict=True)
        ]
        self._left = [1 + COPIES if one.copied else math.inf for one, _ in pairs]
        self._lasts = np.zeros(len(pairs))

    def read(self, place: int) -> Epoch:
        """Nanoseconds of a call; NaN where there is none, and of a copy that was read often enough."""
        if not self._left[place]:
            return Epoch(math.nan)
        self._left[place] -= 1
        started = time.perf_counter()
        one, pair = self._pairs[place]
        more = self._reader.more(pair, self._repeats[place], 1 if one.copied else READINGS)
        self._lasts[place] = time.perf_counter() - started
        return Epoch(more / self._calls[place] if more > 0 else math.nan, more <= 0)

    def rounds_in(self, seconds: float) -> float:
        """How many rounds fit, the copies' share taken off first."""
        copies = np.array([one.copied > 0 for one, _ in self._pairs])
        left = seconds - COPIES * self._lasts[copies].sum()
        return float(left / max(self._lasts[~copies].sum(), 1e-6))


def checked(pair: Pair) -> str | None:
    """Why timestamps cannot be believed, by programs that are long enough for both clocks; None where they can."""
    repeats = _Reader(False).repeats(pair)
    short = [pair.run(repeats, (0,)) for _ in range(_CHECKS)]
    return clock.fault(short, [pair.run(_LONGER * repeats, (0,)) for _ in range(_CHECKS)])


@dataclass(frozen=True)
class _Reader:
    """Reads passes by the clock that is believed."""

    stamped: bool

    def more(self, pair: Pair, repeats: int, readings: int = READINGS) -> float:
        """Nanoseconds that the longer program takes more than the shorter, from the least of so many of each."""
        if self.stamped:
            passes = pair.run(repeats, (0, 1) * readings)
            times = [passes.nanoseconds(place) for place in range(2 * readings)]
        else:
            times = [pair.run(repeats, (place,)).wall for place in (0, 1) * readings]
        return min(times[1::2]) - min(times[::2])

    def repeats(self, pair: Pair) -> int:
        """Repeats with which the shorter program takes long enough, from readings that agree."""
        least, repeats = (LEAST_NS if self.stamped else LEAST_WALL_NS), 1
        while True:
            lasts = agreed(partial(self._short, pair, repeats))
            if lasts >= least or repeats >= MOST_REPEATS:
                break
            repeats = min(MOST_REPEATS, math.ceil(repeats * min(16.0, 1.2 * least / max(lasts, 1.0))))
        agreed(partial(self.more, pair, repeats))  # the longer one is warm then, too
        return repeats

    def _short(self, pair: Pair, repeats: int) -> float:
        passes = pair.run(repeats, (0,))
        return float(passes.nanoseconds(0) if self.stamped else passes.wall)
