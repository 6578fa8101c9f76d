"""Intervals whose ends may be infinite: numbers of `sets` that hold across poles, roots and the ends of the domain."""

import math
from collections.abc import Callable
from typing import Any

import flint

from phongbench.accuracy.probes.certify.sets import Number, Operand, TooWideError, down, ends, up


class Range(Number):
    """An interval [low, high] whose ends may be infinite; every operation rounds outwards."""

    __array_ufunc__ = None
    __slots__ = ("high", "low")

    def __init__(self, low: Any, high: float | None = None) -> None:
        self.low: float
        self.high: float
        self.low, self.high = low.ends() if isinstance(low, Range) else (low, low if high is None else high)

    def ends(self) -> tuple[float, float]:
        """The interval."""
        return self.low, self.high

    def narrow(self, low: float, high: float) -> None:
        """Cut the interval; what is left of an empty one does not matter, since no number takes this path."""
        self.low, self.high = max(self.low, low), min(self.high, high)
        if self.low > self.high:
            self.low = self.high = low if math.isfinite(low) else high

    def __add__(self, other: Operand) -> "Range":
        low, high = ends(other)
        return _outwards(self.low + low, self.high + high)

    def __sub__(self, other: Operand) -> "Range":
        low, high = ends(other)
        return _outwards(self.low - high, self.high - low)

    def __rsub__(self, other: Operand) -> "Range":
        return -self + other

    def __mul__(self, other: Operand) -> "Range":
        low, high = ends(other)
        if other is self:  # a square is never negative
            products = [_product(low, low), _product(high, high)]
            return _outwards(0.0 if low <= 0 <= high else min(products), max(products))
        products = [_product(x, y) for x in (self.low, self.high) for y in (low, high)]
        return _outwards(min(products), max(products))

    def __truediv__(self, other: Operand) -> "Range":
        low, high = ends(other)
        if low < 0 < high or low == high == 0:
            return Range(-math.inf, math.inf)
        return self * _outwards(
            -math.inf if high == 0 else 1 / high if math.isfinite(high) else 0.0,
            math.inf if low == 0 else 1 / low if math.isfinite(low) else 0.0,
        )

    def __rtruediv__(self, other: float) -> "Range":
        return Range(other) / self

    def __pow__(self, other: float) -> "Range":
        """A power of a base that is not negative."""
        if self.low < 0 or other < 0:
            raise TooWideError
        return Range(_power(self.low, other)[0], _power(self.high, other)[1])

    def __rpow__(self, other: float) -> "Range":
        return Range(_power(other, self.low)[0], _power(other, self.high)[1])

    def __neg__(self) -> "Range":
        return Range(-self.high, -self.low)

    __radd__, __rmul__ = __add__, __mul__

    @staticmethod
    def exp(x: "Range") -> "Range":
        """e^x."""
        return Range(_outer(x.low, flint.arb.exp)[0], _outer(x.high, flint.arb.exp)[1])

    @staticmethod
    def sqrt(x: "Range") -> "Range":
        """The square root; of 0 where x is negative."""
        return _outwards(math.sqrt(max(0.0, x.low)), math.sqrt(max(0.0, x.high)))

    @staticmethod
    def acos(x: "Range") -> "Range":
        """The arc cosine of what lies in [-1, 1]."""
        low, high = (min(1.0, max(-1.0, end)) for end in x.ends())
        return Range(max(0.0, _outer(high, flint.arb.acos)[0]), _outer(low, flint.arb.acos)[1])


def _outwards(low: float, high: float) -> Range:
    """The interval one float wider at either end; an end that is no number is none.

    A low end of +0 stays: a sum that is 0 is so exactly, and a product underflows to +0 from above. So a cosine that
    ends at 0 stays on its side of the pole.
    """
    if low != low or high != high:
        return Range(-math.inf if low != low else low, math.inf if high != high else high)
    return Range(low if low == 0 and math.copysign(1, low) > 0 else down(low), up(high))


def _product(x: float, y: float) -> float:
    """The product of two ends; 0 times infinity is 0, for the infinite end is never reached."""
    return 0.0 if x == 0 or y == 0 else x * y


def _outer(x: float, function: Callable[[Any], Any]) -> tuple[float, float]:
    """Floats around the function at a point, infinite ones included."""
    value = function(flint.arb(x))
    if value.is_nan():
        return -math.inf, math.inf
    return down(float(value.lower())), up(float(value.upper()))


def _power(x: float, y: float) -> tuple[float, float]:
    if x == 0:
        return (0.0, 0.0) if y > 0 else (0.0, math.inf)
    if math.isinf(y):
        return (0.0, math.inf)
    low, high = _outer(x, lambda base: base ** flint.arb(y))
    return max(0.0, low), high
