"""Numbers that are sets: a plain scalar body run on them gives bounds that hold for every number in the set.

Two kinds, because each is sharp where the other is not:

- `balls.Jet`     a Taylor series whose coefficients are balls: sharp where the body is smooth;
- `ranges.Range`  an interval whose ends may be infinite: holds across poles, roots and the ends of the domain.

A comparison that a set leaves open is answered both ways, one after the other: `every_path` runs the body once for each
combination of answers. Each run then bounds the body wherever these answers are the true ones, so the worst of the runs
bounds it everywhere. The same goes for the whole number that `int` makes of a set.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, ClassVar, Union

#: combinations of answers that are followed before a set counts as too wide
PATHS = 16
#: whole numbers that one set may stand for
WHOLE = 4


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


class Number:
    """What both kinds share: comparisons ask the path of the run that is under way.

    No abstract class of Python's: whether something is one of those takes ten times as long to ask.

    ends     of each kind: floats at or beyond the ends of the set
    __neg__  of each kind: the set of the negative numbers
    """

    path: ClassVar[Path] = Path()
    ends: Callable[[], tuple[float, float]]
    __neg__: Callable[[], Any]

    def narrow(self, low: float, high: float) -> None:
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
        number = self._whole(math.trunc)
        self.narrow(number - (number <= 0), number + (number >= 0))
        return number

    def __floor__(self) -> int:
        number = self._whole(math.floor)
        self.narrow(number, number + 1)
        return number

    def _whole(self, rounded: Callable[[float], int]) -> int:
        """The whole number that is made of the set; which, is asked."""
        low, high = self.ends()
        if not high - low < WHOLE:
            raise TooWideError
        return Number.path.answer(range(rounded(low), rounded(high) + 1))

    def __abs__(self) -> Any:
        return self if self._above(0.0) else self.__neg__()

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


def down(x: float) -> float:
    """The float below."""
    return math.nextafter(x, -math.inf)


def up(x: float) -> float:
    """The float above."""
    return math.nextafter(x, math.inf)
