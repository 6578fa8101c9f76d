"""Powers as a shading unit computes them: squarings, and an exact power from vectorisable log2 and exp2.

The plain bodies are the definitions (they run on floats and on mpmath numbers). Compiled float32 and float64 code uses
the fast implementations further down, which the tests hold against those definitions: absolute error of `power` at most
1e-6 in float32 and 1e-13 in float64 for every exponent up to 1e5. libm's pow is not used: it is a call per element and
defeats the vectoriser.

No coefficient is typed in: the polynomials are interpolated at Chebyshev nodes when this module is imported.
"""

import math
from collections.abc import Callable
from typing import Any, cast

import numpy as np
from numpy.polynomial import chebyshev, polynomial

from phongbench import jit
from phongbench.lowering import Body, Table, primitive


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


def through_chebyshev_nodes(function: Callable[[Any], Any], low: float, high: float, degree: int) -> tuple[float, ...]:
    """Coefficients, lowest first, of the polynomial through `function` at the Chebyshev nodes of [low, high]."""
    middle, half = (low + high) / 2, (high - low) / 2
    fitted = chebyshev.cheb2poly(chebyshev.chebinterpolate(lambda t: function(middle + half * t), degree))
    powers = [polynomial.polypow((-middle / half, 1 / half), k) for k in range(degree + 1)]
    total = np.zeros(degree + 1)
    for c, p in zip(fitted, powers, strict=True):
        total[: len(p)] += c * p
    return tuple(float(c) for c in total)


def _log2_ratio(f: Any) -> Any:
    """log2(1 + f) / f, whose value at 0 is 1 / ln 2."""
    f = np.asarray(f, dtype=float)
    safe = np.where(f == 0, 1.0, f)
    return np.where(f == 0, 1 / np.log(2), np.log1p(safe) / np.log(2) / safe)


def _exp2_ratio(r: Any) -> Any:
    """(2^r - 1) / r, whose value at 0 is ln 2."""
    r = np.asarray(r, dtype=float)
    safe = np.where(r == 0, 1.0, r)
    return np.where(r == 0, np.log(2), np.expm1(safe * np.log(2)) / safe)


#: the float32 polynomials are as short as an error of 3e-7 in a power allows: two terms more of the one and one of the
#: other give 8e-8 and cost a tenth of the power's time; 2^0 is 1 exactly
LOG2_RATIO = through_chebyshev_nodes(_log2_ratio, np.sqrt(0.5) - 1, np.sqrt(2) - 1, 7)
EXP2 = (1.0, *through_chebyshev_nodes(_exp2_ratio, -0.5, 0.5, 4))
#: 2 artanh(s) / ln 2 = s * sum of these times s^2k; exact rationals, enough of them for float64 where s <= 0.1716
ARTANH2: tuple[float, ...] = tuple(2 / np.log(2) / (2 * k + 1) for k in range(11))
#: 2^r = sum of these times r^k for |r| <= 1/2; the Taylor series to float64's last bit
EXP2_SERIES = tuple(float(np.log(2) ** k / np.prod(np.arange(1.0, k + 1))) for k in range(14))


def _arc_ratio(t: Any) -> Any:
    """acos(1 - d) / sqrt(d) for d = (t + 1) / 2, whose value at d = 0 is sqrt 2; free of acos's vertical tangent."""
    d = np.maximum((np.asarray(t, dtype=float) + 1) / 2, 1e-300)
    return 2 * np.arcsin(np.sqrt(d / 2)) / np.sqrt(d)


ARC_32 = through_chebyshev_nodes(_arc_ratio, -1, 1, 8)
ARC_64 = through_chebyshev_nodes(_arc_ratio, -1, 1, 18)


def _native(function: Body) -> Body:
    """A helper whose types are spelled out, so it is compiled as it is."""
    function.__compiled__ = True  # type: ignore[attr-defined]
    return jit.inline(function)


_HALF_ROOT_BITS_32 = np.float32(np.sqrt(0.5)).view(np.int32)
_HALF_ROOT_BITS_64 = np.float64(np.sqrt(0.5)).view(np.int64)
_EXPONENT_32, _EXPONENT_64 = np.int32(-1 << 23), np.int64(-1 << 52)
_SHIFT_32, _SHIFT_64 = np.int32(23), np.int64(52)
#: adding and subtracting this rounds to the nearest whole number, and its low bits are that number
_MAGIC_32, _MAGIC_64 = np.float32(1.5 * 2**23), np.float64(1.5 * 2**52)
#: the bits of 1.0, and the factor that makes a whole mantissa a fraction
_ONE_BITS_32, _ONE_BITS_64 = np.float32(1).view(np.int32), np.float64(1).view(np.int64)
_STEP_32, _STEP_64 = np.float32(2.0**-23), np.float64(2.0**-52)


