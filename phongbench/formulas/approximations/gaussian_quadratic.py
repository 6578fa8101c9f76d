"""The spherical Gaussian by a parabola between powers of two: for chips without a unit that takes exponentials."""

import math

from phongbench.compiler import elementary, float_bits
from phongbench.formulas import slopes
from phongbench.formulas.citations import FONSECA_2008
from phongbench.formulas.spec import Approximation, Cost

#: 2^f over 0 <= f <= 1 as constant, slope and curvature: the least relative error that a parabola can have, 1.72e-3
CONSTANT, SLOPE, CURVATURE = 1.0017247597, 0.6576359377, 0.3371894346
#: octaves below 1 from which the value is exactly 0, as in elementary.squared: subnormal numbers would be slow
DARK = 120.0


def gaussian_quadratic(cosine_deficit: float, octaves: float) -> float:
    """A Gaussian lobe whose exponential is a power of two times a parabola.

    cosine_deficit  float      lambda, about 1 - cos(angle); any of the lambda forms
    octaves         float > 0  halvings for each lambda, (alpha + c) / ln 2; the offset c as of the Gaussian
    returns         float      highlight factor, in [0, 0.9983]

    Formula  2**k * (1.00172 + 0.65764 * f + 0.33719 * f**2), k + f = -octaves * lambda, k whole, 0 < f <= 1
    Source   FONSECA_2008
    Domain   the Gaussian's; within 1.73e-3 of it, relatively. It misses the peak by 0.0017 and falls by a step of
             0.0034 of its value at every halving. A negative lambda gives the peak, NaN and less than 2**-120 give 0
    """
    t = -octaves * (0.0 if cosine_deficit < 0.0 else cosine_deficit)
    t = t if t > -DARK else -DARK
    k = float(int(t)) - 1.0
    f = t - k
    value = (CONSTANT + f * (SLOPE + f * CURVATURE)) * float_bits.from_linear(k)
    return elementary.where_above(value, t, -DARK)


SPEC = Approximation(
    name="gaussian-quadratic",
    title="Gaussian by a parabola",
    kind="approximation",
    formula="exp(-(alpha + c) lambda), 2^f by 1.00172 + 0.65764 f + 0.33719 f^2 between powers of two",
    source=FONSECA_2008,
    kernel=gaussian_quadratic,
    coefficients=lambda s: {"octaves": slopes.sharpness(s.slope, s.exponent) / math.log(2.0)},
    domain="alpha above about 20, on chips without an exponential; errs by 0.0017 at the peak, else as the Gaussian",
    cost=Cost("two multiplications, two choices, three conversions, two fused multiply-adds", multiplies=2),
    slopes=tuple(slopes.OFFSETS),
    at_zero=slopes.at_zero,
    peak=(CONSTANT + SLOPE + CURVATURE) / 2.0,
    falls=True,
)
