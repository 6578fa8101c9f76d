"""A power read off the exponent bits of a float: the honest counter-example."""

from phongbench.compiler import elementary
from phongbench.formulas.citations import SCHRAUDOLPH_1999
from phongbench.formulas.spec import Approximation, Cost

#: how far Schraudolph lowers the straight lines that stand for 2^t: least mean square of the relative error
LOWERED = 60801 / 2**20


def bit_trick(cosine: float, alpha: float) -> float:
    """Phong's term by logarithm and exponential of straight lines between powers of two.

    cosine   float        a.b; not positive and NaN give 0
    alpha    float > 0    shininess
    returns  float        highlight factor, in [0, 0.971] for unit vectors

    Formula  linear_exp2(alpha * linear_log2(cosine) - 0.058), both linear between powers of two
    Source   SCHRAUDOLPH_1999
    Domain   nowhere good: 0.971 at the peak and 0.13 too dark around u = 1 at high alpha; over-long vectors give values
             above 1
    """
    value = elementary.linear_exp2(alpha * elementary.linear_log2(cosine) - LOWERED)
    return value if cosine > 0.0 else 0.0


SPEC = Approximation(
    name="bit-trick",
    title="Bit trick",
    kind="approximation",
    formula="2^(alpha log2 x - 0.058), log2 and 2^t by straight lines between powers of two",
    source=SCHRAUDOLPH_1999,
    kernel=bit_trick,
    coefficients=lambda s: {"alpha": s.alpha},
    domain="a counter-example: misses the peak by 0.029 and Phong by 0.13",
    cost=Cost("two conversions between integer and float, two multiplications, two additions", multiplies=2),
    lambda_forms=("none",),
    at_zero=lambda s: None,
    peak=1.0 - LOWERED / 2.0,
    falls=True,
)
