"""Exact values that errors are measured against.

Two truths: `angle`, Phong of the true angle between the directions, lengths ignored; `given`, max(0, a.b)^alpha of the
vectors as they are. Both start from the inputs as exact numbers, in float64: the oracle of the narrower precisions. How
far that may be off is stated by `angle_error` and `given_error`, and re-checked in every run against the slow obvious
bodies at the end of this file, at 50 digits.
"""

import math
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler import elementary, float_bits, intrinsics, jit
from phongbench.compiler.lowering import FLOAT64, lower
from phongbench.compiler.polynomials import ARTANH2

TRUTHS = ("angle", "given")
#: below this deficit 1 - lambda is at least sqrt(1/2), so its binary exponent is 0 and its logarithm can start from
#: lambda itself
_NEAR = float(1 - np.sqrt(0.5))


def phong_of_deficit(deficit: float, alpha: float) -> float:
    """(1 - deficit) ** alpha for deficit < 1, else 0, keeping the relative accuracy of a small deficit.

    Formula  exp2(alpha log2(1 - deficit)); the logarithm's argument is -deficit itself near the peak
    """
    x = 1.0 - deficit
    f = -deficit if deficit < _NEAR else float_bits.binary_mantissa(x) - 1.0
    exponent = 0.0 if deficit < _NEAR else float_bits.binary_exponent(x)
    s = f / (f + 2.0)
    z = s * s
    ratio = ARTANH2[10]
    for k in range(9, -1, -1):
        ratio = ratio * z + ARTANH2[k]
    value = elementary.exp2(alpha * (exponent + s * ratio))
    return value if deficit < 1.0 else 0.0


def _signature(dtype: Any) -> Any:
    row = jit.array_type(dtype)
    return jit.signature(row, row, row, row, row)


#: inside drivers: (address, array) -> the compiled truth at that address
truth_at = intrinsics.function_at(_signature)


@cache
def _bodies() -> tuple[Any, Any]:
    return lower(phong_of_deficit, FLOAT64), lower(elementary.POWER_64, FLOAT64)


@cache
def truth_kernel(half_space: bool, both: bool = True) -> Any:
    """Compiled (unit deficits, given cosines, [alpha], angle out, given out) over float64 rows of equal length.

    In half space the pair is (N, H) and the truth is Phong's at twice the angle, the coplanar configuration: its
    deficit is 2 d (2 - d), its cosine 2 c^2 - 1, and it is 0 for an N.H that is not positive. Unless both truths are
    wanted, `given out` is left alone.
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
            d = 1.0 if deficit[i] > 1.0 else deficit[i]  # behind the normal there is no highlight
            angle[i] = of_deficit(2.0 * d * (2.0 - d), exponent)
        if both:
            for i in range(len(deficit)):
                c = cosine[i]
                given[i] = power(2.0 * c * c - 1.0, exponent) if c > 0.0 else 0.0

    return jit.elementwise(_signature(np.float64), half if half_space else reflect)


def of_deficits(deficit: NDArray[np.float64], alpha: float, half_space: bool = False) -> NDArray[np.float64]:
    """Exact Phong, within 2e-16, of the deficits 1 - cos(angle) of (R, V), or of (N, H) at half that angle.

    deficit  (n,) float64, >= 0   of unit directions
    alpha    float > 0            exact exponent
    returns  (n,) float64         in [0, 1]; 0 from 90 degrees between R and V on
    """
    out = np.empty_like(deficit)
    _call(jit.address(truth_kernel(half_space, both=False)), deficit, np.array([alpha]), out)
    return out


@jit.driver
def _call(address: int, deficit: Any, alpha: Any, out: Any) -> None:
    truth_at(address, out)(deficit, deficit, alpha, out, out)


#: half a unit in the last place of 1
_U = 2.0**-53
#: powers below this are 0
_DARK = 2.0**-1022


def angle_error(alpha: float, half_space: bool = False) -> float:
    """How far the float64 `angle` truth may be off, absolutely; u = 2^-53 is the unit roundoff.

    Normalising: each unit vector is off by at most u across, and by a few u along itself. Across, a - b is off by 2 u,
    so lambda = |a - b|^2 / 2 by 2 u sqrt(2 lambda); along, with the roundings of the sum, by at most 12 u lambda. The
    power's slope alpha (1 - lambda)^(alpha - 1) times these is at most 1.3 u sqrt(alpha) + 1 and 12 u: the two lobes
    sqrt(t) exp(-t) and t exp(-t), t = alpha lambda, have maxima below 0.43 and 0.37, and 1 at alpha = 1. Logarithm,
    product and exponential err by a few u of their value and of alpha log(1 - lambda), whose product stays below 1.
    Stated with room: u (2 sqrt(alpha) + 32), twice that in half space, where the deficit is four times as steep. Below
    alpha = 1 the power's slope has no bound at 90 degrees, but |x^alpha - y^alpha| <= |x - y|^alpha.
    """
    room = _U * (2 * alpha**0.5 + 32) * (2 if half_space else 1)
    return float(max(room, (16 * _U) ** alpha)) if alpha < 1 else float(room)


def given_error(exact: float, cosine: float, size: float, alpha: float, half_space: bool = False) -> float:
    """How far the float64 `given` truth may be off, absolutely.

    exact   its value
    cosine  a.b, or 2 (a.b)^2 - 1 in half space: what is raised to alpha
    size    sum of |a_i b_i|: the product is off by at most 3 u of it, in half space twelve times as much

    Formula  alpha cosine^(alpha - 1) times the product's error, and the power's own of (32 + 4 alpha |log cosine|) u
    """
    if not cosine > 0:
        return float((48 * _U * max(size, size * size)) ** min(alpha, 1.0))
    product = (40 if half_space else 4) * _U * max(size, size * size if half_space else 0.0)
    steep = min(alpha * exact / cosine * product * 2, (2 * product) ** alpha if alpha < 1 else float("inf"))
    return float(steep + exact * (32 + 4 * alpha * abs(math.log(cosine))) * _U + _DARK)


# the slow obvious bodies, for numbers of any kind that keep enough digits


def product(u: Sequence[Any], v: Sequence[Any]) -> Any:
    """The dot product."""
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def phong_of_angle(u: Sequence[Any], v: Sequence[Any], alpha: float, half_space: bool) -> Any:
    """Phong of the angle between two vectors that are not zero."""
    return phong_of_cosine(product(u, v) / (product(u, u) ** 0.5 * product(v, v) ** 0.5), alpha, half_space)


def phong_of_cosine(x: Any, alpha: float, half_space: bool) -> Any:
    """max(0, x)^alpha; in half space of the reflected cosine, 2 x^2 - 1."""
    if half_space:
        x = 2 * x * x - 1 if x > 0 else 0 * x
    return x**alpha if x > 0 else 0 * x
