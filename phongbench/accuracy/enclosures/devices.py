"""What a device may return that keeps the accuracies which WGSL and Vulkan state, on arrays of intervals.

| operation          | float32                                | float16                               |
|--------------------|----------------------------------------|---------------------------------------|
| + - *              | correctly rounded, up or down; fused or not                                    |
| x / y              | 2.5 ULP for |y| in [2^-126, 2^126]     | 2.5 ULP for |y| in [2^-14, 2^14]      |
| inversesqrt        | 2 ULP                                                                          |
| sqrt(x)            | inherited from 1 / inversesqrt(x)                                              |
| exp2(x)            | (3 + 2 |x|) ULP                        | (1 + 2 |x|) ULP                       |
| log2(x)            | 2^-21 absolute in [0.5, 2], else 3 ULP | 2^-7 absolute in [0.5, 2], else 3 ULP |
| pow(x, y)          | inherited from exp2(y * log2(x))                                               |
| acos(x)            | inherited from atan2(sqrt(1 - x x), x), or 6.77e-5 absolute (3.91e-3)          |
| atan2              | 4096 ULP                               | 5 ULP                                 |
| dot, cross         | inherited from sums of products, in any order                                  |

Sources: W3C, WebGPU Shading Language, "Floating Point Accuracy"; Khronos, Vulkan specification, appendix "SPIR-V
Environment", "Precision of core SPIR-V instructions" and "of GLSL.std.450 instructions". Both leave the direction of
rounding open and let subnormal numbers be flushed to 0. Beyond their letter it is taken for granted that constants are
rounded to nearest when compiling, and that the power and the root of 0 are 0. What overflows, or is divided by less
than the smallest normal number, may be anything.
"""

from typing import Any

import numpy as np

from phongbench.accuracy.enclosures.ends import Ends, outwards
from phongbench.accuracy.enclosures.spans import Arithmetic, Span
from phongbench.compiler.precisions import FLOAT32, Precision

#: precisions that the standards speak of: ULP of exp2 at 0, log2's absolute error near 1, atan2's ULP, acos's error
_EXP2 = {"float32": 3.0, "float16": 1.0}
_LOG2 = {"float32": 2.0**-21, "float16": 2.0**-7}
_ATAN2 = {"float32": 4096.0, "float16": 5.0}
_ACOS = {"float32": 6.77e-5, "float16": 3.91e-3}
PRECISIONS = tuple(_EXP2)
#: the largest product of squares that recipes make of lengths from 0.001 to 1000; its inverse is the smallest
LARGEST_PRODUCT = 1e24
#: ULP of a quotient, a reciprocal root, and a logarithm far from 1
_QUOTIENT, _ROOT, _LOGARITHM = 2.5, 2.0, 3.0


