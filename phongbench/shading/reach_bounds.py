"""What leaving lights out beyond their reach takes from the points of a tile at most."""

from functools import cache
from typing import Any

import numpy as np

from phongbench.compiler import intrinsics, jit
from phongbench.compiler.lowering import Precision
from phongbench.compiler.precisions import Array
from phongbench.shading import tiles as at

_entry, _put, _select = intrinsics.entry, intrinsics.put, intrinsics.select

#: what `shade_loop.shade_tiles` finds of each light and a tile's boxes: a bound on N.(P - p), and the squares of the
#: least and the largest distance; rows of as many as there are lights
HEIGHT, NEAR, FAR = range(3)
ROOM = 3
#: squared diagonal of a box of normals from which on its blocks are looked at one by one
_WIDE = 0.1


@jit.inline
def judge(s: Any, spread: Any, verdicts: Any, room: Any, slack: Any, tiny: Any) -> None:
    """Judge every light by a tile's boxes: 0 keep it, 1 behind all of the tile, 2 out of its reach.

    What `beyond_reach` wants to know is left in `room`.

    N.(P - p) is at most the sum of the largest products of the components' ends. The ends of P - p are rounded as the
    differences themselves are; `slack` covers the rounding of the sums, `tiny` that of subnormal numbers.
    """
    zero, one, two = s.dtype.type(0), s.dtype.type(1), s.dtype.type(2)
    for k in range(len(verdicts)):
        bound, size, gap, far = zero, zero, zero, zero
        for d in range(3):
            placed = _entry(spread, at.PLACED * len(verdicts) + k)
            place = _entry(spread, (at.WHERE + d) * len(verdicts) + k)
            low = place - placed * _entry(s, at.HIGH + d * at.BLOCK)
            high = place - placed * _entry(s, at.LOW + d * at.BLOCK)
            n0, n1 = _entry(s, at.LOW + (3 + d) * at.BLOCK), _entry(s, at.HIGH + (3 + d) * at.BLOCK)
            p0, p1, p2, p3 = low * n0, low * n1, high * n0, high * n1
            p0, p2 = _select(p1 > p0, p1, p0), _select(p3 > p2, p3, p2)
            bound += _select(p2 > p0, p2, p0)
            wide, steep = _select(-low > high, -low, high), _select(-n0 > n1, -n0, n1)
            size += wide * steep
            away = _select(low > zero, low, _select(high < zero, -high, zero))
            gap += away * away
            far += wide * wide
        out = gap * (one - slack) > _entry(spread, at.REACH * len(verdicts) + k)
        _put(verdicts, k, _select(out, two, _select(bound < -slack * size - tiny, one, zero)))
        _put(room, HEIGHT * len(verdicts) + k, bound + slack * size + tiny)
        _put(room, NEAR * len(verdicts) + k, gap * (one - slack))
        _put(room, FAR * len(verdicts) + k, far)


@jit.inline
def _lost(spread: Any, lights: Any, k: Any, channel: Any, lit: Any, shine: Any, glow: Any) -> Any:
    """What a light gives to a channel by its diffuse, specular and ambient term of these strengths."""
    diffuse = _entry(spread, (at.DIFFUSE + channel) * lights + k)
    specular = _entry(spread, (at.SPECULAR + channel) * lights + k)
    return diffuse * lit + specular * shine + _entry(spread, (at.GLOW + channel) * lights + k) * glow


@jit.reduction
def beyond_reach(spread: Array, room: Array, slack: Any) -> Any:
    """The most that the points of a tile lose by lights that do not reach them, all lights together, in any channel.

    spread  the lights' numbers, transposed and flat
    room    ROOM rows, see above
    slack   float  room for rounding, as a share
    returns float  a bound on what each point's colour would gain if the lights shone on

    A light may be missing at a point if the tile's box is not all within its reach r. It is then at least
    d = max(r, least distance) away, its cosine is at most N.(P - p) / d, and 1; so it would add at most
    att(d) (kd id cosine + ks is), and nothing if no N.(P - p) is positive, beside its ambient term att(d) ka ia. For
    normals no longer than 1 and specular terms no larger than 1, as reflectances are.
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
            _entry(spread, at.FADE * lights + k),
            _entry(spread, (at.FADE + 1) * lights + k),
            _entry(spread, (at.FADE + 2) * lights + k),
        )
        fade = one / (c + l * distance + q * squared)
        fade = _select(l + q > zero, _select(fade < most, fade, most), c)
        height = _entry(room, HEIGHT * lights + k)
        beyond = _entry(room, FAR * lights + k) * (one + slack) > reach
        missing = beyond & (height > zero)
        glow, shine = _select(beyond, fade, zero), _select(missing, fade, zero)
        lit = _select(missing, fade * _select(height < distance, height / distance, one), zero)
        red += _lost(spread, lights, k, 0, lit, shine, glow)
        green += _lost(spread, lights, k, 1, lit, shine, glow)
        blue += _lost(spread, lights, k, 2, lit, shine, glow)
    return max(red, green, blue) * (one + slack)


def loop_signature(dtype: Any) -> Any:
    """Of `reach_loop`: (s, spread, room for verdicts, room, limits, lost, flags)."""
    row = jit.array_type(dtype)
    return jit.signature(row, row, row, row, row, row, jit.array_type(np.int64))


loop_at = intrinsics.function_at(loop_signature)


@cache
def reach_loop(precision: Precision) -> Any:
    """The loop that raises lost[0] to what lights out of reach take from a tile that was judged.

    Block by block where its normals differ, since a box tells little then. Compiled when a light has a reach: it would
    make the first picture wait for three more seconds.
    """
    wide, zero = precision.constant(_WIDE), precision.constant(0.0)

    def reaching(s: Array, spread: Array, spare: Array, room: Array, limits: Array, lost: Array, flags: Array) -> None:
        differ = zero
        for d in range(3, 6):
            side = _entry(s, at.HIGH + d * at.BLOCK) - _entry(s, at.LOW + d * at.BLOCK)
            differ += side * side
        gone = beyond_reach(spread, room, limits[at.SLACK])
        if differ > wide and gone > lost[0]:
            gone = zero
            for b in range(flags[at.USED]):
                at.enclose(s, b, 1)
                judge(s, spread, spare, room, limits[at.SLACK], limits[at.TINY])
                gone = max(gone, beyond_reach(spread, room, limits[at.SLACK]))
        lost[0] = max(lost[0], gone)

    return jit.elementwise(loop_signature(precision.carrier), reaching)
