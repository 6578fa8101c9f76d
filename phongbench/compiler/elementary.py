"""Powers as a shading unit computes them: squarings, and an exact power from vectorisable log2 and exp2.

The plain bodies are the definitions (they run on floats and on mpmath numbers). Compiled float32 and float64 code uses
the fast implementations further down, which the tests hold against those definitions: absolute error of `power` at most
1e-6 in float32 and 1e-13 in float64 for every exponent up to 1e5. libm's pow is not used: it is a call per element and
defeats the vectoriser.
"""

import math
from typing import Any, cast

import numpy as np

from phongbench.compiler.float_bits import (
    binary_exponent,
    binary_mantissa,
    from_linear,
    linear_log2_32,
    linear_log2_64,
    scaled,
    shifted,
    unshifted,
)
from phongbench.compiler.lowering import Table, native, primitive
from phongbench.compiler.polynomials import ARC_32, ARC_64, ARTANH2, EXP2, EXP2_SERIES, LOG2_RATIO


def positive_part(x: float) -> float:
    """max(0, x); NaN gives 0, as max(0, NaN) does on GPUs."""
    return x if x > 0.0 else 0.0


def clamped(x: float, low: float, high: float) -> float:
    """x limited to [low, high]; NaN gives low."""
    return (x if x < high else high) if x > low else low


def above_underflow(x: float, exponent: int) -> float:
    """x where x ** exponent is above 2^-120, else 0; so for a negative x and NaN.

    Chains of products otherwise run through subnormal numbers, which cost about a hundred cycles each on common CPUs.
    float32 results change by less than 1e-36.
    """
    return x if x > 2.0 ** (-120.0 / exponent) else 0.0


def where_above(value: float, x: float, least: float) -> float:
    """The value where x is above the least, else 0, for NaN too: what is too small to see, and slow, is left out."""
    return value if x > least else 0.0


def squared(x: float, n: int) -> float:
    """max(0, x) ** (2 ** n) by n squarings; 0 for NaN.

    Where the result would fall below 2^-120 it is exactly 0: long chains of squarings otherwise run through subnormal
    numbers, which cost about a hundred cycles each on common CPUs. float32 results change by less than 1e-36. The test
    comes after the first squaring, into which compilers fold it as a mask.
    """
    first = x if n == 0 else x * x
    result = first if x > 2.0 ** (-120.0 / 2.0**n) else 0.0
    for _ in range(n - 1):
        result = result * result
    return result


def whole_power(x: float, exponent: int) -> float:
    """x ** exponent for a whole exponent >= 1: a squaring for every bit, a product for every set bit, but the first."""
    result = x
    for bit in range(exponent.bit_length() - 2, -1, -1):
        result = result * result
        if exponent >> bit & 1:
            result = result * x
    return result


def interpolated(table: Table, position: float) -> float:
    """Straight lines between the entries of a table; a position outside takes the nearest end, NaN the first entry."""
    last = len(table) - 1
    inside = clamped(position, 0.0, float(last))
    i = int(inside)
    i = i if i < last else last - 1
    value: float = table[i] + (inside - float(i)) * (table[i + 1] - table[i])
    return value


# The fast implementations, written once for float32 and float64; only the polynomials' degrees differ


def _log2_32(x: float) -> float:
    f = binary_mantissa(x) - 1.0
    ratio = LOG2_RATIO[7]
    for k in range(6, -1, -1):
        ratio = ratio * f + LOG2_RATIO[k]
    return binary_exponent(x) + f * ratio


def _log2_64(x: float) -> float:
    f = binary_mantissa(x) - 1.0
    s = f / (f + 2.0)
    z = s * s
    ratio = ARTANH2[10]
    for k in range(9, -1, -1):
        ratio = ratio * z + ARTANH2[k]
    return binary_exponent(x) + s * ratio


# Far below the limit these compute nonsense, which the last line replaces; that costs less than clamping does. At the
# upper limit the exponent's bits become those of infinity.


def _exp2_32(t: float) -> float:
    inside = 128.0 if t > 128.0 else t
    k = shifted(inside)
    r = inside - unshifted(k)
    value = EXP2[5]
    for i in range(4, -1, -1):
        value = value * r + EXP2[i]
    return scaled(value, k) if t >= -126.0 else 0.0


