"""Schlick's rational highlight: no power at all, one division, and a long tail."""

from phongbench.compiler import elementary
from phongbench.formulas.citations import LYGIA, SCHLICK_1994
from phongbench.formulas.spec import Approximation, Cost


def schlick(cosine: float, alpha: float) -> float:
    """Schlick's highlight.

    cosine   float        a.b, meant for [-1, 1]
    alpha    float > 0    shininess
    returns  float        highlight factor, in [0, 1] for unit vectors

    Formula  x / (alpha - alpha * x + x), x = max(0, cosine)
    Source   SCHLICK_1994
    Domain   its own shape: equal to Phong at the peak, with the same slope, but a far longer tail; 0.20 too bright at
             high alpha. Over-long vectors meet the pole at x = alpha / (alpha - 1): values grow without bound, then
             turn negative
    """
    x = elementary.positive_part(cosine)
    return x / (alpha - alpha * x + x)


SPEC = Approximation(
    name="schlick",
    title="Schlick",
    kind="alternative",
    formula="x / (alpha - alpha x + x)",
    source=SCHLICK_1994,
    kernel=schlick,
    coefficients=lambda s: {"alpha": s.alpha},
    domain="another shape, with a long tail: up to 0.2036 too bright in the limit of high alpha; unit vectors only",
    cost=Cost("two fused multiply-adds, one division", divisions=1),
    lambda_forms=("none",),
    at_zero=lambda s: None,
    also=(LYGIA,),
    falls=True,
)
