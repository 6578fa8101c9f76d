"""The branch of a smooth line, found through noise: on which side of the light each sample's normal is.

A smooth line changes sides only where it faces the light. Between two such places it stays on one side; of all ways to
choose these sides, the one that makes the measured angles most probable is taken. Lines are the more probable the less
their curvature bends along them, whatever the stiffness; an angle beyond 90 degrees would not be seen.
"""

import math
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np

from phongbench.compiler.precisions import Array

#: half the width of a 99 % interval of the normal distribution, in standard deviations
_SURE = 2.5758293035489004
#: samples to either side of a place that are looked at, the least share of places' width that lies between two of them,
#: and how many places there are at most
_REACH, _SHARE, _MOST = 100, 0.5, 64
#: how many times its usual length a step along the line counts at most, or one over it
_UNEVEN = 30.0
#: weights of the curve's bending that are tried, in those of the samples
_STIFFNESSES = 10.0 ** np.arange(-9.0, 10.0)
#: odds, as a logarithm: what is this much less likely to be seen whole, the mirrored line or the line, is not meant
_CLOSE = 3.0


def right_side(x: Array, off: Array, light: float, wide: float) -> Array:
    """True where the normal is right of the light.

    x      (n,)    places, growing
    off    (n,)    how far the normal is off the light, in radians, 0 .. pi / 2
    light          the light's angle from the viewer's direction, positive towards x
    wide   >= 0    standard deviation of cos(off); where samples scatter more, that counts
    """
    wide = max(wide, _scatter(off))
    noise = wide / np.maximum(np.sin(off), np.sqrt(2 * wide))
    places = _places(x, off, wide)
    ends = [(-1, 0), *places, (len(x) - 1, len(x))]
    runs = [slice(after, before + 1) for (_, after), (before, _) in pairwise(ends)]
    turns = [_Turn.of(x, off, light, noise, *around) for around in pairwise(runs)]
    line = _Sides([_hidden(off[run], light, noise[run]) for run in runs], turns)
    path = line.best()
    mirrored = 1 - path
    if line.seen(path) - line.seen(mirrored) < _CLOSE:
        tilts = [np.repeat(2 * sides - 1, [run.stop - run.start for run in runs]) for sides in (path, mirrored)]
        kept = np.concatenate([off[run] for run in runs])
        facing = [float(np.cos(light + tilt * kept).sum()) for tilt in tilts]
        path = path if facing[0] >= facing[1] else mirrored
    found = np.zeros(len(x), bool)
    for side, run in zip(path, runs, strict=True):
        found[run] = side
    for (one, other), turn, (before, after) in zip(pairwise(path), turns, places, strict=True):
        found[before + 1 : after] = turn.inner[one, other]
    return found


def _scatter(off: Array) -> float:
    """The standard deviation of cos(off), by fifth differences: a smooth line itself leaves little in them."""
    least = 1e-7
    if len(off) < 16:
        return least
    scatter = float(np.median(np.abs(np.diff(np.cos(off), 5)))) / (0.6745 * math.sqrt(252.0))
    return max(scatter, least)


def _places(x: Array, off: Array, wide: float) -> list[tuple[int, int]]:
    """Where the line may change sides: the last sample before each place, and the first after it.

    Between two samples it may, where they are so near to the light that noise could turn them over, or nearer than the
    line moves in such a step.
    """
    step = np.diff(x)
    speed = np.abs(np.diff(off)) / step
    around = np.concatenate([speed[:1], speed, speed[-1:]])
    moved = 2 * step * np.maximum(around[:-2], around[2:])
    turned = 2 * np.arccos(max(1 - _SURE * wide, -1.0))
    may = np.concatenate([[False], off[:-1] + off[1:] <= np.maximum(moved, turned), [False]])
    edges = np.flatnonzero(np.diff(may.astype(np.int8))).reshape(-1, 2)
    edges = edges[(edges[:, 0] > 0) & (edges[:, 1] < len(x) - 1)]
    wide_ones, share = np.diff(edges, axis=1)[:, 0], _SHARE
    while True:
        apart = edges[1:, 0] - edges[:-1, 1] >= share * np.maximum(wide_ones[1:], wide_ones[:-1])
        first, last = np.append(True, apart)[: len(edges)], np.append(apart, True)[: len(edges)]
        if first.sum() <= _MOST:
            return list(zip(edges[first, 0].tolist(), edges[last, 1].tolist(), strict=True))
        share *= 2


def _hidden(off: Array, light: float, noise: Array) -> Array:
    """For the left and the right side: the logarithm of how probable a run is, of which the viewer sees all."""
    beyond = [np.maximum(np.abs(light + side * off) - np.pi / 2, 0.0) / noise for side in (-1, 1)]
    return np.asarray(-0.5 * (np.array(beyond) ** 2).sum(axis=1))


