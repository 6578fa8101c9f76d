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
from typing import Any

import numpy as np

from phongbench.accuracy.enclosures.ends import Ends, Mask
from phongbench.accuracy.enclosures.spans import Arithmetic, Span
from phongbench.compiler.precisions import Precision

#: sum over components of (|a_y b_z| + |a_z b_y|)^2 is at most this, squared, for unit vectors
_CROSS = 2 / math.sqrt(3)


@dataclass(frozen=True)
class Lengths:
    """The lengths that a vector may have, and how far it is off its direction, as a share of its length."""

    low: Any = 1.0
    high: Any = 1.0
    off: Any = 0.0


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
    return 1.0 + 2 * float(_dot_error(Arithmetic(precision), lengths, lengths)) / float(lengths.low) ** 2


def coordinates(form: str, precision: Precision, low: Ends, high: Ends, lengths: Lengths) -> Coordinates:
    """What a kernel of this form is given at deficits 1 - cos(angle) in [low, high], each of shape (n,)."""
    rule, pair = Arithmetic(precision), (lengths, lengths)
    of_pair = cosine(rule, low, high, *pair)
    opens, closes = of_pair.high > 0, of_pair.low <= 0
    if form == "none":
        span = of_pair
    elif form == "dot":
        span = 1.0 - of_pair
    elif form == "difference":
        span = _half(squared_difference(rule, low, high, *pair))
    elif form == "cross":
        span = _half(squared_cross(rule, low, high, *pair))
    else:  # both lengths cancel in tan2, and the roundings are relative to them
        unit = Lengths(), Lengths()
        x = cosine(rule, low, high, *unit)
        span = _half(squared_cross(rule, low, high, *unit)) / (x * x)
    return Coordinates(span.low, span.high, opens, closes)


def _grown(rule: Arithmetic, roundings: int) -> float:
    """What so many roundings may make of a number, beyond it, as a share."""
    return math.expm1(roundings * math.log1p(rule.unit))


def _moved(a: Lengths, b: Lengths) -> Any:
    """What being off adds to a product of both, as a share of both lengths."""
    return a.off + b.off + a.off * b.off


def _dot_error(rule: Arithmetic, a: Lengths, b: Lengths) -> Any:
    if rule.precision.saturates:
        return 3 * rule.precision.eps
    off = _grown(rule, 3) + (1 + _grown(rule, 3)) * _moved(a, b)
    return off * a.high * b.high + 3 * rule.precision.smallest + 9 * rule.flushed


def cosine(rule: Arithmetic, low: Ends, high: Ends, a: Lengths, b: Lengths) -> Span:
    """a.b as it is computed."""
    least, most, off = 1 - high, 1 - low, _dot_error(rule, a, b)
    short, long = a.low * b.low, a.high * b.high
    return rule.rounded(np.minimum(short * least, long * least) - off, np.maximum(short * most, long * most) + off)


def squared_length(rule: Arithmetic, a: Lengths, like: Ends) -> Span:
    """a.a as it is computed, in the shape of `like`."""
    off = 3 * rule.precision.smallest + 3 * rule.flushed
    share, none = _grown(rule, 3), np.zeros_like(like)
    low = (a.low * (1 - a.off)) ** 2 * (1 - share) - off
    return rule.rounded(none + low, none + (a.high * (1 + a.off)) ** 2 * (1 + share) + off)


def squared_difference(rule: Arithmetic, low: Ends, high: Ends, a: Lengths, b: Lengths) -> Span:
    """|a - b|^2: 2 |a| |b| d + (|a| - |b|)^2, convex in both lengths, so largest where each is at an end."""
    corners = [(x - y) ** 2 + 2 * x * y * high for x in (a.low, a.high) for y in (b.low, b.high)]
    most = np.maximum.reduce(corners)
    least = 2 * a.low * b.low * low
    shift = a.off * a.high + b.off * b.high + 4 * rule.flushed
    if np.any(shift):
        least, most = np.maximum(0.0, np.sqrt(least) - shift) ** 2, (np.sqrt(most) + shift) ** 2
    return _sum_of_squares(rule, least, most, 5)


def squared_cross(rule: Arithmetic, low: Ends, high: Ends, a: Lengths, b: Lengths) -> Span:
    """|a x b|^2 as it is computed; low and high straddle no right angle, or the sine's largest is taken."""
    u, short, long = rule.unit, a.low * b.low, a.high * b.high
    sines = [np.sqrt(np.clip(d * (2 - d), 0.0, 1.0)) for d in (low, high)]
    least = short * np.minimum(*sines)
    most = long * np.where((low <= 1) & (high >= 1), 1.0, np.maximum(*sines))
    moved = long * _moved(a, b)
    off = u * (1 + 2 * u) * (_CROSS * (long + moved) + most + moved) + moved
    off = off + 6 * rule.precision.smallest + 9 * rule.flushed
    if rule.precision.saturates:
        off = np.full_like(most, 2 * rule.precision.eps)
    return _sum_of_squares(rule, np.maximum(0.0, least - off) ** 2, (most + off) ** 2, 3)


def _sum_of_squares(rule: Arithmetic, low: Ends, high: Ends, roundings: int) -> Span:
    """A sum of three squares whose result is off by so many units of itself, or by steps."""
    share = 0.0 if rule.precision.saturates else _grown(rule, roundings)
    off = 3 * rule.precision.smallest + 3 * rule.flushed
    return rule.rounded(np.maximum(0.0, low * (1 - share) - off), high * (1 + share) + off)


def _half(span: Span) -> Span:
    return span.rule.rounded(0.5 * span.low, 0.5 * span.high)
