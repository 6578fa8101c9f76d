"""Whole calls timed in turn: what each takes as a multiple of another, with the interval that all times here have."""

import math
import sys
import time
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from phongbench.timing.rounds import Epoch, Readings, run_rounds
from phongbench.timing.statistics import MIN_ROUNDS

#: seconds that this thread computed: other programs' turns do not count; those of the wall where it is told coarsely
THREAD_CLOCK = time.perf_counter if sys.platform == "win32" else time.thread_time
K = TypeVar("K", bound=Hashable)


@dataclass(frozen=True)
class Times(Generic[K]):
    """What the calls took.

    names     of the calls, in the order of the readings' columns
    failures  name -> what took a call out of the later rounds
    """

    names: tuple[K, ...]
    readings: Readings
    failures: Mapping[K, Exception]

    def seconds(self, name: K) -> float:
        """The least that a call took."""
        return self.readings.least(self.names.index(name)) / 1e9

    def median(self, name: K) -> float:
        """The median of a call's seconds."""
        return self.readings.median(self.names.index(name)) / 1e9

    def row(self, name: K, base: K) -> dict[str, Any]:
        """A call's time over another's: rounds, least seconds, and the ratio with the ends of its interval.

        The ratio is the median over the rounds; the interval is `statistics.sign_interval`, whose ends are None below
        MIN_ROUNDS.
        """
        call, other = self.names.index(name), self.names.index(base)
        ratio = self.readings.ratio(call, other)
        return {"rounds": self.readings.rounds(call), "seconds": self.seconds(name), **ratio.columns()}


def clocked(call: Callable[[], object], clock: Callable[[], float] = time.perf_counter) -> Callable[[], float]:
    """The call as one that returns its seconds, of the wall by default, or by THREAD_CLOCK."""

    def seconds() -> float:
        started = clock()
        call()
        return clock() - started

    return seconds


def interleaved(
    calls: Mapping[K, Callable[[], float]],
    *,
    rounds: int = MIN_ROUNDS,
    warm: int = 0,
    seed: int = 1,
    step: Callable[[], object] = lambda: None,
    leaves_on: tuple[type[Exception], ...] = (),
) -> Times[K]:
    """Time calls in rounds that hold each of them once, in an order that differs between rounds.

    calls      name -> does its work once and returns its seconds; see `clocked`
    rounds     below MIN_ROUNDS there is no interval
    warm       how often each is called before, for what is compiled or read the first time
    seed       of the orders
    step       is called after every call
    leaves_on  exceptions that take only the call that raises them out of the remaining rounds
    """
    names = tuple(calls)
    failures: dict[K, Exception] = {}

    def epoch(index: int) -> Epoch:
        name, seconds = names[index], math.nan
        if name not in failures:
            try:
                seconds = calls[name]()
            except leaves_on as problem:
                failures[name] = problem
        step()
        return Epoch(1e9 * seconds)

    for index in [*range(len(names))] * warm:
        epoch(index)
    return Times(names, run_rounds(epoch, len(names), rounds, np.random.default_rng(seed)), failures)
