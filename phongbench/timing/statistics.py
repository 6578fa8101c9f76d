"""Ratios of times with sign-test intervals, and what may be said of them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: confidence of every interval, and how it is shown beside one; the sign test reaches it from 8 rounds on
LEVEL, MIN_ROUNDS = 0.99, 8
LEVEL_TEXT = f"{100 * LEVEL:g} %"
#: a difference smaller than this is never claimed: code layout alone makes as much
CLAIM = 0.02
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Interval:
    """A median and the exact sign-test interval around it."""

    middle: float
    low: float
    high: float

    def columns(self) -> dict[str, Any]:
        """The columns of a ratio; None for the ends of an interval that has none."""
        low, high = (self.low, self.high) if math.isfinite(self.high) else (None, None)
        return {"ratio": self.middle, "ratio_low": low, "ratio_high": high}


def sign_test_rank(count: int, level: float = LEVEL) -> int:
    """The largest k whose k-th smallest and k-th largest of `count` values enclose the median so surely; 0 if none."""
    allowed, parts = (1 - level).as_integer_ratio()
    k, below, binomial = 0, 1, 1  # of 2^count outcomes, those with at most k values on one side, and with exactly k
    while k < count and 2 * below * parts <= allowed << count:
        binomial = binomial * (count - k) // (k + 1)
        k, below = k + 1, below + binomial
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


def verdict(ratio: Interval) -> str:
    """faster, slower or unresolved: the whole interval lies on one side of 1, and the median at least CLAIM away."""
    if ratio.high < 1 and ratio.middle <= 1 - CLAIM:
        return "faster"
    return "slower" if ratio.low > 1 and ratio.middle >= 1 + CLAIM else "unresolved"


def contested(intervals: Sequence[Interval]) -> list[int]:
    """Places of the intervals that overlap a neighbour in the order of the medians: which is shorter is not decided."""
    order = sorted(range(len(intervals)), key=lambda i: (intervals[i].middle, i))
    unsure = set()
    for left, right in pairwise(order):
        if intervals[left].high >= intervals[right].low:
            unsure |= {left, right}
    return sorted(unsure)
