"""The balls that the points, normals and views of a block of 64 neighbours lie in, for the bounds of patches.py."""

from typing import Any

import numpy as np

from phongbench.compiler import intrinsics, jit
from phongbench.shading import tiles as at

#: entries of the ball of a block: point and radius, normal and radius, its squared length and that one's spread, view
#: and radius
POINT, NORMAL, LENGTH, VIEW, SIZE = 0, 4, 8, 10, 14


@jit.inline
def fill(s: Any, plane: Any, b: Any, ball: Any, first: Any) -> None:
    """Centre and radius of a block's vectors: the middle of four of them, and the largest distance from it.

    Not finite if one of them is not.
    """
    start, zero = plane + b * at.BLOCK, s.dtype.type(0)
    quarter = s.dtype.type(0.25)
    last = at.BLOCK - 1
    for d in range(3):
        i = start + d * at.TILE
        ball[first + d] = quarter * (s[i] + s[i + 7] + s[i + last - 7] + s[i + last])
    x, y, z = ball[first], ball[first + 1], ball[first + 2]
    most = s.dtype.type(np.finfo(s.dtype).max)
    for j in range(at.BLOCK):
        i = start + j
        dx, dy, dz = (
            intrinsics.entry(s, i) - x,
            intrinsics.entry(s, i + at.TILE) - y,
            intrinsics.entry(s, i + 2 * at.TILE) - z,
        )
        squared = dx * dx + dy * dy + dz * dz
        intrinsics.put(s, at.LOW + j, intrinsics.select(squared <= most, squared, s.dtype.type(np.inf)))
    ball[first + 3] = np.sqrt(_largest(s, zero))


@jit.inline
def _largest(s: Any, zero: Any) -> Any:
    """The largest of the first lanes of LOW, none of which is NaN."""
    found = zero
    for lanes in (32, 16, 8):
        for j in range(lanes):
            one, other = intrinsics.entry(s, at.LOW + j), intrinsics.entry(s, at.LOW + lanes + j)
            intrinsics.put(s, at.LOW + j, intrinsics.select(other > one, other, one))
    for j in range(8):
        found = max(found, intrinsics.entry(s, at.LOW + j))
    return found


@jit.inline
def measure_lengths(s: Any, b: Any, ball: Any) -> None:
    """The squared length of the ball's normal, and how far those of the block are from it at most."""
    zero = s.dtype.type(0)
    x, y, z = ball[NORMAL], ball[NORMAL + 1], ball[NORMAL + 2]
    middle = x * x + y * y + z * z
    for j in range(at.BLOCK):
        i = at.NORMAL + b * at.BLOCK + j
        x, y, z = intrinsics.entry(s, i), intrinsics.entry(s, i + at.TILE), intrinsics.entry(s, i + 2 * at.TILE)
        intrinsics.put(s, at.LOW + j, abs(x * x + y * y + z * z - middle))
    ball[LENGTH], ball[LENGTH + 1] = middle, _largest(s, zero)
