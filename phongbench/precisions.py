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

from phongbench import jit
from phongbench.errors import InputError, UnknownNameError

Array = NDArray[Any]

#: whole and fraction bits of a fixed-point name: whole 0..MAX_WHOLE, fraction at least 1, both together 2..MAX_FIXED
MAX_WHOLE, MAX_FIXED = 7, 24
#: formats of up to so many bits beside the sign are listed number by number
MAX_LISTED = 16


@dataclass(frozen=True, slots=True)
class Precision:
    """A working precision of the processor, or float16.

    name     str          what plans and tables call it
    dtype    numpy dtype  the type whose values are representable; the carrier where NumPy has none
    carrier  numpy dtype  the type that holds them in compiled loops: float16 values travel as float32
    """

    name: str
    dtype: np.dtype[Any]
    carrier: np.dtype[Any]

    @property
    def rounds(self) -> bool:
        """True if every operation must be rounded by hand: the precision is emulated, and its time says nothing."""
        return self.dtype != self.carrier

    @property
    def saturates(self) -> bool:
        """True for fixed point: there is no infinity and no NaN."""
        return False

    @property
    def rounding(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """How compiled code rounds a carrier to this precision: a function, and what it takes after the carrier."""
        return jit.round_to_half, ()

    @property
    def product(self) -> Callable[[Any, Any], Any] | None:
        """A rounded product for compiled code where rounding the carrier's product is not enough; None elsewhere."""
        return jit.half_product

    @property
    def eps(self) -> float:
        """The step from 1 to the next larger number."""
        return float(np.finfo(self.dtype).eps)

    @property
    def largest(self) -> float:
        """The largest finite number."""
        return float(np.finfo(self.dtype).max)

    @property
    def tiny(self) -> float:
        """The smallest positive number with all its digits; smaller ones are subnormal."""
        return float(np.finfo(self.dtype).tiny)

    @property
    def smallest(self) -> float:
        """The smallest positive number."""
        return float(np.finfo(self.dtype).smallest_subnormal)

    def rounded(self, values: ArrayLike) -> Array:
        """The nearest number of this precision to each value, ties to even, held by the carrier."""
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            return np.asarray(values).astype(self.dtype).astype(self.carrier)

    def constant(self, value: float) -> Any:
        """A literal or a coefficient as this precision holds it, in the carrier: the nearest number."""
        return self.carrier.type(self.rounded(value))

    @property
    def listed(self) -> bool:
        """True if `representables` lists its numbers."""
        return self.dtype == np.float16

    def representables(self, low: float, high: float) -> Array:
        """All numbers of this precision from low to high, ascending, in the carrier; one zero, without a sign.

        Raises InputError where there are too many to be listed: more than 16 bits beside the sign.
        """
        if not self.listed:
            raise _too_many(self.name)
        return _within(np.arange(1 << 16, dtype=np.uint16).view(np.float16).astype(self.carrier), low, high)


@dataclass(frozen=True, slots=True)
class BrainFloat(Precision):
    """bfloat16: the exponent of float32 and 8 digits."""

    @property
    def rounds(self) -> bool:
        """True: emulated."""
        return True

    @property
    def rounding(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Sixteen bits less, to the nearest, ties to even."""
        return jit.round_to_bfloat16, ()

    @property
    def product(self) -> None:
        """The carrier's product is exact, and its rounding is made of integer operations, which nothing fuses."""
        return None

    @property
    def eps(self) -> float:
        """2^-7."""
        return 2.0**-7

    @property
    def largest(self) -> float:
        """About 3.39e38."""
        return (2 - 2.0**-7) * 2.0**127

    @property
    def tiny(self) -> float:
        """2^-126."""
        return 2.0**-126

    @property
    def smallest(self) -> float:
        """2^-133."""
        return 2.0**-133

    def rounded(self, values: ArrayLike) -> Array:
        """The nearest bfloat16 to each value, ties to even, overflow to infinity; from float64 in one step."""
        given = np.asarray(values, np.float64)
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            step = np.maximum(np.frexp(given)[1], -125) - 8  # the exponent of the last of eight digits
            near = np.ldexp(np.rint(np.ldexp(given, -step)), step)
            near = np.where(np.isfinite(given), near, given)
            return np.asarray(np.where(np.abs(near) > self.largest, np.copysign(np.inf, near), near), self.carrier)

    @property
    def listed(self) -> bool:
        """True."""
        return True

    def representables(self, low: float, high: float) -> Array:
        """All bfloat16 numbers from low to high, ascending, in float32; one zero."""
        bits = np.arange(1 << 16, dtype=np.uint32) << 16
        return _within(bits.view(np.float32), low, high)


@dataclass(frozen=True, slots=True)
class FixedPoint(Precision):
    """Multiples of 2^-fraction from -2^whole to 2^whole - 2^-fraction: `whole` and `fraction` bits beside a sign.

    Results of operations are rounded to the nearest multiple, ties to even, and saturate at the ends of the range. What
    comes from outside saturates too; NaN becomes 0, since there is none, and 0/0 likewise.

    Coefficients (alpha, beta, literals) are no results: fixed-point hardware keeps them as a mantissa with a shift of
    its own. So they have whole + fraction significant bits at any size: a slope of 6.25 lives in q1.15, and 1 in q0.8.
    So do their negatives; hence a negation is never limited, and the lowest number's is one step beyond the range.
    """

    whole: int = 1
    fraction: int = 15

    @property
    def rounds(self) -> bool:
        """True: emulated."""
        return True

    @property
    def saturates(self) -> bool:
        """True."""
        return True

    @property
    def rounding(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """To the nearest step within the range; see `jit.round_to_fixed`."""
        ends = (np.float64(1.5 * 2.0 ** (52 - self.fraction)), np.float64(self.lowest), np.float64(self.largest))
        return jit.round_to_fixed, ends

    @property
    def product(self) -> None:
        """The carrier's product is exact."""
        return None

    @property
    def eps(self) -> float:
        """The step, everywhere."""
        return 2.0**-self.fraction

    @property
    def lowest(self) -> float:
        """The most negative number."""
        return -(2.0**self.whole)

    @property
    def largest(self) -> float:
        """One step below 2^whole."""
        return 2.0**self.whole - self.eps

    @property
    def tiny(self) -> float:
        """The step: there are no subnormal numbers."""
        return self.eps

    @property
    def smallest(self) -> float:
        """The step."""
        return self.eps

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

    @property
    def listed(self) -> bool:
        """True for up to 16 bits beside the sign."""
        return self.whole + self.fraction <= MAX_LISTED

    def representables(self, low: float, high: float) -> Array:
        """All numbers of the format from low to high, ascending; InputError beyond 16 bits beside the sign."""
        if not self.listed:
            raise _too_many(self.name)
        count = 1 << (self.whole + self.fraction)
        return _within(np.arange(-count, count) * self.eps, low, high)


def _within(numbers: Array, low: float, high: float) -> Array:
    return np.unique(numbers[(numbers >= low) & (numbers <= high)] + numbers.dtype.type(0))


def _too_many(name: str) -> InputError:
    return InputError(
        f"{name} has too many numbers to list", None, f"only formats of up to {MAX_LISTED} bits are listed"
    )


_HALF, _SINGLE, _DOUBLE = np.dtype(np.float16), np.dtype(np.float32), np.dtype(np.float64)
FLOAT16 = Precision("float16", _HALF, _SINGLE)
BFLOAT16 = BrainFloat("bfloat16", _SINGLE, _SINGLE)
FLOAT32 = Precision("float32", _SINGLE, _SINGLE)
FLOAT64 = Precision("float64", _DOUBLE, _DOUBLE)
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
            f"the fixed-point precision {name!r} is out of range", None,
            f"give {FIXED_NAMES}: I whole and F fraction bits beside the sign",
        )  # fmt: skip
    return FixedPoint(f"q{whole}.{fraction}", _DOUBLE, _DOUBLE, whole, fraction)


def in_order(names: Iterable[str]) -> tuple[str, ...]:
    """Distinct names of precisions in the order in which they are shown: fixed point by width, then PRECISIONS."""
    chosen = {precision_named(name) for name in names}
    fixed = sorted(
        (p for p in chosen if isinstance(p, FixedPoint)), key=lambda p: (p.whole + p.fraction, p.fraction, p.name)
    )
    return tuple(p.name for p in (*fixed, *(p for p in PRECISIONS.values() if p in chosen)))
