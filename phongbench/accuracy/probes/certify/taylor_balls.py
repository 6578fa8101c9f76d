"""Taylor series with ball coefficients (python-flint's arb_series): numbers of `sets`, sharp where a body is smooth."""

import math
from typing import Any

import flint

from phongbench.accuracy.probes.certify.sets import Number, TooWideError, down, up

#: length of the Taylor series: the last coefficient bounds the rest
ORDER = 6


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
        return down(float(ball.lower())), up(float(ball.upper()))

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
    return up(value) if value == value else math.inf
