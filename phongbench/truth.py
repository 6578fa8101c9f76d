"""Exact values that errors are measured against.

Two truths: `angle`, Phong of the true angle between the directions, lengths ignored; `given`, max(0, a.b)^alpha of the
vectors as they are. Both start from the inputs as exact numbers, in float64: the oracle of float32 and float16 cells,
with an absolute error of about 2e-16 (held in the tests against 50-digit arithmetic). The slow obvious twins at the end
of this file are those oracles.
"""

from functools import cache
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from phongbench import jit, powers
from phongbench.lowering import FLOAT64, lower

TRUTHS = ("angle", "given")
#: below this deficit 1 - lambda is at least sqrt(1/2), so its binary exponent is 0 and its logarithm can start from
#: lambda itself
_NEAR = float(1 - np.sqrt(0.5))


def phong_of_deficit(deficit: float, alpha: float) -> float:
    """(1 - deficit) ** alpha for deficit < 1, else 0, keeping the relative accuracy of a small deficit.

    Formula  exp2(alpha log2(1 - deficit)); the logarithm's argument is -deficit itself near the peak
    """
    x = 1.0 - deficit
    f = -deficit if deficit < _NEAR else powers.binary_mantissa(x) - 1.0
    exponent = 0.0 if deficit < _NEAR else powers.binary_exponent(x)
    s = f / (f + 2.0)
    z = s * s
    ratio = powers.ARTANH2[10]
    for k in range(9, -1, -1):
        ratio = ratio * z + powers.ARTANH2[k]
    value = powers.exp2(alpha * (exponent + s * ratio))
    return value if deficit < 1.0 else 0.0


def _signature(dtype: Any) -> Any:
    row = jit.array_type(dtype)
    return jit.signature(row, row, row, row, row)


#: inside drivers: (address, array) -> the compiled truth at that address
truth_at = jit.function_at(_signature)


@cache
def _bodies() -> tuple[Any, Any]:
    return lower(phong_of_deficit, FLOAT64), lower(powers.POWER_64, FLOAT64)


@cache
def truth_kernel(half_space: bool, both: bool = True) -> Any:
    """Compiled (unit deficits, given cosines, [alpha], angle out, given out) over float64 rows of equal length.

    In half space the pair is (N, H) and the truth is Phong's at twice the angle, the coplanar configuration: its
    deficit is 2 d (2 - d), its cosine 2 c^2 - 1. Unless both truths are wanted, `given out` is left alone.
    """
    of_deficit, power = _bodies()

    def reflect(deficit: Any, cosine: Any, alpha: Any, angle: Any, given: Any) -> None:
        exponent = alpha[0]
        for i in range(len(deficit)):
            angle[i] = of_deficit(deficit[i], exponent)
        if both:
            for i in range(len(deficit)):
                given[i] = power(cosine[i], exponent)

    def half(deficit: Any, cosine: Any, alpha: Any, angle: Any, given: Any) -> None:
        exponent = alpha[0]
        for i in range(len(deficit)):
            angle[i] = of_deficit(2.0 * deficit[i] * (2.0 - deficit[i]), exponent)
        if both:
            for i in range(len(deficit)):
                c = cosine[i]
                given[i] = power(2.0 * c * c - 1.0, exponent) if c > 0.0 else 0.0

    return jit.elementwise(_signature(np.float64), half if half_space else reflect)


def of_deficits(deficit: NDArray[np.float64], alpha: float, half_space: bool = False) -> NDArray[np.float64]:
    """Exact Phong, within 2e-16, of the deficits 1 - cos(angle) of (R, V), or of (N, H) at half that angle."""
    out = np.empty_like(deficit)
    _call(jit.address(truth_kernel(half_space, both=False)), deficit, np.array([alpha]), out)
    return out


@jit.driver
def _call(address: int, deficit: Any, alpha: Any, out: Any) -> None:
    truth_at(address, out)(deficit, deficit, alpha, out, out)


def exact_angle(a: NDArray[Any], b: NDArray[Any], alpha: float, half_space: bool = False, digits: int = 50) -> Any:
    """Phong of the true angle between two given vectors, by mpmath: the slow obvious twin.

    NaN where an angle is undefined.
    """
    with mpmath.workdps(digits):
        u, v = [mpmath.mpf(float(c)) for c in a], [mpmath.mpf(float(c)) for c in b]
        length = mpmath.sqrt(mpmath.fdot(u, u)) * mpmath.sqrt(mpmath.fdot(v, v))
        if not (mpmath.isfinite(length) and length > 0):
            return mpmath.nan
        return _phong(mpmath.fdot(u, v) / length, alpha, half_space)


def exact_given(a: NDArray[Any], b: NDArray[Any], alpha: float, half_space: bool = False, digits: int = 50) -> Any:
    """max(0, a.b)^alpha of the vectors as they are, by mpmath: the slow obvious twin."""
    with mpmath.workdps(digits):
        u, v = [mpmath.mpf(float(c)) for c in a], [mpmath.mpf(float(c)) for c in b]
        return _phong(mpmath.fdot(u, v), alpha, half_space)


def _phong(x: Any, alpha: float, half_space: bool) -> Any:
    if half_space:
        x = 2 * x * x - 1 if x > 0 else mpmath.mpf(0)
    return mpmath.power(x, mpmath.mpf(alpha)) if x > 0 else mpmath.mpf(0)
