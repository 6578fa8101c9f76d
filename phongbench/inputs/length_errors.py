"""Why vectors are not of unit length: cheap reciprocal roots, half precision, interpolation; what each really does.

A cause is given unit vectors and random numbers, and leaves what the pipeline with that cause would pass on. The error
is computed by running the cause, so its largest size is a fact and not a quotation.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from phongbench.compiler import elementary, intrinsics, jit
from phongbench.compiler.lowering import FLOAT64, lower
from phongbench.compiler.precisions import Array
from phongbench.formulas.reciprocal_roots import bit_trick_root, short_series, twelve_bit_root

#: the series is for vectors that are nearly unit: lengths up to so far from 1
NEARLY = 0.1
_TABLE, _BITS, _HALF, _SERIES, _EDGE, _SPREAD = range(6)
#: a cause's largest error is looked for at so many places of its range, its ends among them
_PLACES = 1 << 18


@dataclass(frozen=True, slots=True)
class Cause:
    """One way in which lengths go wrong.

    name     str    the perturbation column
    kind     int    which loop of `spoil`
    steps    int    Newton steps after the bit trick
    degrees  float  angle that a mesh edge subtends
    both     bool   False if only a is made that way
    text     str    for people
    """

    name: str
    text: str
    kind: int
    steps: int = 0
    degrees: float = 0.0
    both: bool = True

    @property
    def length_error(self) -> float:
        """The largest relative length error that the cause makes, signed, to four digits: computed by running it."""
        return _largest(self)

    def at_worst(self) -> float:
        """The same, computed anew."""
        at = np.linspace(0.0, 1.0, _PLACES, endpoint=False)
        if self.kind == _HALF:  # every direction of a spiral over the sphere
            height, turn = 2 * at - 1 + 1 / _PLACES, math.pi * (3 - math.sqrt(5)) * np.arange(_PLACES)
            flat = np.sqrt(1 - height * height)
            v = np.stack([flat * np.cos(turn), flat * np.sin(turn), height])
        else:
            v = np.zeros((3, _PLACES))
            v[2] = 1.0
        spoil(self, at, v)
        error = np.sqrt((v * v).sum(axis=0)) - 1
        return float(f"{error[np.argmax(np.abs(error))]:.4g}")


@cache
def _largest(cause: Cause) -> float:
    return cause.at_worst()


CAUSES = (
    Cause("rsqrt-12", "a 12-bit reciprocal root", _TABLE),
    Cause("rsqrt-bits-0", "the bit trick alone", _BITS, 0),
    Cause("rsqrt-bits-1", "the bit trick with a Newton step", _BITS, 1),
    Cause("rsqrt-bits-2", "the bit trick with two Newton steps", _BITS, 2),
    Cause("half", "rounding to float16", _HALF),
    Cause("series", "Lyon's short series, lengths up to 10 % wrong", _SERIES),
    Cause("interpolated-10", "interpolation along a mesh edge of 10 degrees", _EDGE, degrees=10.0, both=False),
    Cause("interpolated-30", "interpolation along a mesh edge of 30 degrees", _EDGE, degrees=30.0, both=False),
)
#: no cause, but all lengths that a scene may hold: only formulas that remove lengths are measured on it
ANY = Cause("any", "any length from 0.001 to 1000", _SPREAD)
BY_NAME = {cause.name: cause for cause in (*CAUSES, ANY)}
_DECADES = 2 * math.log2(1e3)


def along_edge(t: float, degrees: float) -> float:
    """Length of a normal interpolated at share t of an edge whose unit normals stand `degrees` apart.

    In the middle cos(degrees / 2), shorter than 1 by an eighth of the angle's square.
    """
    return math.sqrt(1.0 - 2.0 * t * (1.0 - t) * (1.0 - math.cos(math.radians(degrees))))


_table, _bits, _exp2 = jit.inline(twelve_bit_root), jit.inline(bit_trick_root), lower(elementary.EXP2_64, FLOAT64)
_series, _edge = jit.inline(short_series), jit.inline(along_edge)


def spoil(cause: Cause, t: Array, v: Array) -> None:
    """Do to unit vectors, in place, what a cause does.

    t  float64 (n,) in [0, 1)   where in the cause's range each vector is: the length before it was normalised (all of a
                                binade and the next for roots, 1 -+ NEARLY for the series), or the place on the edge
    v  (3, n)                   unit vectors in any carrier
    """
    _spoil(cause.kind, cause.steps, cause.degrees, t, v)


@jit.driver
def _spoil(kind: int, steps: int, degrees: float, t: Array, v: Array) -> None:
    factor = np.ones(len(t))
    if kind == _TABLE:
        for i in range(len(t)):
            q = _exp2(2.0 * t[i])
            factor[i] = math.sqrt(q) * _table(q)
    elif kind == _BITS:
        for i in range(len(t)):
            q32 = np.float32(_exp2(2.0 * t[i]))
            factor[i] = math.sqrt(np.float64(q32)) * np.float64(_bits(q32, steps))
    elif kind == _SERIES:
        for i in range(len(t)):
            length = 1.0 + NEARLY * (2.0 * t[i] - 1.0)
            factor[i] = length * _series(length * length)
    elif kind == _EDGE:
        for i in range(len(t)):
            factor[i] = _edge(t[i], degrees)
    elif kind == _SPREAD:
        for i in range(len(t)):
            factor[i] = _exp2(_DECADES * (t[i] - 0.5))
    else:
        for row in range(3):
            for i in range(len(t)):
                v[row, i] = intrinsics.round_to_half(v[row, i])
    for row in range(3):
        for i in range(len(t)):
            v[row, i] *= factor[i]
