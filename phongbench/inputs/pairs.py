"""The pairs (a, b) of the strata: seeded and addressable.

Pair i of a stratum is a pure function of (seed, i): it is the same wherever, whenever and with whatever else it is
computed, so work can be split freely and a worst input is remembered by its index. Strata share their random numbers,
so that cells differ by what is studied and not by luck.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler import elementary, intrinsics, jit
from phongbench.compiler.lowering import FLOAT64, Precision, lower
from phongbench.compiler.polynomials import through_chebyshev_nodes
from phongbench.compiler.precisions import Array
from phongbench.inputs.length_errors import spoil
from phongbench.inputs.normalising import made_unit
from phongbench.inputs.random_numbers import key_of, uniform, uniforms
from phongbench.inputs.strata import CUTOFF_ULPS, HIGHLIGHT_REACH, STRATA, Stratum

_LAWS = {"uniform": 0, "highlight": 1, "lengths": 1, "normalised": 1, "peak": 2, "cutoff": 3, "grazing": 4}


def pairs(
    stratum: Stratum,
    precision: Precision,
    *,
    seed: int,
    start: int,
    count: int,
    scale: float = 1.0,
    half_space: bool = False,
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Pairs start .. start + count of a stratum, as they are held in the working precision.

    scale       1 / alpha, or the cutoff's deficit, for strata that have a scale
    half_space  True for (N, H) at half the angle of (R, V)
    returns     a and b, each of shape (3, count) in the precision's carrier type
    """
    if stratum.name == "hostile":
        return _hostile_pairs(precision, seed, start, count)
    a, b = np.empty((3, count), precision.carrier), np.empty((3, count), precision.carrier)
    width = 2 * CUTOFF_ULPS * precision.eps
    _pairs(_LAWS[stratum.name], key_of(seed), start, scale, width, half_space, *stratum.lengths, a, b)
    if stratum.cause is not None:
        # numbers of their own: a vector's length before it was normalised has nothing to do with its direction
        places = uniforms(seed + _CAUSES_SEED, start, count, 2)
        for v, t in zip((a, b) if stratum.cause.both else (a,), places, strict=False):
            spoil(stratum.cause, t, v)
    if stratum.name == "normalised":
        return made_unit(precision, a, b, seed=seed, start=start)
    for v in (a, b):
        hold(precision, v)
    return a, b


def highlight_frames(seed: int, start: int, count: int, scale: float) -> tuple[Array, Array]:
    """The unit vectors of the highlight stratum's pairs in float64: a uniform on the sphere, b within its reach."""
    a, b = np.empty((3, count)), np.empty((3, count))
    _pairs(_LAWS["highlight"], key_of(seed), start, scale, 0.0, False, 1.0, 1.0, a, b)
    return a, b


def hold(precision: Precision, values: NDArray[Any]) -> None:
    """Round numbers of the carrier type, shape (rows, n), to the precision, in place."""
    if precision.rounding is not None:
        function, more = precision.rounding
        shift, low, high = more or (0.0, 0.0, 0.0)
        _hold(_ROUNDINGS.index(function), shift, low, high, values)


_ROUNDINGS = (intrinsics.round_to_half, intrinsics.round_to_bfloat16, intrinsics.round_to_fixed)


@jit.driver
def _hold(kind: int, shift: float, low: float, high: float, values: Any) -> None:
    for row in values:
        if kind == 0:
            for i in range(len(row)):
                row[i] = intrinsics.round_to_half(row[i])
        elif kind == 1:
            for i in range(len(row)):
                row[i] = intrinsics.round_to_bfloat16(row[i])
        else:
            for i in range(len(row)):
                row[i] = intrinsics.round_to_fixed(row[i], shift, low, high)


#: cos(pi sqrt w) for w in [0, 1] as a polynomial: an azimuth without a call of libm, which would stop the vectoriser
_COSINE = through_chebyshev_nodes(lambda w: np.cos(np.pi * np.sqrt(w)), 0.0, 1.0, 10)


def _cosine_of_turn(x: float) -> float:
    """cos(pi x) for x in [-1, 1], to about 1e-12.

    The sine is taken as the root of 1 - cos^2, so both make a unit vector.
    """
    w = x * x
    value = _COSINE[10]
    for k in range(9, -1, -1):
        value = value * w + _COSINE[k]
    return elementary.clamped(value, -1.0, 1.0)


#: what is added to a seed for the random numbers of causes
_CAUSES_SEED = 0xCA05E
_turn = lower(_cosine_of_turn, FLOAT64)
_exp2 = lower(elementary.EXP2_64, FLOAT64)
_GRAZING = float(np.cos(np.radians(80)))


