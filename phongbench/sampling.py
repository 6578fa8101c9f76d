"""Where approximations are measured: seeded, addressable pairs (a, b), unit and deliberately not.

Pair i of a stratum is a pure function of (seed, i): it is the same wherever, whenever and in whatever company it is
computed, so work can be split freely and a worst input is remembered by its index. Strata share their random numbers,
so that cells differ by what is studied and not by luck.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from phongbench import jit, powers
from phongbench.causes import BY_NAME, CAUSES, Cause, spoil
from phongbench.lowering import FLOAT64, Precision, lower

#: relative length errors: a 12-bit reciprocal root errs by 3.7e-4, one Newton step of the classic bit trick by 1.75e-3
LENGTH_ERRORS = (1e-4, 3.7e-4, 1.75e-3, 1e-2, 5e-2, 0.1)
#: the highlight stratum fills alpha * lambda = 0 .. 12; exp(-12) = 6e-6 is dark
HIGHLIGHT_REACH = 12.0
#: the cutoff stratum spans this many units in the last place on either side of the cut
CUTOFF_ULPS = 8

Scale = Literal["none", "alpha", "cutoff"]


@dataclass(frozen=True, slots=True)
class Stratum:
    """One kind of input.

    name          str      uniform, highlight, peak, cutoff, grazing, lengths or hostile
    scale         str      what the deficits are scaled by: nothing, 1 / alpha, or the cell's own cutoff
    perturbation  str      none, a, both or opposite: whose length is wrong; or one of causes.CAUSES: why
    length_error  float    relative and signed; 0.01 is 1 % too long (for `opposite`: a too long, b too short); 0 where
                           a cause decides
    """

    name: str
    scale: Scale = "none"
    perturbation: str = "none"
    length_error: float = 0.0

    @property
    def unnormalised(self) -> bool:
        """True if the two truths differ."""
        return self.perturbation != "none" or self.name == "hostile"

    @property
    def reaches_back(self) -> bool:
        """True if the gate on a.b > 0 is what this stratum tests."""
        return self.name in ("grazing", "hostile")

    @property
    def cause(self) -> Cause | None:
        """What makes the lengths wrong, where that is not a mere factor."""
        return BY_NAME.get(self.perturbation)

    @property
    def largest_length_error(self) -> float:
        """The largest relative length error, signed; a cause's is found by running it."""
        return self.length_error if self.cause is None else self.cause.length_error

    @property
    def share(self) -> float:
        """The share of a plan's samples that it gets: what many causes do is smooth, and they come in a row."""
        return 1.0 if self.cause is None else 0.25

    @property
    def lengths(self) -> tuple[float, float]:
        """|a| and |b| before any cause."""
        e = self.length_error
        factors = {"a": (e, 0.0), "both": (e, e), "opposite": (e, -e)}.get(self.perturbation, (0.0, 0.0))
        return 1 + factors[0], 1 + factors[1]


def _length_strata() -> Iterator[Stratum]:
    for size in LENGTH_ERRORS:
        for perturbation in ("a", "both"):
            for signed in (size, -size):
                yield Stratum("lengths", "alpha", perturbation, signed)
        yield Stratum("lengths", "alpha", "opposite", size)
    for cause in CAUSES:
        yield Stratum("lengths", "alpha", cause.name)


STRATA: tuple[Stratum, ...] = (
    Stratum("uniform"),
    Stratum("highlight", "alpha"),
    Stratum("peak"),
    Stratum("cutoff", "cutoff"),
    Stratum("grazing"),
    *_length_strata(),
    Stratum("hostile"),
)
STRATUM_NAMES = tuple(dict.fromkeys(s.name for s in STRATA))
_LAWS = {"uniform": 0, "highlight": 1, "lengths": 1, "peak": 2, "cutoff": 3, "grazing": 4}


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
    _pairs(_LAWS[stratum.name], _key(seed), start, scale, width, half_space, *stratum.lengths, a, b)
    if stratum.cause is not None:
        # numbers of their own: a vector's length before it was normalised has nothing to do with its direction
        places = np.empty((2, count))
        _fill(_key(seed + _CAUSES_SEED), start, places)
        for v, t in zip((a, b) if stratum.cause.both else (a,), places, strict=False):
            spoil(stratum.cause, t, v)
    for v in (a, b):
        hold(precision, v)
    return a, b


def hold(precision: Precision, values: NDArray[Any]) -> None:
    """Round numbers of the carrier type, shape (rows, n), to the precision, in place."""
    if precision.rounds:
        function, more = precision.rounding
        shift, low, high = more or (0.0, 0.0, 0.0)
        _hold(_ROUNDINGS.index(function), shift, low, high, values)


