"""Tiles of points that fit into the first caches: where things lie in them, how points come in and colours go out.

A tile holds everything about its points as planes, one after another in one piece of memory, so that the distance
between any two planes is known when compiling and no loop has to ask whether its arrays overlap. Every loop runs over
whole blocks: the last block of the last tile is filled up with its last point. So a value never depends on where in
the arrays its point lies, nor on which blocks are left out: it is the same bits.

Numbers in these loops take their type from the tile: `s.dtype.type(0)`, since a bare 0.0 would be float64. Flags are
narrowed after every step, since numba widens sums and unions of int32 to int64, which halves the lanes.
"""

from typing import Any

import numpy as np

from phongbench.compiler import intrinsics, jit
from phongbench.compiler.lowering import Precision
from phongbench.compiler.precisions import Array
from phongbench.formulas import lambda_forms

#: points that are left out together, and of a tile. 64 are four vectors of 16 float32; the 21 planes of 512 points
#: take 43 kB. Twice as many were no faster in float32 and slower in float64; an odd distance between planes made no
#: difference
BLOCK, TILE = 64, 512
BLOCKS = TILE // BLOCK
#: planes of a tile, TILE apart: points, normals, directions to viewer and light, sums of red, green and blue, ...
POINT, NORMAL, VIEW, TOWARDS, SUM = 0, 3 * TILE, 6 * TILE, 9 * TILE, 12 * TILE
FACING, FADING, COORDINATE, GATE, HIGHLIGHT, SEEN = (plane * TILE for plane in range(15, 21))
#: lowest and highest values of the six planes of points and normals, first in each lane of a block
LOW, HIGH = 21 * TILE, 22 * TILE
#: of materials whose specular colour depends on incidence: its cosine, and what is reflected of red, green and blue
INCIDENCE, REFLECTED = 23 * TILE, 24 * TILE
SCRATCH = 27 * TILE

#: columns of a light's numbers: direction or position, c l q, reach^2, diffuse and specular colour products, viewer,
#: where the dark begins, the cosine below which exact Phong counts as dark, 1 for a light at a position, and the
#: ambient colour product of such a light
WHERE, FADE, REACH, DIFFUSE, SPECULAR, EYE, DARK, TAIL, PLACED, GLOW = 0, 3, 6, 7, 10, 13, 16, 17, 18, 19
NUMBERS = 22
#: columns of a light's plan: address of its facing loop; of its coordinate loop, and whether it has one; whether the
#: formula is evaluated; whether its diffuse and its specular term are added; the row that says what sees it, or -1;
#: whether its ambient term is added point by point, and by which loop; address of its loop over incidence
FACING_LOOP, COORDINATE_LOOP, HAS_LOOP, EVALUATES, ADDS_DIFFUSE, ADDS_SPECULAR, SEEN_ROW = range(7)
GLOWS, GLOW_LOOP, INCIDENCE_LOOP = range(7, 10)
PLAN = 10
#: what is counted: pairs left out behind, out of reach, in shadow, in the dark; pairs whose R or H was not built;
#: points whose V was not made unit
BEHIND, OUT, SHADE, UNLIT, UNBUILT, LEFT_LONG = range(6)
COUNTS = 6
#: entries of the options
COLUMNS, NORMALISE, EYE_PLACED, NEEDS_VIEW, BOXES, KEEP_BEHIND, KEEP_UNLIT, LIMITED, REACH_LOOP = range(9)
FORMULA_LOOP, HAS_FRESNEL, FRESNEL_LOOP, KEEP_LENGTH = range(9, 13)
OPTIONS = 13
#: a tile's flags: of each block how it faces the light, whether it has a highlight; then the number of its blocks
FLAGS, LIT, USED = 0, BLOCKS, 2 * BLOCKS
#: bits of a block's first flag: some point faces the light, lies within its reach, sees it
FACES, REACHES, SEES = 1, 2, 4
#: constants: the largest coordinate, the smallest squared length that is not 0, room for rounding of boxes (`bounds`);
#: then ka ia, red, green and blue
LARGEST, TINY, SLACK, AMBIENT = range(4)

#: no literals in it, so it serves every precision as it is; a lowered form would give that of its own
dot = jit.inline(lambda_forms.dot)
_entry, _put, _select = intrinsics.entry, intrinsics.put, intrinsics.select


#: where the options stand among the loop's arguments
OPTIONS_ROW = 3


def bounds(precision: Precision) -> Array:
    """The bounds for a precision. The square of the largest coordinate, three times over, is finite."""
    info = np.finfo(precision.carrier)
    return np.array([np.sqrt(info.max) / 8, info.tiny, 1e3 * info.eps], precision.carrier)


def scratch(precision: Precision) -> Array:
    """Room for a tile, aligned to cache lines: a vector across two of them costs twice."""
    raw = np.zeros(SCRATCH * precision.carrier.itemsize + 64, np.uint8)
    first = -raw.ctypes.data % 64
    return raw[first : first + SCRATCH * precision.carrier.itemsize].view(precision.carrier)


@jit.inline
def three(s: Any, i: Any) -> Any:
    """The components of a vector: what stands at i in this plane and the two that follow it."""
    return _entry(s, i), _entry(s, i + TILE), _entry(s, i + 2 * TILE)


@jit.inline
def put_three(s: Any, i: Any, x: Any, y: Any, z: Any) -> None:
    """Write the components of a vector to i in this plane and the two that follow it."""
    _put(s, i, x)
    _put(s, i + TILE, y)
    _put(s, i + 2 * TILE, z)


@jit.inline
def component(rows: Any, i: Any, k: Any, count: Any, columns: Any) -> Any:
    """Component k of vector i: rows of three, or three columns one after the other, in one flat array."""
    return _entry(rows, k * count + i) if columns else _entry(rows, 3 * i + k)