def _exp2_64(t: float) -> float:
    inside = 1024.0 if t > 1024.0 else t
    k = shifted(inside)
    r = inside - unshifted(k)
    value = EXP2_SERIES[13]
    for i in range(12, -1, -1):
        value = value * r + EXP2_SERIES[i]
    return scaled(value, k) if t >= -1022.0 else 0.0


def _linear_exp2_32(t: float) -> float:
    value = from_linear(clamped(t, -126.0, 127.0))
    return 0.0 if t < -126.0 else value


def _linear_exp2_64(t: float) -> float:
    value = from_linear(clamped(t, -1022.0, 1023.0))
    return 0.0 if t < -1022.0 else value


def _arc_cosine_32(x: float) -> float:
    inside = clamped(x, -1.0, 1.0)
    size = abs(inside)
    t = 1.0 - 2.0 * size
    ratio = ARC_32[8]
    for k in range(7, -1, -1):
        ratio = ratio * t + ARC_32[k]
    arc = square_root(1.0 - size) * ratio
    return arc if inside > 0.0 else PI - arc


def _arc_cosine_64(x: float) -> float:
    inside = clamped(x, -1.0, 1.0)
    size = abs(inside)
    t = 1.0 - 2.0 * size
    ratio = ARC_64[18]
    for k in range(17, -1, -1):
        ratio = ratio * t + ARC_64[k]
    arc = square_root(1.0 - size) * ratio
    return arc if inside > 0.0 else PI - arc


def _exp(x: float) -> float:
    return exp2(x * LOG2_E)


def _power_32(x: float, y: float) -> float:
    return _exp2_32(y * _log2_32(x)) if x > 1.2e-38 else 0.0


def _power_64(x: float, y: float) -> float:
    return _exp2_64(y * _log2_64(x)) if x > 2.3e-308 else 0.0


@native(np.float32)
def _root_32(x: Any) -> Any:
    return np.sqrt(x)


@native(np.float64)
def _root_64(x: Any) -> Any:
    return np.sqrt(x)


def _library(x: Any) -> Any:
    """Where the standard functions of x are: NumPy for floats, else the number's own mpmath context."""
    return np if isinstance(x, float | np.floating | np.ndarray) else x.context


LOG2_E = float(1 / np.log(2))
#: the float64 implementations by themselves, for compiled code that is float64 whatever the working precision
EXP2_64, POWER_64 = _exp2_64, _power_64
PI = math.pi


@primitive(float32=_exp2_32, float64=_exp2_64)
def exp2(t: float) -> float:
    """2^t; 0 where the result would be subnormal, and for NaN."""
    return cast(float, 2.0**t)


@primitive(float32=_exp, float64=_exp)
def exponential(x: float) -> float:
    """e^x."""
    return cast(float, _library(x).exp(x))


@primitive(float32=_power_32, float64=_power_64)
def power(x: float, y: float) -> float:
    """x^y for x > 0; 0 for every other x, NaN and 0^0 included: beyond the horizon there is no highlight."""
    return cast(float, x**y) if x > 0.0 else 0.0


@primitive(float32=linear_log2_32, float64=linear_log2_64)
def linear_log2(x: float) -> float:
    """log2 by straight lines between powers of two: exponent and mantissa bits of a positive x, read as one number."""
    mantissa, exponent = _library(x).frexp(x)
    return type(x)(exponent - 1 + (2 * mantissa - 1))


@primitive(float32=_linear_exp2_32, float64=_linear_exp2_64)
def linear_exp2(t: float) -> float:
    """2^t by straight lines between whole t: the inverse of `linear_log2`; 0 where the result would be subnormal."""
    return from_linear(t)


@primitive(float32=_root_32, float64=_root_64)
def square_root(x: float) -> float:
    """The square root of x >= 0."""
    return cast(float, _library(x).sqrt(x))


@primitive(float32=_arc_cosine_32, float64=_arc_cosine_64)
def arc_cosine(x: float) -> float:
    """The angle in [0, pi] whose cosine is x, which is limited to [-1, 1]; NaN gives pi.

    Error 3e-7 in float32, 5e-15 in float64.
    """
    return cast(float, _library(x).acos(type(x)(clamped(x, -1.0, 1.0))))
