"""What leaving lights out beyond their reach takes from the points of a tile at most."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench import jit
from phongbench import tiles as at

Array = NDArray[Any]
_entry, _select = jit.entry, jit.select

#: what `shade_loop.shade_tiles` finds of each light and a tile's boxes: a bound on N.(P - p), and the squares of the
#: least and the largest distance; rows of as many as there are lights
HEIGHT, NEAR, FAR = range(3)
ROOM = 3
#: entries of the losses: the most that any point lost by lights out of reach
REACH = 0
LOSSES = 1


@jit.reduction
def beyond_reach(spread: Array, room: Array, slack: Any) -> Any:
    """The most that the points of a tile lose by lights that do not reach them, all lights together, in any channel.

    spread  the lights' numbers, transposed and flat
    room    ROOM rows, see above
    slack   float  room for rounding, as a share
    returns float  a bound on what each point's colour would gain if the lights shone on

    A light may be missing at a point if the tile's box is not all within its reach r. It is then at least
    d = max(r, least distance) away, its cosine is at most N.(P - p) / d, and 1; so it would add at most
    att(d) (kd id cosine + ks is), and nothing if no N.(P - p) is positive. For normals no longer than 1 and specular
    terms no larger than 1.
    """
    lights = len(room) // ROOM
    zero, one = spread.dtype.type(0), spread.dtype.type(1)
    most = spread.dtype.type(np.finfo(spread.dtype).max)
    red, green, blue = zero, zero, zero
    for k in range(lights):
        reach, gap = _entry(spread, at.REACH * lights + k), _entry(room, NEAR * lights + k)
        squared = _select(gap > reach, gap, reach)
        distance = np.sqrt(squared)
        c, l, q = (  # noqa: E741  its name in texts
            _entry(spread, at.FADE * lights + k), _entry(spread, (at.FADE + 1) * lights + k),
            _entry(spread, (at.FADE + 2) * lights + k),
        )  # fmt: skip
        fade = one / (c + l * distance + q * squared)
        fade = _select(l + q > zero, _select(fade < most, fade, most), c)
        height = _entry(room, HEIGHT * lights + k)
        missing = (_entry(room, FAR * lights + k) * (one + slack) > reach) & (height > zero)
        shine = _select(missing, fade, zero)
        lit = _select(missing, fade * _select(height < distance, height / distance, one), zero)
        red += _entry(spread, at.DIFFUSE * lights + k) * lit + _entry(spread, at.SPECULAR * lights + k) * shine
        green += (
            _entry(spread, (at.DIFFUSE + 1) * lights + k) * lit + _entry(spread, (at.SPECULAR + 1) * lights + k) * shine
        )
        blue += (
            _entry(spread, (at.DIFFUSE + 2) * lights + k) * lit + _entry(spread, (at.SPECULAR + 2) * lights + k) * shine
        )
    return max(red, green, blue) * (one + slack)