class Device(Arithmetic):
    """Any conforming device: results are rounded up or down, and flushed or not.

    All that a device holds are numbers of its precision, so products are exact in float64, and ends need not be. Sums
    are exact but for what is left over, which says on which side of the float64 they are.
    """

    def __init__(self, precision: Precision, script: tuple[int, ...] = ()) -> None:
        super().__init__(precision, script)
        self.unit, self.flushed = precision.eps, precision.tiny

    def rounded(self, low: Ends, high: Ends) -> Span:
        """What rounding up or down makes of results in these intervals; anything where they overflow."""
        return self.product(*outwards(low, high))

    def sum(self, low: Ends, other_low: Any, high: Ends, other_high: Any) -> Span:
        """An end moves by a float64 where the sum lies beyond it."""
        with np.errstate(all="ignore"):
            bottom, below = _two_sum(low, other_low)
            top, above = _two_sum(high, other_high)
        bottom = np.where(below >= 0, bottom, np.nextafter(bottom, -np.inf))
        return self.product(bottom, np.where(above <= 0, top, np.nextafter(top, np.inf)))

    def product(self, low: Ends, high: Ends) -> Span:
        """Both neighbours; they enclose the unrounded product of a fused sum."""
        return self.within(self._neighbour(low, -np.inf), self._neighbour(high, np.inf))

    def within(self, low: Ends, high: Ends) -> Span:
        """A result in these intervals, or 0 where it may be subnormal; anything where it may overflow."""
        low = np.where((low > 0) & (low < self.flushed), 0.0, low)
        high = np.where((high < 0) & (high > -self.flushed), 0.0, high)
        wild = ~((low >= -self.precision.largest) & (high <= self.precision.largest))
        if np.any(wild):
            low, high = np.where(wild, -np.inf, low), np.where(wild, np.inf, high)
        return Span.of(low, high, self)

    def quotient(self, low: Ends, high: Ends, under: Any, over: Any) -> Span:
        """2.5 ULP where the divisor is neither subnormal nor beyond the inverse of that; else anything."""
        least = np.where((under <= 0) & (over >= 0), 0.0, np.minimum(np.abs(under), np.abs(over)))
        most = np.maximum(np.abs(under), np.abs(over))
        stated = (least >= self.flushed) & (most <= 1 / self.flushed)
        near = self.off_by(low, high, _QUOTIENT)
        return Span.of(np.where(stated, near.low, -np.inf), np.where(stated, near.high, np.inf), self)

    def off_by(self, low: Ends, high: Ends, units: Any) -> Span:
        """Results off by so many units in the last place.

        Away from 0 that is most at the end, or at the next power of two, where the units double.
        """
        low, high = outwards(low, high)
        return self._held(self._least(low, high, units), -self._least(-high, -low, units))

    def _least(self, low: Ends, high: Ends, units: Any) -> Ends:
        step = np.where(low > 0, np.ldexp(1.0, np.frexp(low)[1]), np.inf)
        at_step = np.where(step <= high, step * (1 - units * self.precision.eps), np.inf)
        return np.asarray(np.minimum(low - units * self.ulp(np.abs(low)), at_step), np.float64)

    def _held(self, low: Ends, high: Ends) -> Span:
        """A result in these intervals is a number that the precision holds."""
        inside = self._neighbour(low, np.inf), self._neighbour(high, -np.inf)
        some = inside[0] <= inside[1]
        return self.within(np.where(some, inside[0], low), np.where(some, inside[1], high))

    def _neighbour(self, values: Ends, towards: float) -> Ends:
        """The nearest numbers of the precision in this direction."""
        with np.errstate(over="ignore", under="ignore"):
            near = np.asarray(values, np.float64).astype(self.precision.dtype)
            short = near < values if towards > 0 else near > values
            near = np.where(short, np.nextafter(near, near.dtype.type(towards)), near)
        return near.astype(np.float64)

    def ulp(self, size: Ends) -> Ends:
        """The distance of numbers at this size, from 0 on; above it where it is a power of two."""
        held = np.clip(size, self.precision.tiny, self.precision.largest)
        return np.asarray(np.ldexp(self.precision.eps, np.frexp(held)[1] - 1), np.float64)

    @property
    def wide(self) -> "Device":
        """The same run in float32: bits are read and put together there."""
        other = type(self)(FLOAT32, self.script)
        other.taken = self.taken
        return other

    # functions

    def ends(self, x: Any) -> tuple[Any, Any]:
        """Both ends of a number or of intervals."""
        return (x.low, x.high) if isinstance(x, Span) else (np.asarray(self.constant(float(x))),) * 2

    def exp2(self, x: Any) -> Span:
        """2^x; 0 where x is minus infinity."""
        low, high = self.ends(x)
        size = np.maximum(np.abs(low), np.abs(high))
        with np.errstate(all="ignore"):
            return self.off_by(np.exp2(low), np.exp2(high), _EXP2[self.precision.name] + 2 * size)

    def log2(self, x: Any) -> Span:
        """The binary logarithm of what is positive; minus infinity where x may be 0."""
        low, high = self.ends(x)
        with np.errstate(all="ignore"):
            bottom, top = np.log2(np.maximum(low, 0.0)), np.log2(np.maximum(high, 0.0))
        near = (high >= 0.5) & (low <= 2.0)
        off = np.where(near, _LOG2[self.precision.name], 0.0)
        for end in (low, high):
            far = (end > 0) & ((end < 0.5) | (end > 2.0))
            size = np.abs(np.log2(np.where(far, end, 1.0)))
            off = np.maximum(off, np.where(far, _LOGARITHM * self.ulp(size), 0.0))
        return self._held(np.nextafter(bottom, -np.inf) - off, np.nextafter(top, np.inf) + off)

    def power(self, x: Any, y: float) -> Span:
        """x^y for y > 0; 0 where x is 0."""
        low, high = self.ends(x)
        least = self.precision.smallest
        lit = Span.of(np.maximum(low, least), np.maximum(high, least), self)
        value = self.exp2(self.log2(lit) * y)
        dark = np.zeros_like(value.low)
        bottom = np.where(low > 0, value.low, np.minimum(dark, value.low))
        return Span.of(bottom, np.where(high > 0, value.high, dark), self)

    def reciprocal_root(self, x: Any) -> Span:
        """1 / sqrt(x); infinite where x may be 0."""
        low, high = self.ends(x)
        with np.errstate(all="ignore"):
            return self.off_by(1 / np.sqrt(np.maximum(high, 0.0)), 1 / np.sqrt(np.maximum(low, 0.0)), _ROOT)

    def root(self, x: Any) -> Span:
        """1 / reciprocal_root(x); 0 where x is."""
        low, high = self.ends(x)
        least = self.flushed
        lit = Span.of(np.maximum(low, least), np.maximum(high, least), self)
        value = 1.0 / self.reciprocal_root(lit)
        return Span.of(np.where(low > least, value.low, 0.0), np.where(high > 0, value.high, 0.0), self)

    def arc_cosine(self, x: Any) -> Span:
        """By atan2(sqrt(1 - x x), x), or off by the absolute error that WGSL allows."""
        low, high = self.ends(x)
        span = Span.of(low, high, self)
        sine = self.root(1.0 - span * span)
        corners = [np.arctan2(s, c) for s in (sine.low, sine.high) for c in (low, high)]
        by_parts = self.off_by(np.minimum.reduce(corners), np.maximum.reduce(corners), _ATAN2[self.precision.name])
        off = _ACOS[self.precision.name]
        exact = np.arccos(np.clip(high, -1.0, 1.0)) - off, np.arccos(np.clip(low, -1.0, 1.0)) + off
        return self.within(np.minimum(by_parts.low, exact[0]), np.maximum(by_parts.high, exact[1]))

    def larger(self, x: Any, y: Any) -> Span:
        """The maximum."""
        (low, high), (least, most) = self.ends(x), self.ends(y)
        return Span.of(np.maximum(low, least), np.maximum(high, most), self._of(x, y))

    def smaller(self, x: Any, y: Any) -> Span:
        """The minimum."""
        (low, high), (least, most) = self.ends(x), self.ends(y)
        return Span.of(np.minimum(low, least), np.minimum(high, most), self._of(x, y))

    def clamped(self, x: Any, low: Any, high: Any) -> Span:
        """x limited to low..high."""
        return self.smaller(self.larger(x, low), high)

    def _of(self, *values: Any) -> Arithmetic:
        """Whose intervals there are among these."""
        return next((value.rule for value in values if isinstance(value, Span)), self)


class AnyLength(Device):
    """The same for vectors of any length, taken as 1: the squares of theirs are up to 10^24 times smaller or larger."""

    def __init__(self, precision: Precision, script: tuple[int, ...] = ()) -> None:
        super().__init__(precision, script)
        self.flushed = precision.tiny * LARGEST_PRODUCT


def _two_sum(x: Any, y: Any) -> tuple[Any, Any]:
    """The float64 sum and what is left over, exactly (Knuth)."""
    total = x + y
    part = total - x
    return total, (x - (total - part)) + (y - part)