@dataclass(frozen=True, eq=False)
class _Turn:
    """A place where a line may change sides.

    chance  (2, 2)     logarithm of how probable the angles around it are, for either side before and after
    inner   (2, 2, m)  True where a sample in it is then right of the light
    """

    chance: Array
    inner: Array

    @classmethod
    def of(cls, x: Array, off: Array, light: float, noise: Array, one: slice, other: slice) -> "_Turn":
        """The place between two runs."""
        inner = np.arange(one.stop, other.start)
        before = np.arange(max(one.start, one.stop - _REACH), one.stop)
        after = np.arange(other.start, min(other.stop, other.start + _REACH))
        # noise hides which side the inner ones are on: a few of them will do
        window = np.concatenate([before, inner[:: 1 + len(inner) // _REACH], after])
        place = slice(len(before), len(window) - len(after))
        tilt, weights = np.zeros(len(window)), noise[window] ** -2
        weights[place] = 0.0
        chance, found = np.zeros((2, 2)), np.zeros((2, 2, len(inner)), bool)
        for sides in product((0, 1), repeat=2):
            tilt[: place.start], tilt[place.stop :] = 2 * sides[0] - 1, 2 * sides[1] - 1
            chance[sides], curve = _smoothed(x[window], tilt * off[window], light, weights)
            found[sides] = np.interp(x[inner], x[window], curve) > 0
        return cls(chance, found)


def _smoothed(x: Array, signed: Array, light: float, weights: Array) -> tuple[float, Array]:
    """The logarithm of how probable angles are for the stiffness that suits them, and their smooth curve.

    signed  (n,)  angles off the light, positive to the right
    """
    from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

    bending, own = _bending(x, light + signed)
    best, curve, usual = -np.inf, signed, float(np.median(weights[weights > 0]))
    for stiffness in _STIFFNESSES * usual:
        matrix = stiffness * bending
        matrix[-1] += weights
        try:
            factor = cholesky_banded(matrix)
        except LinAlgError:
            continue
        smooth = cho_solve_banded((factor, False), weights * signed)
        misfit = float((weights * signed * (signed - smooth)).sum())
        chance = ((len(x) - 3) * np.log(stiffness) + own - misfit) / 2 - float(np.log(factor[-1]).sum())
        if chance > best:
            best, curve = chance, smooth
    return best, curve


def _bending(x: Array, angles: Array) -> tuple[Array, float]:
    """The integral over the line of the squared third derivative of its angle, as a form of the samples.

    returns  its bands (4, n), the diagonal last; the logarithm of the product of its eigenvalues but for the zeros
    """
    from scipy.linalg import LinAlgError, cholesky_banded

    third, count = _third_derivative(x, angles), len(x) - 3
    bands, squares = np.zeros((4, len(x))), np.zeros((4, count))
    for i in range(4):
        for j in range(i, 4):
            bands[3 - (j - i), j : j + count] += third[i] * third[j]
    for far in range(min(4, count)):
        squares[3 - far, far:] = (third[far:, : count - far] * third[: 4 - far, far:]).sum(axis=0)
    try:
        return bands, 2 * float(np.log(cholesky_banded(squares[-min(4, count) :])[-1]).sum())
    except LinAlgError:
        return bands, 0.0


def _third_derivative(x: Array, angles: Array) -> Array:
    """What the samples are taken times for it, (4, n - 3): divided differences, each over the root of its share."""
    step = np.diff(x) / np.median(np.diff(x))
    slant = np.maximum(np.cos((angles[1:] + angles[:-1]) / 2), 1 / _UNEVEN)
    along = np.concatenate([[0.0], np.cumsum(np.clip(step / slant, 1 / _UNEVEN, _UNEVEN))])
    points = np.stack([along[k : k + len(x) - 3] for k in range(4)])
    gaps = points[:, None] - points[None]
    gaps[range(4), range(4)] = 1.0
    return np.asarray(6 / gaps.prod(axis=1) * np.sqrt((points[3] - points[0]) / 3))


@dataclass(frozen=True, eq=False)
class _Sides:
    """How probable each choice of sides is: by what the viewer would not see of the runs, and by the turns."""

    hidden: list[Array]
    turns: list[_Turn]

    def best(self) -> Array:
        """The most probable side of each run, 0 or 1: Viterbi's algorithm."""
        chance, came = self.hidden[0], []
        for seen, turn in zip(self.hidden[1:], self.turns, strict=True):
            total = chance[:, None] + turn.chance
            came.append(np.argmax(total, axis=0))
            chance = np.max(total, axis=0) + seen
        path = [int(np.argmax(chance))]
        for back in reversed(came):
            path.append(int(back[path[-1]]))
        return np.array(path[::-1])

    def seen(self, path: Array) -> float:
        """The logarithm of how probable a choice is by that the viewer sees all of it."""
        return sum(float(one[side]) for one, side in zip(self.hidden, path, strict=True))
