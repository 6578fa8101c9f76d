"""Cheap reciprocal roots, as processors and games make them: a table of 12 bits, the bit trick, a short series."""

from collections.abc import Callable
from typing import Any, cast

import numpy as np

from phongbench.compiler import intrinsics, jit
from phongbench.compiler.lowering import native, primitive

#: the integer from which half a float's bits are subtracted; from a game of 1999 (LOMONT_2003)
MAGIC = 0x5F3759DF
_MAGIC_BITS, _ONE, _THREE_HALVES, _HALF = np.int32(MAGIC), np.int32(1), np.float32(1.5), np.float32(0.5)
_BIAS, _MANTISSA, _ONE_BITS = np.int32(127), np.int32(23), np.float32(1).view(np.int32)


def twelve_bit_root(q: float) -> float:
    """1/sqrt(q) for q in [1, 4) as a table of reciprocal roots gives it.

    The leading 11 bits of q's fraction choose an entry, made for the middle of its interval and rounded to 12 bits.
    Errors: 2^-13 for the interval and 2^-12 for the entry, 1.5 * 2^-12 in all, which is the bound that x86 gives for
    its RSQRTPS.
    """
    step = 2.0**-11 if q < 2.0 else 2.0**-10
    middle = (np.floor(q / step) + 0.5) * step
    return float(np.rint(4096.0 / np.sqrt(middle)) / 4096.0)


def bit_trick_root(q: Any, steps: int) -> Any:
    """1/sqrt(q) in float32: half the exponent by a shift of the bits, then Newton steps."""
    half = _HALF * q
    y = intrinsics.float32_from_bits(np.int32(_MAGIC_BITS - (intrinsics.float32_bits(q) >> _ONE)))
    for _ in range(steps):
        y = y * (_THREE_HALVES - half * y * y)
    return y


def short_series(q: float) -> float:
    """1/sqrt(q) near q = 1 by two terms, (3 - q)/2: too small by 3/8 of the square of q - 1. LYON_1993."""
    return (3.0 - q) / 2.0


_bits, _table = jit.inline(bit_trick_root), jit.inline(twelve_bit_root)


@native(np.float32)
def _one_step(q: Any) -> Any:
    return _bits(q, 1)


@native(np.float32)
def _from_table(q: Any) -> Any:
    # q = r 4^k with r in [1, 4): the table's entry for r, times 2^-k
    k = np.int32(np.int32((intrinsics.float32_bits(q) >> _MANTISSA) - _BIAS) >> _ONE)
    r = intrinsics.float32_from_bits(np.int32(intrinsics.float32_bits(q) - np.int32(np.int32(k << _ONE) << _MANTISSA)))
    power = intrinsics.float32_from_bits(np.int32(_ONE_BITS - np.int32(k << _MANTISSA)))
    return np.float32(_table(np.float64(r))) * power


@native(np.float64)
def _one_step_64(q: Any) -> Any:
    return np.float64(_bits(np.float32(q), 1))


@native(np.float64)
def _from_table_64(q: Any) -> Any:
    return np.float64(_from_table(np.float32(q)))


@primitive(float32=_one_step, float64=_one_step_64)
def bit_trick(x: float) -> float:
    """1/sqrt(x) by the bit trick with one Newton step, up to 1.8e-3 too small; of x as a positive normal float32."""
    return cast(float, _one_by_one(lambda q: float(bit_trick_root(np.float32(q), 1)), x))


@primitive(float32=_from_table, float64=_from_table_64)
def estimate(x: float) -> float:
    """1/sqrt(x) as a 12-bit estimate, within 1.5 * 2^-12; of x as a positive normal float32. See `twelve_bit_root`."""

    def of_number(q: float) -> float:
        k = int(np.floor(np.log2(q) / 2))
        return twelve_bit_root(q * 4.0**-k) * 2.0**-k

    return cast(float, _one_by_one(of_number, x))


@native(np.float32)
def _by_instruction(q: Any) -> Any:
    return intrinsics.root_estimate(q)


@primitive(float32=_by_instruction)
def instruction(x: float) -> float:
    """1/sqrt(x) by the processor's own estimate, in loops that allow it: what `estimate` stands for, to be timed."""
    return cast(float, _one_by_one(lambda q: float(q) ** -0.5, x))


def _one_by_one(root: Callable[[float], float], x: Any) -> Any:
    """The root of a number, or of each number of an array."""
    return np.array([root(q) for q in x.tolist()]) if isinstance(x, np.ndarray) else root(float(x))
