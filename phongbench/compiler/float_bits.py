"""Floats by their bits: exponent and mantissa of a positive normal number, taken apart and put together.

Each is a primitive of the kernel language: the plain body is the definition, the compiled one a few whole-number
operations on vectors of bits. Written once for float32 and once for float64, whose types are spelled out.
"""

import math
from typing import Any, cast

import numpy as np

from phongbench.compiler import intrinsics
from phongbench.compiler.lowering import native, primitive

_HALF_ROOT_BITS_32 = np.float32(np.sqrt(0.5)).view(np.int32)
_HALF_ROOT_BITS_64 = np.float64(np.sqrt(0.5)).view(np.int64)
_EXPONENT_32, _EXPONENT_64 = np.int32(-1 << 23), np.int64(-1 << 52)
_SHIFT_32, _SHIFT_64 = np.int32(23), np.int64(52)
#: adding and subtracting this rounds to the nearest whole number, and its low bits are that number
_MAGIC_32, _MAGIC_64 = np.float32(1.5 * 2**23), np.float64(1.5 * 2**52)
#: the bits of 1.0, and the factor that makes a whole mantissa a fraction
_ONE_BITS_32, _ONE_BITS_64 = np.float32(1).view(np.int32), np.float64(1).view(np.int64)
_STEP_32, _STEP_64 = np.float32(2.0**-23), np.float64(2.0**-52)


@native(np.float32)
def _exponent_32(x: Any) -> Any:
    # numba widens int32 sums to int64: narrowed at once, the shift and the conversion stay in 32-bit lanes
    return np.float32(np.int32(intrinsics.float32_bits(x) - _HALF_ROOT_BITS_32) >> _SHIFT_32)


@native(np.float64)
def _exponent_64(x: Any) -> Any:
    return np.float64((intrinsics.float64_bits(x) - _HALF_ROOT_BITS_64) >> _SHIFT_64)


# The mantissa is what is left of the bits when the exponent's are taken away: a sum that the exponent needs too.


@native(np.float32)
def _mantissa_32(x: Any) -> Any:
    exponent = np.int32(intrinsics.float32_bits(x) - _HALF_ROOT_BITS_32) & _EXPONENT_32
    return intrinsics.float32_from_bits(np.int32(intrinsics.float32_bits(x) - exponent))


@native(np.float64)
def _mantissa_64(x: Any) -> Any:
    exponent = (intrinsics.float64_bits(x) - _HALF_ROOT_BITS_64) & _EXPONENT_64
    return intrinsics.float64_from_bits(intrinsics.float64_bits(x) - exponent)


@native(np.float32)
def _shifted_32(t: Any) -> Any:
    return np.float32(t + _MAGIC_32)


@native(np.float64)
def _shifted_64(t: Any) -> Any:
    return t + _MAGIC_64


@native(np.float32)
def _unshifted_32(s: Any) -> Any:
    return np.float32(s - _MAGIC_32)


@native(np.float64)
def _unshifted_64(s: Any) -> Any:
    return s - _MAGIC_64


@native(np.float32)
def _scaled_32(x: Any, s: Any) -> Any:
    raised = np.int32(intrinsics.float32_bits(s) << _SHIFT_32)
    return intrinsics.float32_from_bits(np.int32(intrinsics.float32_bits(x) + raised))


@native(np.float64)
def _scaled_64(x: Any, s: Any) -> Any:
    return intrinsics.float64_from_bits(intrinsics.float64_bits(x) + (intrinsics.float64_bits(s) << _SHIFT_64))


@native(np.float32)
def linear_log2_32(x: Any) -> Any:
    """`powers.linear_log2` in float32: the bits of x as a number, less those of 1."""
    return np.float32(intrinsics.float32_bits(x) - _ONE_BITS_32) * _STEP_32


@native(np.float64)
def linear_log2_64(x: Any) -> Any:
    """The same in float64."""
    return np.float64(intrinsics.float64_bits(x) - _ONE_BITS_64) * _STEP_64


@native(np.float32)
def _from_linear_32(t: Any) -> Any:
    return intrinsics.float32_from_bits(np.int32(np.int32(t / _STEP_32) + _ONE_BITS_32))


@native(np.float64)
def _from_linear_64(t: Any) -> Any:
    return intrinsics.float64_from_bits(np.int64(t / _STEP_64) + _ONE_BITS_64)


@primitive(float32=_exponent_32, float64=_exponent_64)
def binary_exponent(x: float) -> float:
    """The whole number e with x = m 2^e and m in [sqrt(1/2), sqrt 2); x must be positive and normal."""
    return float(np.floor(np.log2(x) + 0.5))


@primitive(float32=_mantissa_32, float64=_mantissa_64)
def binary_mantissa(x: float) -> float:
    """The m of `binary_exponent`."""
    return cast(float, x / 2.0 ** binary_exponent(x))


@primitive(float32=_shifted_32, float64=_shifted_64)
def shifted(t: float) -> float:
    """t plus a number so large that the sum is rounded to a whole number, held in the sum's lowest bits."""
    return float(np.rint(t))


@primitive(float32=_unshifted_32, float64=_unshifted_64)
def unshifted(s: float) -> float:
    """The whole number in `shifted(t)`: the one nearest to t; |t| below 2^22 in float32 and 2^51 in float64."""
    return s


@primitive(float32=_scaled_32, float64=_scaled_64)
def scaled(x: float, s: float) -> float:
    """x * 2^k for s = shifted(k): k is added to the exponent's bits, so x and the result must be normal.

    One shift and one addition of whole numbers; making 2^k first and multiplying took five operations.
    """
    return cast(float, x * 2.0**s)


@primitive(float32=_from_linear_32, float64=_from_linear_64)
def from_linear(t: float) -> float:
    """The number whose `linear_log2` is t; its power of two must be normal."""
    given: Any = t
    exact = float(given) if isinstance(given, np.floating) else given
    k = math.floor(exact)
    return type(t)(2.0**k * (1.0 + (exact - k)))
