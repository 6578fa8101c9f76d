"""Working precisions: which numbers a unit can hold, and how it rounds to them.

float32 and float64 are the processor's own. The others are emulated: every operation is computed in a wider carrier
type and rounded at once, which gives the same bits as a unit of that precision, because rounding twice is innocuous
where the carrier has at least twice the digits and two more. That holds for +, -, *, / and roots of

- float16 (11 digits) and bfloat16 (8) in float32 (24): also where results are subnormal;
- fixed point of up to 24 digits in float64 (53): sums and products are exact there, a quotient is at least
  2^-25 units from where rounding could tip.
"""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from phongbench.compiler import intrinsics
from phongbench.errors import InputError, UnknownNameError

Array = NDArray[Any]

#: whole and fraction bits of a fixed-point name: whole 0..MAX_WHOLE, fraction at least 1, both together 2..MAX_FIXED
MAX_WHOLE, MAX_FIXED = 7, 24
#: formats of up to so many bits beside the sign are listed number by number
MAX_LISTED = 16


#: how compiled code rounds a carrier to a precision: a function, and what it takes after the carrier
Rounding = tuple[Callable[..., Any], tuple[Any, ...]]


@dataclass(frozen=True, slots=True)
class Precision:
    """A working precision of the processor, or float16.

    name       str          what plans and tables call it
    dtype      numpy dtype  the type whose values are representable; the carrier where NumPy has none
    carrier    numpy dtype  the type that holds them in compiled loops: float16 values travel as float32
    eps        float        the step from 1 to the next larger number
    largest    float        the largest finite number
    tiny       float        the smallest positive number with all its digits; smaller ones are subnormal
    smallest   float        the smallest positive number
    rounding   how compiled code rounds every operation by hand; None for the processor's own
    product    a rounded product where rounding the carrier's product is not enough; None elsewhere
    saturates  bool         True for fixed point: there is no infinity and no NaN
    listed     bool         True if `representables` lists its numbers
    """

    name: str
    dtype: np.dtype[Any]
    carrier: np.dtype[Any]
    eps: float
    largest: float
    tiny: float
    smallest: float
    rounding: Rounding | None = None
    product: Callable[[Any, Any], Any] | None = None
    saturates: bool = False
    listed: bool = False

    @property
    def rounds(self) -> bool:
        """True if every operation must be rounded by hand: the precision is emulated, and its time says nothing."""
        return self.rounding is not None

    def rounded(self, values: ArrayLike) -> Array:
        """The nearest number of this precision to each value, ties to even, held by the carrier."""
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            return np.asarray(values).astype(self.dtype).astype(self.carrier)

    def constant(self, value: float) -> Any:
        """A literal or a coefficient as this precision holds it, in the carrier: the nearest number."""
        return self.carrier.type(self.rounded(value))

    def representables(self, low: float, high: float) -> Array:
        """All numbers of this precision from low to high, ascending, in the carrier; one zero, without a sign.

        Raises InputError where there are too many to be listed: more than 16 bits beside the sign.
        """
        if not self.listed:
            few = f"only formats of up to {MAX_LISTED} bits are listed"
            raise InputError(f"{self.name} has too many numbers to list", None, few)
        numbers = self._numbers()
        return np.unique(numbers[(numbers >= low) & (numbers <= high)] + numbers.dtype.type(0))

    def _numbers(self) -> Array:
        """Every number of a listed precision, in any order."""
        return np.arange(1 << 16, dtype=np.uint16).view(np.float16).astype(self.carrier)


@dataclass(frozen=True, slots=True)
class BrainFloat(Precision):
    """bfloat16: the exponent of float32 and 8 digits."""

    def rounded(self, values: ArrayLike) -> Array:
        """The nearest bfloat16 to each value, ties to even, overflow to infinity; from float64 in one step."""
        given = np.asarray(values, np.float64)
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            step = np.maximum(np.frexp(given)[1], -125) - 8  # the exponent of the last of eight digits
            near = np.ldexp(np.rint(np.ldexp(given, -step)), step)
            near = np.where(np.isfinite(given), near, given)
            return np.asarray(np.where(np.abs(near) > self.largest, np.copysign(np.inf, near), near), self.carrier)

    def _numbers(self) -> Array:
        return (np.arange(1 << 16, dtype=np.uint32) << 16).view(np.float32)


