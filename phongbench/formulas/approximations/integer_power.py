"""Exact Phong for a whole alpha by squaring and multiplying: at alpha = 2^k Lyon's price, without an error."""

from phongbench.compiler import elementary
from phongbench.formulas.citations import PHONG_1975
from phongbench.formulas.spec import Approximation, Cost, Parameter

WHOLE_ALPHA = Parameter("alpha", "shininess, a whole number", 1, 4096, whole=True)


def integer_power(cosine: float, exponent: int) -> float:
    """Phong's specular term for a whole exponent.

    cosine    float        a.b, meant for [-1, 1]
    exponent  int >= 1     shininess, known when compiling
    returns   float        highlight factor, in [0, 1] for unit vectors

    Formula  max(0, cosine) ** exponent
    Source   PHONG_1975
    Domain   exact up to rounding, whose relative part grows like the exponent, and exactly 0 below 2^-120; every alpha
             is another program
    """
    return elementary.whole_power(elementary.above_underflow(cosine, exponent), exponent)


SPEC = Approximation(
    name="integer-power",
    title="Integer power",
    kind="exact",
    formula="max(0, x)^alpha by squaring and multiplying",
    source=PHONG_1975,
    kernel=integer_power,
    coefficients=lambda s: {"exponent": int(s.alpha)},
    domain="whole alpha from 1 to 4096, one compiled program each",
    cost=Cost("floor(log2 alpha) squarings and one product for each further binary digit 1 of alpha"),
    parameters=(WHOLE_ALPHA,),
    lambda_forms=("none",),
    accepts=lambda s: s.alpha == int(s.alpha),
    falls=True,
)