_ROUNDINGS = (jit.round_to_half, jit.round_to_bfloat16, jit.round_to_fixed)


@jit.driver
def _hold(kind: int, shift: float, low: float, high: float, values: Any) -> None:
    for row in values:
        if kind == 0:
            for i in range(len(row)):
                row[i] = jit.round_to_half(row[i])
        elif kind == 1:
            for i in range(len(row)):
                row[i] = jit.round_to_bfloat16(row[i])
        else:
            for i in range(len(row)):
                row[i] = jit.round_to_fixed(row[i], shift, low, high)


def cutoff_deficit(form: str, value: float) -> float | None:
    """The deficit 1 - cos(angle) at which a lambda form of unit vectors reaches `value`; None if it never does."""
    if form == "cross":
        return 1 - math.sqrt(1 - 2 * value) if value <= 0.5 else None
    if form == "tan2":
        return 1 - 1 / math.sqrt(1 + 2 * value)
    return value if value <= 2 else None


def uniforms(seed: int, start: int, count: int, streams: int) -> NDArray[np.float64]:
    """Numbers start .. start + count of independent streams, uniform in [0, 1); shape (streams, count).

    Column i is a pure function of (seed, start + i, streams).
    """
    out = np.empty((streams, count))
    _uniforms(_key(seed), start, out)
    return out


_MASK = 0xFFFFFFFFFFFFFFFF


@cache
def _key(seed: int) -> np.uint64:
    """A 64-bit key from any seed, by splitmix64's finaliser."""
    z = (seed + 0x9E3779B97F4A7C15) & _MASK
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & _MASK
    return np.uint64(z ^ (z >> 31))


_GOLDEN, _MIX_1, _MIX_2 = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S12 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(12)
_ONE_BITS = np.uint64(0x3FF0000000000000)


@jit.inline
def _uniform(key: Any, counter: Any) -> Any:
    """A number in [0, 1) with 52 random bits: splitmix64 of the counter."""
    z = key + counter * _GOLDEN
    z = (z ^ (z >> _S30)) * _MIX_1
    z = (z ^ (z >> _S27)) * _MIX_2
    z = z ^ (z >> _S31)
    return jit.float64_from_bits(np.int64((z >> _S12) | _ONE_BITS)) - 1.0


@jit.driver
def _uniforms(key: Any, start: int, out: Any) -> None:
    streams = np.uint64(out.shape[0])
    for i in range(out.shape[1]):
        counter = streams * (np.uint64(start) + np.uint64(i))
        for stream in range(out.shape[0]):
            out[stream, i] = _uniform(key, counter + np.uint64(stream))


#: cos(pi sqrt w) for w in [0, 1] as a polynomial: an azimuth without a call of libm, which would stop the vectoriser
_COSINE = powers.through_chebyshev_nodes(lambda w: np.cos(np.pi * np.sqrt(w)), 0.0, 1.0, 10)


def _cosine_of_turn(x: float) -> float:
    """cos(pi x) for x in [-1, 1], to about 1e-12.

    The sine is taken as the root of 1 - cos^2, so both make a unit vector.
    """
    w = x * x
    value = _COSINE[10]
    for k in range(9, -1, -1):
        value = value * w + _COSINE[k]
    return powers.clamped(value, -1.0, 1.0)


@jit.driver
def _fill(key: Any, start: int, out: Any) -> None:
    """Numbers in [0, 1): the columns start, start + 1, .. of an endless block, two rows."""
    for i in range(out.shape[1]):
        counter = np.uint64(2) * (np.uint64(start) + np.uint64(i))
        out[0, i] = _uniform(key, counter)
        out[1, i] = _uniform(key, counter + np.uint64(1))


#: what is added to a seed for the random numbers of causes
_CAUSES_SEED = 0xCA05E
_turn = lower(_cosine_of_turn, FLOAT64)
_exp2 = lower(powers.EXP2_64, FLOAT64)
_GRAZING = float(np.cos(np.radians(80)))


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
        deficit[i] = _uniform(key, base + np.uint64(4) * np.uint64(i))
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
        height = 2.0 * _uniform(key, counter + np.uint64(1)) - 1.0
        turn = 2.0 * _uniform(key, counter + np.uint64(2)) - 1.0
        azimuth = 2.0 * _uniform(key, counter + np.uint64(3)) - 1.0
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
        0.0,
        -0.0,
        tiny,
        -tiny,
        precision.tiny,
        1e-3,
        1.0,
        -1.0,
        math.sqrt(huge),
        huge,
        -huge,
        math.inf,
        -math.inf,
        math.nan,
    ]
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