@dataclass(frozen=True, slots=True)
class FixedPoint(Precision):
    """Multiples of 2^-fraction from -2^whole to 2^whole - 2^-fraction: `whole` and `fraction` bits beside a sign.

    Results of operations are rounded to the nearest multiple, ties to even, and saturate at the ends of the range. What
    comes from outside saturates too; NaN becomes 0, since there is none, and 0/0 likewise.

    Coefficients (alpha, beta, literals) are no results: fixed-point hardware keeps them as a mantissa with a shift of
    its own. So they have whole + fraction significant bits at any size: a slope of 6.25 lives in q1.15, and 1 in q0.8.
    So do their negatives; hence a negation is never limited, and the lowest number's is one step beyond the range.

    The step is `eps` everywhere, `tiny` and `smallest`: there are no subnormal numbers.
    """

    whole: int = 1
    fraction: int = 15

    @property
    def lowest(self) -> float:
        """The most negative number."""
        return -(2.0**self.whole)

    def rounded(self, values: ArrayLike) -> Array:
        """The nearest number in range to each value, ties to even; 0 for NaN."""
        given = np.nan_to_num(np.asarray(values, np.float64), nan=0.0, posinf=np.inf, neginf=-np.inf)
        near = np.rint(np.clip(given, self.lowest, self.largest) / self.eps) * self.eps
        return np.asarray(near + 0.0, self.carrier)  # no negative zero

    def constant(self, value: float) -> Any:
        """A literal or a coefficient: whole + fraction significant bits, any exponent."""
        mantissa, exponent = np.frexp(np.float64(value))
        digits = self.whole + self.fraction
        return self.carrier.type(np.ldexp(np.rint(np.ldexp(mantissa, digits)), exponent - digits))

    def _numbers(self) -> Array:
        count = 1 << (self.whole + self.fraction)
        return np.arange(-count, count) * self.eps


def _of_numpy(name: str, carrier: np.dtype[Any] | None = None, **more: Any) -> Precision:
    """The precision of one of NumPy's own types."""
    dtype, info = np.dtype(name), np.finfo(name)
    eps, largest, tiny, smallest = map(float, (info.eps, info.max, info.tiny, info.smallest_subnormal))
    return Precision(name, dtype, carrier or dtype, eps, largest, tiny, smallest, **more)


def _fixed_point(whole: int, fraction: int) -> FixedPoint:
    step = 2.0**-fraction
    lowest, largest = -(2.0**whole), 2.0**whole - step
    shift = np.float64(1.5 * 2.0 ** (52 - fraction))
    return FixedPoint(
        f"q{whole}.{fraction}",
        _DOUBLE,
        _DOUBLE,
        step,
        largest,
        step,
        step,
        rounding=(intrinsics.round_to_fixed, (shift, np.float64(lowest), np.float64(largest))),
        saturates=True,
        listed=whole + fraction <= MAX_LISTED,
        whole=whole,
        fraction=fraction,
    )


_SINGLE, _DOUBLE = np.dtype(np.float32), np.dtype(np.float64)
# Only float16 has a product of its own (see half_product): bfloat16 is rounded by integer operations, which nothing
# fuses, and in the carrier of fixed point a product is exact.
FLOAT16 = _of_numpy(
    "float16", _SINGLE, rounding=(intrinsics.round_to_half, ()), product=intrinsics.half_product, listed=True
)
BFLOAT16 = BrainFloat(
    "bfloat16",
    _SINGLE,
    _SINGLE,
    2.0**-7,
    (2 - 2.0**-7) * 2.0**127,
    2.0**-126,
    2.0**-133,
    rounding=(intrinsics.round_to_bfloat16, ()),
    listed=True,
)
FLOAT32, FLOAT64 = _of_numpy("float32"), _of_numpy("float64")
#: the precisions that have a fixed name; fixed point is made by `precision_named`
PRECISIONS = {p.name: p for p in (FLOAT16, BFLOAT16, FLOAT32, FLOAT64)}
#: how fixed point is written in messages
FIXED_NAMES = f"qI.F with I = 0..{MAX_WHOLE} and I + F = 2..{MAX_FIXED}, e.g. q1.15"


@cache
def precision_named(name: str) -> Precision:
    """The precision of this name: one of PRECISIONS, or fixed point as qI.F.

    Raises UnknownNameError listing the known ones, InputError for a width of fixed point that is out of range.
    """
    if name in PRECISIONS:
        return PRECISIONS[name]
    parsed = re.fullmatch(r"q(\d{1,4})\.(\d{1,4})", name)
    if parsed is None:
        raise UnknownNameError("precision", name, (*PRECISIONS, FIXED_NAMES))
    whole, fraction = int(parsed[1]), int(parsed[2])
    if whole > MAX_WHOLE or fraction < 1 or not 2 <= whole + fraction <= MAX_FIXED:
        raise InputError(
            f"the fixed-point precision {name!r} is out of range",
            None,
            f"give {FIXED_NAMES}: I whole and F fraction bits beside the sign",
        )
    return _fixed_point(whole, fraction)


def in_order(names: Iterable[str]) -> tuple[str, ...]:
    """Distinct names of precisions in the order in which they are shown: fixed point by width, then PRECISIONS."""
    chosen = {precision_named(name) for name in names}
    fixed = sorted(
        (p for p in chosen if isinstance(p, FixedPoint)), key=lambda p: (p.whole + p.fraction, p.fraction, p.name)
    )
    return tuple(p.name for p in (*fixed, *(p for p in PRECISIONS.values() if p in chosen)))
