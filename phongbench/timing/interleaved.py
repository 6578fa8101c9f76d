"""Whole calls timed in turn: what a picture takes beside another of the same scene."""

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench.timing import rounds as clock
from phongbench.timing import statistics
from phongbench.timing.statistics import MIN_ROUNDS

#: rounds of all calls: the fewest that give an interval
ROUNDS = MIN_ROUNDS


def in_turn(calls: Sequence[Callable[[], object]], *, rounds: int = ROUNDS, seed: int = 1) -> NDArray[np.float64]:
    """Seconds (rounds, calls). A round holds every call once, in an order that differs between rounds.

    calls  each was called once before: nothing is compiled or read for the first time here
    """
    seconds = np.empty((rounds, len(calls)))
    for number, order in enumerate(clock.orders(len(calls), rounds, np.random.default_rng(seed))):
        for call in order.tolist():
            started = time.perf_counter()
            calls[call]()
            seconds[number, call] = time.perf_counter() - started
    return seconds


def over(seconds: NDArray[np.float64], call: int, other: int) -> dict[str, Any]:
    """The columns of a call's time over another's: the least seconds, and the ratio with its interval."""
    ratio = statistics.ratio(seconds[:, call], seconds[:, other])
    return {
        "rounds": len(seconds),
        "seconds": float(seconds[:, call].min()),
        "ratio": ratio.middle,
        "ratio_low": ratio.low,
        "ratio_high": ratio.high,
    }
