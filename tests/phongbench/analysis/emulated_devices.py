"""An emulated device that errs as much as WGSL and Vulkan allow, in a direction drawn for each operation.

Its arithmetic is written from the standards' tables, apart from the enclosures that it tests: numbers are arrays of
float64 that hold numbers of the precision.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
TYPES = {"float32": np.float32, "float16": np.float16}
#: float32, float16: ULP of exp2 at 0, absolute error of log2 near 1, ULP of atan2
STATED = {"float32": (3.0, 2.0**-21, 4096.0), "float16": (1.0, 2.0**-7, 5.0)}


class Machine:
    """One device; `direction` gives, for an array of results, which way each errs: up for positive numbers."""

    def __init__(self, precision: str, direction: Callable[[Floats], Floats]) -> None:
        self.name, self.type, self.direction = precision, TYPES[precision], direction
        self.tiny = float(np.finfo(self.type).tiny)
        self.exp2_units, self.log2_off, self.atan2_units = STATED[precision]

    def rounded(self, exact: Floats) -> Floats:
        """The neighbour above or below what is no number of the precision."""
        near = np.asarray(exact, np.float64).astype(self.type)
        up = np.where(near < exact, np.nextafter(near, self.type(np.inf)), near)
        down = np.where(near > exact, np.nextafter(near, self.type(-np.inf)), near)
        way = self.direction(exact)
        chosen = np.where(way > 0, up, down).astype(np.float64)
        return np.where((np.abs(chosen) < self.tiny) & (np.abs(way) > 0.5), 0.0, chosen)

    def off(self, exact: Floats, size: Any) -> Floats:
        """The number of the precision that is off by nearly so much."""
        wanted = exact + 0.999 * np.sign(self.direction(exact)) * size
        inwards = np.where(wanted > exact, -np.inf, np.inf)
        held = wanted.astype(self.type)
        beyond = np.abs(held.astype(np.float64) - exact) > np.abs(wanted - exact)
        return np.where(beyond, np.nextafter(held, inwards.astype(self.type)), held).astype(np.float64)

    def ulp(self, exact: Floats) -> Floats:
        """The distance of the two numbers around it; the smaller one at a power of two."""
        size = np.maximum(np.abs(exact), self.tiny)
        mantissa, exponent = np.frexp(size)
        return np.asarray(np.ldexp(float(np.finfo(self.type).eps), exponent - 1 - (mantissa == 0.5)), np.float64)

    def number(self, values: Any) -> "Number":
        """Values that the precision holds."""
        return Number(np.asarray(values, np.float64), self)

    def constant(self, value: Any) -> Floats:
        """Rounded to nearest."""
        return np.asarray(value, np.float64).astype(self.type).astype(np.float64)

    # functions of emitted code

    def inversesqrt(self, x: "Number") -> "Number":
        exact = 1 / np.sqrt(x.values)
        return self.number(self.off(exact, 2.0 * self.ulp(exact)))

    def divided(self, x: Floats, y: Floats) -> Floats:
        return self.off(x / y, 2.5 * self.ulp(x / y))

    def sqrt(self, x: "Number") -> "Number":
        lit = np.maximum(x.values, self.tiny)
        root = self.divided(np.ones_like(lit), self.inversesqrt(self.number(lit)).values)
        return self.number(np.where(x.values >= self.tiny, root, 0.0))

    def exp2(self, x: "Number") -> "Number":
        exact = np.exp2(x.values)
        return self.number(self.off(exact, (self.exp2_units + 2 * np.abs(x.values)) * self.ulp(exact)))

    def log2(self, x: "Number") -> "Number":
        exact = np.log2(x.values)
        near = (x.values >= 0.5) & (x.values <= 2.0)
        return self.number(self.off(exact, np.where(near, self.log2_off, 3 * self.ulp(exact))))

    def power(self, x: "Number", y: float) -> "Number":
        lit = self.number(np.maximum(x.values, self.tiny))
        return self.number(np.where(x.values >= self.tiny, self.exp2(self.log2(lit) * y).values, 0.0))

    def acos(self, x: "Number") -> "Number":
        exact = np.arctan2(self.sqrt(1.0 - x * x).values, x.values)
        return self.number(self.off(exact, self.atan2_units * self.ulp(exact)))

    def larger(self, x: Any, y: Any) -> "Number":
        return self._of(x, y).number(np.maximum(self._values(x), self._values(y)))

    def smaller(self, x: Any, y: Any) -> "Number":
        return self._of(x, y).number(np.minimum(self._values(x), self._values(y)))

    def chosen(self, condition: Callable[[], Any], yes: Callable[[], Any], no: Callable[[], Any]) -> Any:
        first, second, test = yes(), no(), condition()
        if not isinstance(first, Number) and not isinstance(second, Number):
            return np.where(test, first, second)  # whole numbers
        return self._of(first, second).number(np.where(test, self._values(first), self._values(second)))

    def _of(self, *values: Any) -> "Machine":
        return next((value.machine for value in values if isinstance(value, Number)), self)

    def _values(self, x: Any) -> Floats:
        return x.values if isinstance(x, Number) else self.constant(x)

    @property
    def wide(self) -> "Machine":
        return Machine("float32", self.direction)

    def words(self) -> dict[str, Any]:
        """The functions that emitted code calls."""

        def bits(x: Any) -> "Number":
            return self.wide.number(np.asarray(x).astype(np.int32).view(np.float32))

        return {
            "chosen": self.chosen,
            "dot": lambda a, b: a.dot(b),
            "cross": lambda a, b: a.cross(b),
            "inversesqrt": self.inversesqrt,
            "exp2": self.exp2,
            "pow": self.power,
            "acos": self.acos,
            "max": self.larger,
            "min": self.smaller,
            "clamp": lambda x, low, high: self.smaller(self.larger(x, low), high),
            "saturate": lambda x: self.smaller(self.larger(x, 0.0), 1.0),
            "to_int": lambda x: np.trunc(x.values).astype(np.int64),
            "to_float": lambda x: self.wide.number(self.wide.rounded(np.asarray(x, np.float64))),
            "float_bits": lambda x: x.values.astype(np.float32).view(np.int32).astype(np.int64),
            "bits_float": bits,
            "listed": lambda *entries: _Listed(self, entries),
        }


class Number:
    """Numbers of a machine, (n,), and its operations."""

    __array_ufunc__ = None

    def __init__(self, values: Floats, machine: Machine) -> None:
        self.values, self.machine = values, machine

    def _made(self, exact: Floats) -> "Number":
        return Number(self.machine.rounded(exact), self.machine)

    def _other(self, other: Any) -> Floats:
        return self.machine._values(other)

    def __add__(self, other: Any) -> "Number":
        return self._made(self.values + self._other(other))

    def __sub__(self, other: Any) -> "Number":
        return self._made(self.values - self._other(other))

    def __rsub__(self, other: Any) -> "Number":
        return self._made(self._other(other) - self.values)

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, Vector):
            return other * self
        return self._made(self.values * self._other(other))

    def __truediv__(self, other: Any) -> "Number":
        return Number(self.machine.divided(self.values, self._other(other)), self.machine)

    __radd__, __rmul__ = __add__, __mul__

    def __gt__(self, other: Any) -> Any:
        return self.values > self._other(other)

    def __lt__(self, other: Any) -> Any:
        return self.values < self._other(other)


class Vector:
    """Three numbers a row: sums of products in order, each rounded."""

    def __init__(self, x: Number, y: Number, z: Number) -> None:
        self.parts = x, y, z

    def __add__(self, other: "Vector") -> "Vector":
        return Vector(*(p + q for p, q in zip(self.parts, other.parts, strict=True)))

    def __sub__(self, other: "Vector") -> "Vector":
        return Vector(*(p - q for p, q in zip(self.parts, other.parts, strict=True)))

    def __mul__(self, scale: Number) -> "Vector":
        return Vector(*(p * scale for p in self.parts))

    def __rmul__(self, scale: float) -> "Vector":
        return Vector(*(p * scale for p in self.parts))

    def dot(self, other: "Vector") -> Number:
        first, second, third = (p * q for p, q in zip(self.parts, other.parts, strict=True))
        return first + second + third

    def cross(self, other: "Vector") -> "Vector":
        (ax, ay, az), (bx, by, bz) = self.parts, other.parts
        return Vector(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)

    def values(self) -> Floats:
        """(3, n)."""
        return np.stack([part.values for part in self.parts])


class _Listed:
    def __init__(self, machine: Machine, entries: tuple[float, ...]) -> None:
        self.machine, self.entries = machine, machine.constant(np.asarray(entries))

    def __getitem__(self, index: Any) -> Number:
        return self.machine.number(self.entries[index])
