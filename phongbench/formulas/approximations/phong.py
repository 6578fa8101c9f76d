"""Exact Phong: the term that everything else is measured against."""

from phongbench.compiler import elementary
from phongbench.formulas.citations import PHONG_1975
from phongbench.formulas.spec import Approximation, Cost


def phong(cosine: float, alpha: float) -> float:
    """Phong's specular term.

    cosine   float          a.b, meant for [-1, 1]
    alpha    float > 0      shininess
    returns  float          highlight factor, in [0, 1] for unit vectors

    Formula  max(0, cosine) ** alpha
    Source   PHONG_1975
    Domain   over-long vectors give values above 1, growing like exp(alpha * excess)
    """
    return elementary.power(cosine, alpha)


SPEC = Approximation(
    name="phong",
    title="Phong (exact)",
    kind="exact",
    formula="max(0, x)^alpha",
    source=PHONG_1975,
    kernel=phong,
    coefficients=lambda s: {"alpha": s.alpha},
    domain="every alpha >= 0, where 0 gives 1 wherever x > 0; over-long vectors give values above 1",
    cost=Cost("one logarithm, one exponential", multiplies=1, transcendentals=2),
    lambda_forms=("none",),
    exponent="alpha",
    at_zero=lambda s: None,
    falls=True,
)
