"""Arrays of intervals that follow the arithmetic of a working precision: what a kernel may give, whatever it is given.

A kernel's plain body runs on a `Span` instead of a number. Every operation encloses what a unit of the precision may
return, with each product rounded or fused into the sum after it. Rounding to nearest is monotone, so the ends are
rounded as numbers are. A comparison that holds for some intervals and not for others splits them: `enclosed` runs the
body once for each combination of answers, on the intervals where these answers are possible.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench.accuracy.enclosures.ends import Ends, Mask, outwards, product, quotients
from phongbench.compiler.precisions import Precision

#: how far the compiled power, exponential and 2^t may be off, by digits of the carrier: absolute up to 1, else relative
POWERS = {24: 1e-6, 53: 1e-13}
#: the same of the arc cosine, absolute
ARCS = {24: 3e-7, 53: 5e-15}
#: combinations of answers that are followed before a body counts as too branched
PATHS = 1200


class TooBranchedError(ArithmeticError):
    """The body asks too much of its numbers to be enclosed."""


class _Fork(Exception):  # noqa: N818  no error: the body is run again for each answer
    """Not all intervals give the same answer: each possible one with the intervals that may give it."""

    def __init__(self, answers: Sequence[tuple[int, Mask]]) -> None:
        super().__init__()
        self.answers = answers


class Arithmetic:
    """How a working precision rounds, and the answers of the run that is under way."""

    def __init__(self, precision: Precision, script: tuple[int, ...] = ()) -> None:
        self.precision, self.script = precision, script
        self.taken: list[int] = []
        self.digits = 24 if precision.carrier == np.float32 else 53
        #: an operation errs by at most this share of its result, and what is below the second may be flushed to 0
        self.unit, self.flushed = precision.eps / 2, 0.0

    def constant(self, value: float) -> float:
        """A literal or a coefficient as the precision holds it."""
        return float(self.precision.constant(value))

    def answer(self, possible: Sequence[tuple[int, Mask]]) -> int:
        """The answer of all intervals; _Fork where they differ and the script does not say which."""
        position = len(self.taken)
        if position < len(self.script):
            chosen = self.script[position]
        else:
            some = [(answer, mask) for answer, mask in possible if mask.any()]
            if len(some) > 1:
                raise _Fork(some)
            chosen = some[0][0]
        self.taken.append(chosen)
        return chosen

    def rounded(self, low: Ends, high: Ends) -> "Span":
        """What rounding makes of results in these intervals."""
        low, high = outwards(low, high)
        if self.digits == 53 and not self.precision.rounds:
            return Span.of(low, high, self)
        return Span.of(self._nearest(low), self._nearest(high), self)

    def sum(self, low: Ends, other_low: Any, high: Ends, other_high: Any) -> "Span":
        """What rounding makes of sums of numbers from these two intervals."""
        return self.rounded(low + other_low, high + other_high)

    def product(self, low: Ends, high: Ends) -> "Span":
        """What rounding makes of products, or a fused sum: both ends, rounded and not."""
        low, high = outwards(low, high)
        near = self.rounded(low, high)
        return Span.of(np.minimum(low, near.low), np.maximum(high, near.high), self)

    def quotient(self, low: Ends, high: Ends, under: Any, over: Any) -> "Span":
        """What rounding makes of quotients in these intervals, by divisors from under to over."""
        return self.rounded(low, high)

    def approximate(self, low: Ends, high: Ends, table: dict[int, float], *, relative: bool = False) -> "Span":
        """What a compiled function gives that is off by at most so much."""
        off = np.full_like(high, table[self.digits])
        with np.errstate(all="ignore"):
            if relative:
                off = off * np.maximum(high, 1.0) * (1 + np.log(np.maximum(high, 1.0)))
            span = Span.of(low - off, high + off, self)
        return self.rounded(span.low, span.high) if self.precision.rounds else span

    def _nearest(self, values: Ends) -> Ends:
        return np.asarray(self.precision.rounded(values), np.float64)


class Span:
    """Intervals [low, high], float64 (n,); ends may be infinite. Comparisons answer for all, or split them."""

    __array_ufunc__ = None
    __slots__ = ("high", "low", "rule")
    low: Ends
    high: Ends
    rule: Arithmetic

    def __new__(cls, value: Any) -> Any:
        """A number as it is: bodies convert what they have computed to the type of their argument."""
        return value

    @staticmethod
    def of(low: Ends, high: Ends, rule: Arithmetic) -> "Span":
        """These intervals; an end that is no number is none."""
        span: Span = object.__new__(Span)
        wrong = np.isnan(low) | np.isnan(high)
        if wrong.any():
            low, high = np.where(wrong, -np.inf, low), np.where(wrong, np.inf, high)
        span.low, span.high, span.rule = low, high, rule
        return span

    @property
    def context(self) -> "type[Span]":
        """Where `elementary` finds the functions of this kind of number."""
        return Span

    def _ends(self, other: Any) -> tuple[Any, Any]:
        if isinstance(other, Span):
            return other.low, other.high
        value = self.rule.constant(float(other))
        return value, value

    def __add__(self, other: Any) -> "Span":
        low, high = self._ends(other)
        return self.rule.sum(self.low, low, self.high, high)

    def __sub__(self, other: Any) -> "Span":
        low, high = self._ends(other)
        return self.rule.sum(self.low, -high, self.high, -low)

    def __rsub__(self, other: Any) -> "Span":
        low, high = self._ends(other)
        return self.rule.sum(low, -self.high, high, -self.low)

    def __mul__(self, other: Any) -> "Span":
        if other is self:
            square: Span = self._squared()
            return square
        low, high = self._ends(other)
        with np.errstate(invalid="ignore", over="ignore", under="ignore"):
            corners = [product(x, y) for x in (self.low, self.high) for y in (low, high)]
        least, most = np.minimum.reduce(corners), np.maximum.reduce(corners)
        return self.rule.product(least, most)

    def _squared(self) -> "Span":
        """Never negative, and its ends are the squares of its own ends."""
        with np.errstate(over="ignore", under="ignore"):
            first, last = self.low * self.low, self.high * self.high
        least = np.where((self.low <= 0) & (self.high >= 0), 0.0, np.minimum(first, last))
        return self.rule.product(least, np.maximum(first, last))

    def __truediv__(self, other: Any) -> "Span":
        low, high = self._ends(other)
        return self._divided(self.low, self.high, low, high)

    def __rtruediv__(self, other: Any) -> "Span":
        low, high = self._ends(other)
        return self._divided(low, high, self.low, self.high)

    def _divided(self, low: Any, high: Any, under: Any, over: Any) -> "Span":
        return self.rule.quotient(*quotients(low, high, under, over), under, over)

    def __pow__(self, other: float) -> "Span":
        """A power of a base that is not negative, as the compiled one computes it."""
        exponent = self.rule.constant(other)
        with np.errstate(all="ignore"):
            low, high = (np.maximum(end, 0.0) ** exponent for end in (self.low, self.high))
        return self.rule.approximate(np.minimum(low, high), np.maximum(low, high), POWERS, relative=True)

    def __rpow__(self, other: float) -> "Span":
        with np.errstate(all="ignore"):
            ends = float(other) ** self.low, float(other) ** self.high
        return self.rule.approximate(*ends, POWERS, relative=True)

    def __neg__(self) -> "Span":
        return Span.of(-self.high, -self.low, self.rule)

    def __abs__(self) -> "Span":
        low = np.maximum(0.0, np.maximum(self.low, -self.high))
        return Span.of(low, np.maximum(np.abs(self.low), np.abs(self.high)), self.rule)

    __radd__, __rmul__ = __add__, __mul__

    def _above(self, other: Any) -> bool:
        low, high = self._ends(other)
        answer = self.rule.answer(((1, self.high > low), (0, self.low <= high)))
        if answer:
            self.low = np.maximum(self.low, low)
        else:
            self.high = np.minimum(self.high, high)
        return bool(answer)

    def _below(self, other: Any) -> bool:
        low, high = self._ends(other)
        answer = self.rule.answer(((1, self.low < high), (0, self.high >= low)))
        if answer:
            self.high = np.minimum(self.high, high)
        else:
            self.low = np.maximum(self.low, low)
        return bool(answer)

    __gt__ = __ge__ = _above
    __lt__ = __le__ = _below

    def __int__(self) -> int:
        """The whole number towards 0; the intervals are cut to the numbers that have it."""
        number = self.whole(np.trunc(self.low), np.trunc(self.high))
        low, high = number - (number <= 0), number + (number >= 0)
        self.low, self.high = np.maximum(self.low, low), np.minimum(self.high, high)
        return number

    def __floor__(self) -> int:
        """The whole number below; only powers of two are made of it, and those below 2^-150 are as good as 0."""
        low, high = np.maximum(self.low, -150.0), np.maximum(self.high, -150.0)
        number = self.whole(np.floor(low), np.floor(high))
        self.low, self.high = np.maximum(low, number), np.minimum(high, number + 1)
        return number

    def whole(self, first: Ends, last: Ends) -> int:
        """One of the whole numbers from first to last; the intervals are cut to it by whoever asked."""
        least, most = float(first.min()), float(last.max())
        if not most - least < PATHS:
            raise TooBranchedError
        numbers = range(int(least), int(most) + 1)
        return self.rule.answer([(number, (first <= number) & (number <= last)) for number in numbers])

    @staticmethod
    def exp(x: "Span") -> "Span":
        """e^x."""
        with np.errstate(all="ignore"):
            return x.rule.approximate(np.exp(x.low), np.exp(x.high), POWERS, relative=True)

    @staticmethod
    def sqrt(x: "Span") -> "Span":
        """The square root; of 0 where x is negative."""
        return x.rule.rounded(np.sqrt(np.maximum(0.0, x.low)), np.sqrt(np.maximum(0.0, x.high)))

    @staticmethod
    def acos(x: Any) -> Any:
        """The arc cosine of what lies in [-1, 1]."""
        if not isinstance(x, Span):
            return math.acos(x)
        low, high = np.arccos(np.clip(x.high, -1.0, 1.0)), np.arccos(np.clip(x.low, -1.0, 1.0))
        return x.rule.approximate(low, high, ARCS)

    @staticmethod
    def frexp(x: "Span") -> tuple["Span", int]:
        """(mantissa in [1/2, 1], exponent), as math.frexp; of 2^-126 where x is not above it: dark in any power."""
        low, high = np.maximum(x.low, 2.0**-126), np.maximum(x.high, 2.0**-126)
        exponent = x.whole(*(np.frexp(end)[1].astype(np.float64) for end in (low, high)))
        scale = 2.0**-exponent
        low, high = np.clip(low * scale, 0.5, 1.0), np.clip(high * scale, 0.5, 1.0)
        return Span.of(low, high, x.rule), exponent


def enclosed(
    body: Callable[[Span], Any], low: Ends, high: Ends, precision: Precision, kind: type[Arithmetic] = Arithmetic
) -> tuple[Ends, Ends]:
    """What a body may give for arguments in each of these intervals, (n,) both ends; TooBranchedError if it asks much.

    body  a plain scalar body, of one number
    kind  whose arithmetic it runs in
    """
    least, most = np.full_like(low, np.inf), np.full_like(high, -np.inf)
    work: list[tuple[tuple[int, ...], NDArray[np.intp]]] = [((), np.arange(len(low)))]
    for _ in range(PATHS):
        script, here = work.pop()
        rule = kind(precision, script)
        try:
            value = body(Span.of(low[here], high[here], rule))
        except _Fork as fork:
            work += [((*rule.taken, answer), here[mask]) for answer, mask in fork.answers]
        else:
            ends = (value.low, value.high) if isinstance(value, Span) else (float(value), float(value))
            least[here], most[here] = np.minimum(least[here], ends[0]), np.maximum(most[here], ends[1])
        if not work:
            return least, most
    raise TooBranchedError
