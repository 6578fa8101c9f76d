"""Ends of intervals: float64 arrays, one for the lower ends and one for the upper."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Ends = NDArray[np.float64]
Mask = NDArray[np.bool_]


def outwards(low: Ends, high: Ends) -> tuple[Ends, Ends]:
    """Each interval one float64 wider at either end; an end of 0 stays.

    By the bits, which order like the numbers: np.nextafter takes one at a time, and was a tenth of a proof.
    """
    low_bits = low.view(np.int64) + ((low < 0) & (low > -np.inf)) - (low > 0)
    high_bits = high.view(np.int64) + ((high > 0) & (high < np.inf)) - (high < 0)
    return low_bits.view(np.float64), high_bits.view(np.float64)


def product(x: Any, y: Any) -> Any:
    """The products of two ends; 0 times infinity is 0, for the infinite end is never reached."""
    return np.where((x == 0) | (y == 0), 0.0, x * y)


def quotients(low: Any, high: Any, under: Any, over: Any) -> tuple[Ends, Ends]:
    """The ends of what numbers from low to high give, divided by numbers from under to over."""
    with np.errstate(all="ignore"):
        corners = [product(x, 1.0) / y for x in (low, high) for y in (under, over)]
        least, most = np.fmin.reduce(corners), np.fmax.reduce(corners)
    # a divisor that reaches 0 from above leaves the side of the larger quotient open; one across 0 leaves both
    across, touching = (under < 0) & (over > 0), (under == 0) | (over == 0)
    least = np.where(across | (touching & (low < 0)), -np.inf, least)
    most = np.where(across | (touching & (high > 0)), np.inf, most)
    return np.asarray(least, np.float64), np.asarray(most, np.float64)
