"""Which of the two normals that explain an intensity is meant: prior information, which shading alone lacks."""

from collections.abc import Callable, Mapping

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.inverse.smooth_branch import right_side

#: x, the branch turned left and the branch turned right (n,), in radians from the viewer's direction towards x, and the
#: standard deviation of the cosine between normal and light -> (n,) True where the right one is meant
Chooser = Callable[[Array, Array, Array, float], Array]


def convex(x: Array, left: Array, right: Array, wide: float) -> Array:
    """The surface bulges towards the viewer: the angle grows with x, so it is left of the light, then right of it.

    Of all places to change over, the one at which the angle falls least.
    """
    return np.arange(len(x)) >= _turn(x, left, right)


def concave(x: Array, left: Array, right: Array, wide: float) -> Array:
    """The surface is hollow: the angle falls with x, so it is right of the light, then left of it."""
    return np.arange(len(x)) < _turn(x, -right, -left)


def towards_viewer(x: Array, left: Array, right: Array, wide: float) -> Array:
    """Each sample by itself: the normal that is nearer to the viewer's direction."""
    return np.abs(right) < np.abs(left)


def continuous(x: Array, left: Array, right: Array, wide: float) -> Array:
    """The surface is smooth: the likeliest sides of the light, between the places where it faces the light.

    Where mirroring at the light leaves it as smooth, as it does for a light beside the viewer, the answer that faces
    the viewer more.
    """
    if len(x) < 4:
        return towards_viewer(x, left, right, wide)
    return right_side(x, (right - left) / 2, float(left[0] + right[0]) / 2, wide)


def expected(angles: Array) -> Chooser:
    """Each sample by itself: the normal that is nearer to the angle (n,) expected there, in radians."""
    return lambda x, left, right, wide: np.abs(right - angles) < np.abs(left - angles)


def _turn(x: Array, before: Array, after: Array) -> int:
    """The place from which on `after` holds, so that the angle falls least in all; of several the smoothest."""
    count = len(before)
    if count < 2:
        return 0
    falls = np.zeros(count + 1)
    falls[2:] += np.cumsum(np.maximum(-np.diff(before), 0.0))
    falls[: count - 1] += np.cumsum(np.maximum(-np.diff(after), 0.0)[::-1])[::-1]
    falls[1:count] += np.maximum(before[:-1] - after[1:], 0.0)
    best = np.flatnonzero(falls <= falls.min() + _TIE)
    return int(best[np.argmin([_bend(x, before, after, int(k)) for k in best[:_MOST_TIES]])])


def _bend(x: Array, before: Array, after: Array, k: int) -> float:
    """The squared changes of the angle's slope around a change of branch at k."""
    near = slice(max(k - 2, 0), k + 2)
    angle = np.where(np.arange(len(x))[near] >= k, after[near], before[near])
    return float((np.diff(np.diff(angle) / np.diff(x[near])) ** 2).sum())


#: falls of angles in radians that rounding leaves, and how many places are compared
_TIE, _MOST_TIES = 1e-9, 64


#: the priors that are known by name
PRIORS: Mapping[str, Chooser] = {
    "convex": convex,
    "concave": concave,
    "continuous": continuous,
    "towards-viewer": towards_viewer,
}
