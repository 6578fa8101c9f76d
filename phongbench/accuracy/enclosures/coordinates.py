"""What a kernel is given for pairs at a known angle: the coordinate and the gate, whatever their lengths and rounding.

Domain: pairs (a, b) of vectors that the precision holds, whose lengths lie in a range. Each operation errs by at most
half a unit, in any order of the sums, with products rounded or fused; `u` below is half of eps.

- a.b      off by 3 u |a| |b|: each product by u of itself, each sum by u of the partial sums
- |a-b|^2  off by 5 u of itself: a component of the difference by u, its square again, and two sums
- |a x b|  as a vector off by u (2 / sqrt(3) |a| |b| + |a x b|): the two products of each component, which are longest
           together for equal vectors along a diagonal, and their difference; its square then by 3 u of itself

In fixed point an operation errs by half a step instead, and saturates.
"""

import math
from dataclasses import dataclass

import numpy as np

from phongbench.accuracy.enclosures.spans import Arithmetic, Ends, Mask, Span
from phongbench.compiler.precisions import Precision

#: sum over components of (|a_y b_z| + |a_z b_y|)^2 is at most this, squared, for unit vectors
_CROSS = 2 / math.sqrt(3)


@dataclass(frozen=True)
class Lengths:
    """The lengths that either vector may have."""

    low: float = 1.0
    high: float = 1.0


def normalised(precision: Precision, length_error: float = 0.0) -> Lengths:
    """Lengths of vectors that a shader made unit, v * (1 / sqrt(v.v)) or v / sqrt(v.v), then up to `length_error` off.

    v.v errs by up to 3 u, of which the root leaves half; root, reciprocal and product err by u each: 4.5 u in all, by
    any order of the sum and fused or not. A hundredth of u is added for squares that lose digits near 0: v.v is meant
    to be far from overflow and from the smallest numbers, as it is for vectors of length 1/4 to 4. Nobody normalises in
    fixed point: vectors are rounded there, whose length is off by at most sqrt(3) / 2 steps.
    """
    u = precision.eps / 2
    off = 2 * u if precision.saturates else math.expm1(4.5 * math.log1p(u)) + 0.01 * u
    return Lengths((1 - off) * (1 - length_error), (1 + off) * (1 + length_error))


@dataclass(frozen=True)
class Coordinates:
    """For n intervals of the deficit: the coordinate, and whether the gate on a.b > 0 may be open, and closed."""

    low: Ends
    high: Ends
    opens: Mask
    closes: Mask


def end_of_deficits(precision: Precision, lengths: Lengths) -> float:
    """The deficit from which on the gate is closed for sure; at least 1."""
    return 1.0 + 2 * _dot_error(precision, lengths) / lengths.low**2


def coordinates(form: str, precision: Precision, low: Ends, high: Ends, lengths: Lengths) -> Coordinates:
    """What a kernel of this form is given at deficits 1 - cos(angle) in [low, high], each of shape (n,)."""
    rule = Arithmetic(precision)
    cosine = _cosine(rule, low, high, lengths)
    opens, closes = cosine.high > 0, cosine.low <= 0
    if form == "none":
        span = cosine
    elif form == "dot":
        span = 1.0 - cosine
    elif form == "difference":
        span = _difference(rule, low, high, lengths)
    elif form == "cross":
        span = _half(rule, *_squared_cross(rule, low, high, lengths))
    else:  # both lengths cancel in tan2, and the roundings are relative to them
        unit = Lengths()
        x = _cosine(rule, low, high, unit)
        span = _half(rule, *_squared_cross(rule, low, high, unit)) / (x * x)
    return Coordinates(span.low, span.high, opens, closes)


def _dot_error(precision: Precision, lengths: Lengths) -> float:
    if precision.saturates:
        return 3 * precision.eps
    return math.expm1(3 * math.log1p(precision.eps / 2)) * lengths.high**2 + 3 * precision.smallest


def _cosine(rule: Arithmetic, low: Ends, high: Ends, lengths: Lengths) -> Span:
    """a.b as it is computed."""
    least, most, off = 1 - high, 1 - low, _dot_error(rule.precision, lengths)
    short, long = lengths.low**2, lengths.high**2
    return rule.rounded(np.minimum(short * least, long * least) - off, np.maximum(short * most, long * most) + off)


def _difference(rule: Arithmetic, low: Ends, high: Ends, lengths: Lengths) -> Span:
    """Half of |a - b|^2: s d + (|a| - |b|)^2 / 2, convex in both lengths, so largest where each is at an end."""
    short, long = lengths.low, lengths.high
    most = np.maximum(long**2 * high, 0.5 * (long - short) ** 2 + long * short * high)
    return _half(rule, *_sum_of_squares(rule, 2 * short**2 * low, 2 * most, 5))


def _squared_cross(rule: Arithmetic, low: Ends, high: Ends, lengths: Lengths) -> tuple[Ends, Ends]:
    """|a x b|^2 as it is computed; low and high straddle no right angle, or the sine's largest is taken."""
    u, short, long = rule.precision.eps / 2, lengths.low**2, lengths.high**2
    sines = [np.sqrt(np.clip(d * (2 - d), 0.0, 1.0)) for d in (low, high)]
    least = short * np.minimum(*sines)
    most = long * np.where((low <= 1) & (high >= 1), 1.0, np.maximum(*sines))
    off = u * (1 + 2 * u) * (_CROSS * long + most) + 6 * rule.precision.smallest
    if rule.precision.saturates:
        off = np.full_like(most, 2 * rule.precision.eps)
    return _sum_of_squares(rule, np.maximum(0.0, least - off) ** 2, (most + off) ** 2, 3)


def _sum_of_squares(rule: Arithmetic, low: Ends, high: Ends, roundings: int) -> tuple[Ends, Ends]:
    """A sum of three squares whose result is off by so many u of itself, or by steps."""
    precision = rule.precision
    share = 0.0 if precision.saturates else math.expm1(roundings * math.log1p(precision.eps / 2))
    off = 3 * precision.smallest
    span = rule.rounded(np.maximum(0.0, low * (1 - share) - off), high * (1 + share) + off)
    return span.low, span.high


def _half(rule: Arithmetic, low: Ends, high: Ends) -> Span:
    return rule.rounded(0.5 * low, 0.5 * high)