@jit.inline
def load(rows: Any, s: Any, plane: Any, first: Any, blocks: Any, count: Any, columns: Any, limit: Any) -> Any:
    """Three planes of this tile; the last block is filled up with the last vector. Not 0 if one is not finite."""
    bad = np.int32(0)
    for b in range(blocks):
        start = first + b * BLOCK
        at = plane + b * BLOCK
        if start + BLOCK > count:
            for j in range(BLOCK):
                for k in range(3):
                    _put(s, at + k * TILE + j, component(rows, min(start + j, count - 1), k, count, columns))
        elif columns:
            for j in range(BLOCK):
                i = start + j
                put_three(s, at + j, _entry(rows, i), _entry(rows, count + i), _entry(rows, 2 * count + i))
        else:
            for j in range(BLOCK):
                i = 3 * (start + j)
                put_three(s, at + j, _entry(rows, i), _entry(rows, i + 1), _entry(rows, i + 2))
        for j in range(BLOCK):
            x, y, z = three(s, at + j)
            fine = (abs(x) <= limit) & (abs(y) <= limit) & (abs(z) <= limit)  # false for NaN too
            bad = np.int32(bad | np.int32(not fine))
    return bad


@jit.inline
def unit_normals(s: Any, blocks: Any, tiny: Any) -> Any:
    """Normals of length 1. Not 0 if one has no length."""
    one = s.dtype.type(1)
    bad = np.int32(0)
    for b in range(blocks):
        for j in range(BLOCK):
            i = NORMAL + b * BLOCK + j
            x, y, z = three(s, i)
            squared = dot(x, y, z, x, y, z)
            inverse = one / np.sqrt(squared)
            put_three(s, i, x * inverse, y * inverse, z * inverse)
            bad = np.int32(bad | np.int32(not squared >= tiny))
    return bad


@jit.inline
def look(s: Any, light: Any, blocks: Any, placed: Any, tiny: Any, keep: Any) -> None:
    """Directions to the viewer; NaN, and so no highlight, at the viewer's own place.

    keep  whether they stay as long as they are, for a formula that removes lengths by itself
    """
    ex, ey, ez = light[EYE], light[EYE + 1], light[EYE + 2]
    one, nan = s.dtype.type(1), s.dtype.type(np.nan)
    for b in range(blocks):
        for j in range(BLOCK):
            i = b * BLOCK + j
            x, y, z = ex, ey, ez
            if placed:
                x, y, z = three(s, POINT + i)
                x, y, z = ex - x, ey - y, ez - z
                squared = dot(x, y, z, x, y, z)
                inverse = _select(squared > tiny, one if keep else one / np.sqrt(squared), nan)
                x, y, z = x * inverse, y * inverse, z * inverse
            put_three(s, VIEW + i, x, y, z)


@jit.inline
def _fold(s: Any, low_at: Any, high_at: Any, lanes: Any) -> None:
    """Lowest and highest of twice as many lanes, left in the first ones."""
    for j in range(lanes):
        low, other = _entry(s, low_at + j), _entry(s, low_at + lanes + j)
        _put(s, low_at + j, _select(other < low, other, low))
        high, other = _entry(s, high_at + j), _entry(s, high_at + lanes + j)
        _put(s, high_at + j, _select(other > high, other, high))


@jit.inline
def enclose(s: Any, first: Any, blocks: Any) -> None:
    """The box of the points of some blocks of a tile, and that of their normals.

    Lowest and highest value of plane k stand at LOW + k * BLOCK and HIGH + k * BLOCK. Lanes first: LLVM does not
    vectorise a minimum of floats that may be NaN.
    """
    for k in range(6):
        low_at, high_at = LOW + k * BLOCK, HIGH + k * BLOCK
        for j in range(BLOCK):
            v = _entry(s, k * TILE + first * BLOCK + j)
            _put(s, low_at + j, v)
            _put(s, high_at + j, v)
        for b in range(first + 1, first + blocks):
            for j in range(BLOCK):
                v, low, high = _entry(s, k * TILE + b * BLOCK + j), _entry(s, low_at + j), _entry(s, high_at + j)
                _put(s, low_at + j, _select(v < low, v, low))
                _put(s, high_at + j, _select(v > high, v, high))
        _fold(s, low_at, high_at, 32)
        _fold(s, low_at, high_at, 16)
        _fold(s, low_at, high_at, 8)
        for j in range(1, 8):
            _put(s, low_at, min(_entry(s, low_at), _entry(s, low_at + j)))
            _put(s, high_at, max(_entry(s, high_at), _entry(s, high_at + j)))


@jit.inline
def store(s: Any, out: Any, first: Any, blocks: Any, count: Any, columns: Any) -> None:
    """Write the sums of a tile to the colours."""
    for b in range(blocks):
        start, at = first + b * BLOCK, SUM + b * BLOCK
        if start + BLOCK > count:
            for j in range(count - start):
                for k in range(3):
                    where = k * count + start + j if columns else 3 * (start + j) + k
                    _put(out, where, _entry(s, at + k * TILE + j))
        elif columns:
            for j in range(BLOCK):
                _put(out, start + j, _entry(s, at + j))
                _put(out, count + start + j, _entry(s, at + TILE + j))
                _put(out, 2 * count + start + j, _entry(s, at + 2 * TILE + j))
        else:
            for j in range(BLOCK):
                _put(out, 3 * (start + j), _entry(s, at + j))
                _put(out, 3 * (start + j) + 1, _entry(s, at + TILE + j))
                _put(out, 3 * (start + j) + 2, _entry(s, at + 2 * TILE + j))
