"""Heights along a line from its slopes: Simpson's rule or the trapezoid's, and the band that noise leaves."""

from collections.abc import Mapping

import numpy as np

from phongbench.compiler.precisions import Array

#: half the width of a 99 % interval of the normal distribution, in standard deviations
SURE = 2.5758293035489004
#: the steepest slope at which heights may start
START = 5.0
#: neighbouring steps that differ by more than this factor are integrated as straight lines
_UNEVEN = 3.0


def intervals(x: Array, slope: Array, rule: str) -> Array:
    """The height's change from each sample to the next.

    x, slope  (n,)     x grows
    rule      simpson: the mean of the parabolas through the two samples and either neighbour; trapezoid
    returns   (n - 1,)
    """
    step = np.diff(x)
    straight = step * (slope[:-1] + slope[1:]) / 2
    if rule == "trapezoid" or len(x) < 3:
        return np.asarray(straight)
    before, after = step[:-1], step[1:]
    f, g, h = slope[:-2], slope[1:-1], slope[2:]
    both = before + after
    # integrals of the parabola through three samples, over its first and its second step
    first = f * before * (2 * before + 3 * after) / (6 * both)
    first += g * before * (before + 3 * after) / (6 * after) - h * before**3 / (6 * after * both)
    second = h * after * (2 * after + 3 * before) / (6 * both)
    second += g * after * (after + 3 * before) / (6 * before) - f * after**3 / (6 * before * both)
    uneven = np.maximum(before, after) > _UNEVEN * np.minimum(before, after)
    first, second = np.where(uneven, straight[:-1], first), np.where(uneven, straight[1:], second)
    mean = np.concatenate([first[:1], (second[:-1] + first[1:]) / 2, second[-1:]])
    return np.asarray(mean)


def heights(x: Array, slope: Array, noise: Mapping[str, Array], rule: str, start: str) -> tuple[Array, Array]:
    """Heights of a stretch without gaps, 0 where they start, and half the width of their 99 % band.

    noise    spread: standard deviation of each slope; bias: how far its mean may be off
    start    left: the first sample with a slope of at most 5; right: the last one; both: the left one, and the height
             at the right one is known to be the same, so that the drift between them is taken away evenly
    returns  (n,), (n,)
    """
    gentle = np.flatnonzero(np.abs(slope) <= START)
    gentle = gentle if len(gentle) else np.array([int(np.argmin(np.abs(slope)))])
    left, right = int(gentle[0]), int(gentle[-1])
    climbed = np.concatenate([[0.0], np.cumsum(intervals(x, slope, rule))])
    steps = np.gradient(x) if len(x) > 1 else np.zeros(1)
    spread = np.concatenate([[0.0], np.cumsum((steps * noise["spread"]) ** 2)])
    bias = np.concatenate([[0.0], np.cumsum(steps * noise["bias"])])
    origin = right if start == "right" else left
    found, places = climbed - climbed[origin], np.arange(len(x))
    # samples from the origin to each place, both of them included
    low, high = np.minimum(places, origin), np.maximum(places, origin) + 1
    variance, drift = spread[high] - spread[low], np.abs(bias[high] - bias[low])
    if start == "both" and right > left:
        share = (x - x[left]) / (x[right] - x[left])
        whole = spread[right + 1] - spread[left]
        total = bias[right + 1] - bias[left]
        found = found - share * found[right]
        inside = (1 - 2 * share) * variance + share**2 * whole
        variance = np.where((share >= 0) & (share <= 1), inside, variance + share**2 * whole)
        drift = drift + np.abs(share * total)
    band = SURE * np.sqrt(np.maximum(variance, 0.0)) + drift
    band[origin] = 0.0
    if start == "both":
        band[right] = 0.0
    return found, band