@_native
def _exponent_32(x: Any) -> Any:
    # numba widens int32 sums to int64: narrowed at once, the shift and the conversion stay in 32-bit lanes
    return np.float32(np.int32(jit.float32_bits(x) - _HALF_ROOT_BITS_32) >> _SHIFT_32)


@_native
def _exponent_64(x: Any) -> Any:
    return np.float64((jit.float64_bits(x) - _HALF_ROOT_BITS_64) >> _SHIFT_64)


# The mantissa is what is left of the bits when the exponent's are taken away: a sum that the exponent needs too.


@_native
def _mantissa_32(x: Any) -> Any:
    exponent = np.int32(jit.float32_bits(x) - _HALF_ROOT_BITS_32) & _EXPONENT_32
    return jit.float32_from_bits(np.int32(jit.float32_bits(x) - exponent))


@_native
def _mantissa_64(x: Any) -> Any:
    exponent = (jit.float64_bits(x) - _HALF_ROOT_BITS_64) & _EXPONENT_64
    return jit.float64_from_bits(jit.float64_bits(x) - exponent)


@_native
def _shifted_32(t: Any) -> Any:
    return np.float32(t + _MAGIC_32)


@_native
def _shifted_64(t: Any) -> Any:
    return t + _MAGIC_64


@_native
def _unshifted_32(s: Any) -> Any:
    return np.float32(s - _MAGIC_32)


@_native
def _unshifted_64(s: Any) -> Any:
    return s - _MAGIC_64


@_native
def _scaled_32(x: Any, s: Any) -> Any:
    raised = np.int32(jit.float32_bits(s) << _SHIFT_32)
    return jit.float32_from_bits(np.int32(jit.float32_bits(x) + raised))


@_native
def _scaled_64(x: Any, s: Any) -> Any:
    return jit.float64_from_bits(jit.float64_bits(x) + (jit.float64_bits(s) << _SHIFT_64))


@_native
def _root(x: Any) -> Any:
    return np.sqrt(x)


@_native
def _linear_log2_32(x: Any) -> Any:
    return np.float32(jit.float32_bits(x) - _ONE_BITS_32) * _STEP_32


@_native
def _linear_log2_64(x: Any) -> Any:
    return np.float64(jit.float64_bits(x) - _ONE_BITS_64) * _STEP_64


@_native
def _from_linear_32(t: Any) -> Any:
    return jit.float32_from_bits(np.int32(np.int32(t / _STEP_32) + _ONE_BITS_32))


@_native
def _from_linear_64(t: Any) -> Any:
    return jit.float64_from_bits(np.int64(t / _STEP_64) + _ONE_BITS_64)


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


@primitive(float32=_from_linear_32, float64=_from_linear_64)
def from_linear(t: float) -> float:
    """The number whose `linear_log2` is t; its power of two must be normal."""
    given: Any = t
    exact = float(given) if isinstance(given, np.floating) else given
    k = math.floor(exact)
    return type(t)(2.0**k * (1.0 + (exact - k)))


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


def _library(x: Any) -> Any:
    """Where the standard functions of x are: NumPy for floats, else the number's own mpmath context."""
    return np if isinstance(x, float | np.floating) else x.context


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


@primitive(float32=_linear_log2_32, float64=_linear_log2_64)
def linear_log2(x: float) -> float:
    """log2 by straight lines between powers of two: exponent and mantissa bits of a positive x, read as one number."""
    mantissa, exponent = _library(x).frexp(x)
    return type(x)(exponent - 1 + (2 * mantissa - 1))


@primitive(float32=_linear_exp2_32, float64=_linear_exp2_64)
def linear_exp2(t: float) -> float:
    """2^t by straight lines between whole t: the inverse of `linear_log2`; 0 where the result would be subnormal."""
    return from_linear(t)


@primitive(float32=_root, float64=_root)
def square_root(x: float) -> float:
    """The square root of x >= 0."""
    return cast(float, _library(x).sqrt(x))


@primitive(float32=_arc_cosine_32, float64=_arc_cosine_64)
def arc_cosine(x: float) -> float:
    """The angle in [0, pi] whose cosine is x, which is limited to [-1, 1]; NaN gives pi.

    Error 3e-7 in float32, 5e-15 in float64.
    """
    return cast(float, _library(x).acos(type(x)(clamped(x, -1.0, 1.0))))
