"""Numbers that are sets: a plain scalar body run on them gives bounds that hold for every number in the set.

Two kinds, because each is sharp where the other is not:

- `Jet`   a Taylor series whose coefficients are balls (python-flint's arb_series): sharp where the body is smooth;
- `Range` an interval whose ends may be infinite: holds across poles, roots and the ends of the domain.

A comparison that a set leaves open is answered both ways, one after the other: `every_path` runs the body once for each
combination of answers. Each run then bounds the body wherever these answers are the true ones, so the worst of the runs
bounds it everywhere. The same goes for the whole number that `int` makes of a set.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from typing import Any, ClassVar, Union

import flint

#: combinations of answers that are followed before a set counts as too wide
PATHS = 16
#: whole numbers that one set may stand for
WHOLE = 4
#: length of the Taylor series: the last coefficient bounds the rest
ORDER = 6


class TooWideError(ArithmeticError):
    """The set leaves too much open: use smaller ones."""


class Path:
    """The answers of one run, in the order in which the body asks.

    script  answers that are given; beyond them the first possible one is taken
    taken   answers so far
    others  for each answer, those that were possible too
    """

    def __init__(self, script: Sequence[int] = ()) -> None:
        self.script = script
        self.taken: list[int] = []
        self.others: list[Sequence[int]] = []

    def answer(self, possible: Sequence[int]) -> int:
        """One of the possible answers."""
        position = len(self.taken)
        given = position < len(self.script)
        chosen = self.script[position] if given else possible[0]
        self.taken.append(chosen)
        self.others.append(() if given else possible[1:])
        return chosen


def every_path(body: Callable[[], Any]) -> Iterator[tuple[Any, list[int]]]:
    """Run the body once for each combination of answers: (what it gives, the answers). TooWideError beyond PATHS."""
    scripts: list[Sequence[int]] = [()]
    for _ in range(PATHS):
        path = Number.path = Path(scripts.pop())
        yield body(), path.taken
        for position in range(len(path.script), len(path.taken)):
            scripts += [(*path.taken[:position], other) for other in path.others[position]]
        if not scripts:
            return
    raise TooWideError


def along(path: Sequence[int], body: Callable[[], Any]) -> Any:
    """Run the body with these answers."""
    Number.path = Path(path)
    return body()


class Number(ABC):
    """What both kinds share: comparisons ask the path of the run that is under way."""

    path: ClassVar[Path] = Path()

    @abstractmethod
    def ends(self) -> tuple[float, float]:
        """Floats at or beyond the ends of the set."""

    def narrow(self, low: float, high: float) -> None:  # noqa: B027  may stay empty, as its docstring says
        """Forget what lies outside: the answer just taken excludes it. Whoever cannot, keeps more than is needed."""

    @property
    def context(self) -> "type[Number]":
        """Where `powers` finds the functions of this kind of number."""
        return type(self)

    def _above(self, other: "Operand") -> bool:
        (low, high), (under, over) = self.ends(), ends(other)
        possible = (1,) if low > over else (0,) if high <= under else (1, 0)
        answer = Number.path.answer(possible)
        self.narrow(*((under, math.inf) if answer else (-math.inf, over)))
        return bool(answer)

    def _below(self, other: "Operand") -> bool:
        (low, high), (under, over) = self.ends(), ends(other)
        possible = (1,) if high < under else (0,) if low >= over else (1, 0)
        answer = Number.path.answer(possible)
        self.narrow(*((-math.inf, over) if answer else (under, math.inf)))
        return bool(answer)

    __gt__ = __ge__ = _above
    __lt__ = __le__ = _below

    def __int__(self) -> int:
        low, high = self.ends()
        if not high - low < WHOLE:
            raise TooWideError
        number = Number.path.answer(range(math.floor(low), math.floor(high) + 1))
        self.narrow(number, number + 1)
        return number

    __floor__ = __int__

    def __abs__(self) -> Any:
        return self if self._above(0.0) else -self

    @abstractmethod
    def __neg__(self) -> Any: ...

    @classmethod
    def frexp(cls, x: Any) -> tuple[Any, int]:
        """(mantissa in [1/2, 1), exponent), as math.frexp."""
        low, high = x.ends()
        if low <= 0 or high > low * 2**WHOLE:
            raise TooWideError
        exponent = Number.path.answer(range(math.frexp(low)[1], math.frexp(high)[1] + 1))
        x.narrow(2.0 ** (exponent - 1), 2.0**exponent)
        return x * 2.0**-exponent, exponent


Operand = Union[Number, float, int]  # noqa: UP007  a class in quotes cannot be joined by |


def ends(value: Operand) -> tuple[float, float]:
    """Floats at or beyond the ends of a set, or of a number."""
    return value.ends() if isinstance(value, Number) else (value, value)


class Jet(Number):
    """A Taylor series with ball coefficients: of a function of d about a point, or about every point of a ball."""

    __array_ufunc__ = None  # NumPy's numbers leave operations with this one to it
    __slots__ = ("series",)

    def __init__(self, value: Any) -> None:
        self.series: Any = value.series if isinstance(value, Jet) else flint.arb_series([value], ORDER)

    @staticmethod
    def variable(centre: float, radius: float) -> "Jet":
        """d itself, at a point (radius 0) or anywhere within a ball."""
        return _jet(flint.arb_series([flint.arb(centre, radius), 1], ORDER))

    def ends(self) -> tuple[float, float]:
        """Ends of the ball of values."""
        ball = self.series[0]
        return _down(float(ball.lower())), _up(float(ball.upper()))

    def __add__(self, other: Any) -> "Jet":
        return _jet(self.series + _series(other))

    def __sub__(self, other: Any) -> "Jet":
        return _jet(self.series - _series(other))

    def __rsub__(self, other: Any) -> "Jet":
        return _jet(_series(other) - self.series)

    def __mul__(self, other: Any) -> "Jet":
        return _jet(self.series * _series(other))

    def __truediv__(self, other: Any) -> "Jet":
        return _jet(self.series / _divisor(other))

    def __rtruediv__(self, other: Any) -> "Jet":
        return _jet(_series(other) / _divisor(self))

    def __pow__(self, other: float) -> "Jet":
        return _jet(self.series**other)

    def __rpow__(self, other: float) -> "Jet":
        return _jet((self.series * flint.arb(other).log()).exp())

    def __neg__(self) -> "Jet":
        return _jet(-self.series)

    __radd__, __rmul__ = __add__, __mul__

    @staticmethod
    def exp(x: "Jet") -> "Jet":
        """e^x."""
        return _jet(x.series.exp())

    @staticmethod
    def sqrt(x: "Jet") -> "Jet":
        """The square root."""
        return _jet(x.series.sqrt())

    @staticmethod
    def acos(x: "Jet") -> "Jet":
        """The arc cosine."""
        return _jet(x.series.acos())


def _jet(series: Any) -> Jet:
    made = Jet.__new__(Jet)
    made.series = series
    return made


def _series(value: Any) -> Any:
    return value.series if isinstance(value, Jet) else float(value)


def _divisor(value: Any) -> Any:
    """The series of what is divided by. TooWideError where it may be 0."""
    series = _series(value)
    if isinstance(value, Jet) and series[0].contains(0):
        raise TooWideError
    return series


def size_within(centre: Any, anywhere: Any, radius: float) -> float:
    """The largest |value| within a radius, infinite if unknown.

    centre    the series about the middle; its coefficients but the last are used
    anywhere  the series about every point of the ball, along the same path: its last coefficient is the remainder's
    """
    if not isinstance(anywhere, Jet):
        return abs(float(anywhere))
    size = anywhere.series[ORDER - 1].abs_upper()
    for k in range(ORDER - 2, -1, -1):
        size = centre.series[k].abs_upper() + size * radius
    value = float(size.abs_upper())
    return _up(value) if value == value else math.inf


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


def _down(x: float) -> float:
    return math.nextafter(x, -math.inf)


def _up(x: float) -> float:
    return math.nextafter(x, math.inf)


def _outwards(low: float, high: float) -> Range:
    """The interval one float wider at either end; an end that is no number is none.

    A low end of +0 stays: a sum that is 0 is so exactly, and a product underflows to +0 from above. So a cosine that
    ends at 0 stays on its side of the pole.
    """
    if low != low or high != high:
        return Range(-math.inf if low != low else low, math.inf if high != high else high)
    return Range(low if low == 0 and math.copysign(1, low) > 0 else _down(low), _up(high))


def _product(x: float, y: float) -> float:
    """The product of two ends; 0 times infinity is 0, for the infinite end is never reached."""
    return 0.0 if x == 0 or y == 0 else x * y


def _outer(x: float, function: Callable[[Any], Any]) -> tuple[float, float]:
    """Floats around the function at a point, infinite ones included."""
    value = function(flint.arb(x))
    if value.is_nan():
        return -math.inf, math.inf
    return _down(float(value.lower())), _up(float(value.upper()))


def _power(x: float, y: float) -> tuple[float, float]:
    if x == 0:
        return (0.0, 0.0) if y > 0 else (0.0, math.inf)
    if math.isinf(y):
        return (0.0, math.inf)
    low, high = _outer(x, lambda base: base ** flint.arb(y))
    return max(0.0, low), high
