"""The emitted code on intervals: what its words mean for a pair of directions at known deficits on any device.

A direction is a share of deficits with the lengths it may have. Its products with another are what coordinates.py says
of them; whatever is made of those are intervals (`spans`), with the accuracies of `devices`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from phongbench.accuracy.enclosures.coordinates import (
    Lengths,
    cosine,
    squared_cross,
    squared_difference,
    squared_length,
)
from phongbench.accuracy.enclosures.devices import Device
from phongbench.accuracy.enclosures.ends import Ends
from phongbench.accuracy.enclosures.spans import Arithmetic, Span

#: a conversion to whole numbers with more possible results than this is not followed one by one
FEW = 400


@dataclass(frozen=True)
class Direction:
    """One of a pair of directions, at deficits 1 - cos(angle) of the pair.

    which    a or b
    lengths  that it may have; None where the cosine is given exactly, and only that is asked of the pair
    """

    which: str
    rule: Device
    low: Ends
    high: Ends
    lengths: Lengths | None

    def __mul__(self, scale: Span) -> "Direction":
        """Each component is rounded, which moves the direction too."""
        assert self.lengths is not None
        known, unit = self.lengths, self.rule.unit
        off = known.off + unit * (1 + known.off)
        return replace(self, lengths=Lengths(known.low * scale.low, known.high * scale.high, off))

    def __sub__(self, other: "Direction") -> "_Pair":
        return _Pair(squared_difference, self, other)


@dataclass(frozen=True)
class _Pair:
    """A vector made of both directions, of which only the square is known."""

    square: Callable[..., Span]
    a: Direction
    b: Direction


def _dot(x: Direction | _Pair, y: Direction | _Pair) -> Span:
    if isinstance(x, _Pair):
        assert x == y
        return _of(x.square, x.a, x.b)
    assert isinstance(y, Direction)
    if x.which != y.which:
        return _of(cosine, x, y)
    assert x.lengths is not None
    return squared_length(x.rule, x.lengths, x.low)


def _of(product: Callable[..., Span], a: Direction, b: Direction) -> Span:
    if a.lengths is None or b.lengths is None:
        return Span.of(1 - a.high, 1 - a.low, a.rule)
    return product(a.rule, a.low, a.high, a.lengths, b.lengths)


class Whole:
    """Whole numbers in intervals, exact, (n,) both ends: an index, bits of a float, or what bits are made of."""

    def __init__(self, low: Ends, high: Ends, rule: Arithmetic) -> None:
        self.low, self.high, self.rule = low, high, rule

    def __add__(self, number: int) -> "Whole":
        return Whole(self.low + number, self.high + number, self.rule)

    def __sub__(self, number: int) -> "Whole":
        return self + -number

    def __mul__(self, number: int) -> "Whole":
        return Whole(self.low * number, self.high * number, self.rule)

    def __lt__(self, number: int) -> bool:
        return bool(self.rule.answer(((1, self.low < number), (0, self.high >= number))))


class _Listed:
    """A table's entries, as the precision holds them."""

    def __init__(self, rule: Device, *entries: float) -> None:
        self.rule, self.entries = rule, np.asarray(rule.precision.rounded(entries), np.float64)

    def __getitem__(self, index: int | Whole) -> Span:
        """Anything where nothing limits the index."""
        low, high = (index.low, index.high) if isinstance(index, Whole) else (np.full(1, index),) * 2
        known = (low == high) & (low >= 0) & (low < len(self.entries))
        entry = self.entries[np.where(known, low, 0).astype(np.intp)]
        return Span.of(np.where(known, entry, -np.inf), np.where(known, entry, np.inf), self.rule)


def _to_int(x: Any) -> Any:
    """Towards 0. Of a few possible numbers in an interval each is followed by itself, with what leads to it."""
    if not isinstance(x, Span):
        return int(x)
    low, high = np.trunc(x.low), np.trunc(x.high)
    more = high - low
    if not float(more.max()) <= FEW:
        return Whole(low, high, x.rule)
    number = low + x.rule.answer([(k, more >= k) for k in range(int(more.max()) + 1)])
    x.low, x.high = np.maximum(x.low, number - (number <= 0)), np.minimum(x.high, number + (number >= 0))
    return Whole(number, number, x.rule)


def _to_float(x: Any, rule: Device) -> Any:
    """In float32, whatever the precision: bits are read there, and an index fits any."""
    return rule.wide.product(x.low, x.high) if isinstance(x, Whole) else float(x)


def _float_bits(x: Span) -> Whole:
    low, high = (np.asarray(end).astype(np.float32).view(np.int32).astype(np.float64) for end in (x.low, x.high))
    return Whole(low, high, x.rule)


def _bits_float(x: Any, rule: Device) -> Any:
    if not isinstance(x, Whole):
        return float(np.int32(x).view(np.float32))
    top = np.float32(np.inf).view(np.int32)
    low, high = (np.clip(e, 0, top).astype(np.int32).view(np.float32).astype(np.float64) for e in (x.low, x.high))
    return rule.wide.within(low, high)


def words(rule: Device) -> Mapping[str, Any]:
    """The functions that emitted code calls, by GLSL's names."""
    return {
        "chosen": lambda condition, yes, no: yes() if condition() else no(),
        "dot": _dot,
        "cross": lambda a, b: _Pair(squared_cross, a, b),
        "inversesqrt": rule.reciprocal_root,
        "sqrt": rule.root,
        "exp2": rule.exp2,
        "log2": rule.log2,
        "pow": rule.power,
        "acos": rule.arc_cosine,
        "max": rule.larger,
        "min": rule.smaller,
        "clamp": rule.clamped,
        "saturate": lambda x: rule.clamped(x, 0.0, 1.0),
        "to_int": _to_int,
        "to_float": partial(_to_float, rule=rule),
        "float_bits": _float_bits,
        "bits_float": partial(_bits_float, rule=rule),
        "listed": partial(_Listed, rule),
    }