# ten arguments, for compiled code takes no objects
@jit.driver
def _pairs(
    law: int,
    key: Any,
    start: int,
    scale: float,
    width: float,
    half_space: bool,
    length_a: float,
    length_b: float,
    a: Any,
    b: Any,
) -> None:
    deficit = np.empty(a.shape[1])
    _deficits(law, key, start, scale, width, deficit)
    if half_space:
        for i in range(len(deficit)):
            deficit[i] = 0.5 * deficit[i] / (1.0 + math.sqrt(max(0.0, 1.0 - 0.5 * deficit[i])))
    _frames(key, start, deficit, length_a, length_b, a, b)


@jit.driver
def _deficits(law: int, key: Any, start: int, scale: float, width: float, deficit: Any) -> None:
    """1 - cos(angle) of each pair; stream 0 of the four random streams."""
    base = np.uint64(4) * np.uint64(start)
    for i in range(len(deficit)):
        deficit[i] = uniform(key, base + np.uint64(4) * np.uint64(i))
    if law == 0:
        for i in range(len(deficit)):
            deficit[i] = 2.0 * deficit[i]
    elif law == 1:
        reach = min(HIGHLIGHT_REACH * scale, 2.0)
        for i in range(len(deficit)):
            deficit[i] = reach * deficit[i]
    elif law == 2:  # an eighth exactly equal, the rest 2^-60 .. 2^-16 apart: neighbours in every precision
        for i in range(len(deficit)):
            t = deficit[i]
            deficit[i] = _exp2(-66.0 + 50.0 * t) if t > 0.125 else 0.0
    elif law == 3:
        for i in range(len(deficit)):
            deficit[i] = min(2.0, scale * (1.0 + width * (deficit[i] - 0.5)))
    else:  # an eighth exactly opposite
        for i in range(len(deficit)):
            t = deficit[i] * (8.0 / 7.0)
            deficit[i] = 1.0 - _GRAZING + (1.0 + _GRAZING) * min(t, 1.0)


@jit.driver
def _frames(key: Any, start: int, deficit: Any, length_a: float, length_b: float, a: Any, b: Any) -> None:
    """a uniform on the sphere, b at the deficit from a with a uniform azimuth, both given their lengths."""
    base = np.uint64(4) * np.uint64(start)
    for i in range(len(deficit)):
        counter = base + np.uint64(4) * np.uint64(i)
        height = 2.0 * uniform(key, counter + np.uint64(1)) - 1.0
        turn = 2.0 * uniform(key, counter + np.uint64(2)) - 1.0
        azimuth = 2.0 * uniform(key, counter + np.uint64(3)) - 1.0
        radius = math.sqrt(1.0 - height * height)
        cos_turn, cos_azimuth = _turn(turn), _turn(azimuth)
        sin_turn = math.copysign(math.sqrt(1.0 - cos_turn * cos_turn), turn)
        sin_azimuth = math.copysign(math.sqrt(1.0 - cos_azimuth * cos_azimuth), azimuth)
        d = deficit[i]
        cosine, sine = 1.0 - d, math.sqrt(max(0.0, d * (2.0 - d)))
        along, across = sine * cos_azimuth, sine * sin_azimuth
        ax, ay, az = radius * cos_turn, radius * sin_turn, height
        bx = cosine * ax + along * height * cos_turn - across * sin_turn
        by = cosine * ay + along * height * sin_turn + across * cos_turn
        bz = cosine * az - along * radius
        a[0, i], a[1, i], a[2, i] = length_a * ax, length_a * ay, length_a * az
        b[0, i], b[1, i], b[2, i] = length_b * bx, length_b * by, length_b * bz


def _hostile_pairs(precision: Precision, seed: int, start: int, count: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Vectors that should never arrive but do: zero, subnormal, huge, infinite, NaN, opposite.

    Every one with every other.
    """
    tiny, huge = precision.smallest, precision.largest
    special = [
        0.0, -0.0, tiny, -tiny, precision.tiny, 1e-3, 1.0, -1.0, math.sqrt(huge), huge, -huge, math.inf, -math.inf,
        math.nan,
    ]  # fmt: skip
    vectors = precision.rounded(
        [(s, 0.0, 0.0) for s in special] + [(s, s, s) for s in special] + [(0.6, s, 0.8) for s in special]
    )
    random, _ = pairs(STRATA[0], precision, seed=seed, start=0, count=8)
    vectors = np.concatenate([vectors, random.T, -random.T])
    index = np.arange(start, start + count)
    return (
        np.ascontiguousarray(vectors[index % len(vectors)].T),
        np.ascontiguousarray(vectors[(index // len(vectors)) % len(vectors)].T),
    )


#: how many hostile pairs there are: every special vector with every other
HOSTILE_PAIRS = (3 * 14 + 16) ** 2
