"""Blinn's highlight: a power of N.H, whose angle is half of that between R and V if all are coplanar."""

from collections.abc import Callable, Mapping

from phongbench.compiler import elementary
from phongbench.formulas import minimax_fits
from phongbench.formulas.citations import BLINN_1977
from phongbench.formulas.spec import Approximation, Cost, Setting


def blinn(cosine: float, exponent: float) -> float:
    """Blinn's specular term.

    cosine    float        N.H, meant for [-1, 1]
    exponent  float > 0    alpha' > alpha, by policy
    returns   float        highlight factor, in [0, 1] for unit vectors

    Formula  max(0, cosine) ** exponent
    Source   BLINN_1977
    Domain   its own shape: close to Phong for coplanar vectors only, elongated at grazing incidence; shines past 90
             degrees of R.V
    """
    return elementary.power(cosine, exponent)


def lagarde(alpha: float) -> float:
    """Lagarde's fit of the ratio alpha' / alpha (LAGARDE_2012) for alpha >= 1; below, where it turns over, as at 1."""
    t = 1.0 / max(alpha, 1.0)
    return 4.00012 + 1.22792 * t + 0.728329 * t**2 - 0.624042 * t**3


#: policy -> alpha' / alpha; taylor is Fisher and Woo's 4 (FISHER_WOO_1994), equal curvature at the peak
RATIOS: Mapping[str, Callable[[float], float]] = {
    "taylor": lambda alpha: 4.0,
    "lagarde": lagarde,
    "minimax": minimax_fits.half_angle_ratio,
}


def exponent(setting: Setting) -> float:
    """alpha' by policy; 0 at alpha 0, whatever the ratio."""
    return setting.alpha and setting.alpha * RATIOS[setting.slope](setting.alpha)


SPEC = Approximation(
    name="blinn",
    title="Blinn-Phong",
    kind="alternative",
    formula="max(0, N.H)^alpha', alpha' = ratio alpha",
    source=BLINN_1977,
    kernel=blinn,
    coefficients=lambda s: {"exponent": exponent(s)},
    domain="another shape: near Phong for coplanar vectors only, within 0.135 / alpha at ratio 4",
    cost=Cost("one logarithm, one exponential", multiplies=1, transcendentals=2),
    lambda_forms=("none",),
    spaces=("half",),
    slopes=tuple(RATIOS),
    exponent="exponent",
    at_zero=lambda s: None,
    falls=True,
)
