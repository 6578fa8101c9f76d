"""Closed forms of what a highlight sends where, over the half space around the mirrored direction.

Words: x is the cosine of the angle to the mirrored direction R, lambda = 1 - x. The energy of a lobe f is its integral
over directions, 2 pi times that of f(x) over 0 <= x <= 1; its momentum is the part along R, with x beside f. Both are
in steradians: light of unit intensity along the peak. Where light falls along the normal, the horizon is where x = 0,
and all of this leaves the surface; `lobe_moments` has what is left at other angles of incidence.

Source  integrals of powers and exponentials; Phong's are textbook knowledge, the others are derived here.
"""

import math
from collections.abc import Callable, Mapping

from phongbench.formulas.spec import Approximation, Setting

#: energy and momentum of a lobe, in steradians; NaN where there is no closed form
Pair = tuple[float, float]


def phong(alpha: float) -> Pair:
    """x^alpha: 2 pi / (alpha + 1) and 2 pi / (alpha + 2)."""
    return 2 * math.pi / (alpha + 1), 2 * math.pi / (alpha + 2)


def lyon(beta: float, gamma: float) -> Pair:
    """max(0, 1 - beta lambda)^gamma, forms `dot` and `difference`.

    Where beta >= 1 the lobe ends in front of the surface: 2 pi / (beta (gamma + 1)) and
    2 pi (1 / (beta (gamma + 1)) - 1 / (beta^2 (gamma + 1) (gamma + 2))); else the horizon cuts its foot off.
    """
    if beta == 0:
        return phong(0.0)
    foot = max(0.0, 1 - beta)
    first, second = ((1 - foot ** (gamma + n)) / (gamma + n) for n in (1, 2))
    return 2 * math.pi / beta * first, 2 * math.pi / beta * ((1 - 1 / beta) * first + second / beta)


def lyon_cross(beta: float, gamma: float) -> Pair:
    """The same in form `cross`, lambda = (1 - x^2) / 2; only the momentum has a closed form."""
    if beta == 0:
        return phong(0.0)
    foot = max(0.0, 1 - beta / 2)
    return math.nan, 2 * math.pi * (1 - foot ** (gamma + 1)) / (beta * (gamma + 1))


def gaussian(sharpness: float) -> Pair:
    """exp(-sharpness lambda), forms `dot` and `difference`."""
    if sharpness == 0:
        return phong(0.0)
    foot = math.exp(-sharpness)
    energy = -math.expm1(-sharpness) / sharpness
    return 2 * math.pi * energy, 2 * math.pi * (energy - (energy - foot) / sharpness)


def blinn(exponent: float) -> Pair:
    """(N.H)^exponent for light along the normal, where N.H = cos(t / 2) and x = cos t."""
    first, second = (4 * (1 - 2 ** (-(exponent + n) / 2)) / (exponent + n) for n in (2, 4))
    return 2 * math.pi * first, 2 * math.pi * (2 * second - first)


#: formula and lambda form -> its law, given the coefficients of its kernel and gamma
_LAWS: Mapping[tuple[str, str], Callable[[Mapping[str, float], float], Pair]] = {
    ("phong", "none"): lambda c, gamma: phong(c["alpha"]),
    ("integer-power", "none"): lambda c, gamma: phong(c["exponent"]),
    ("lyon", "dot"): lambda c, gamma: lyon(c["beta"], gamma),
    ("lyon", "difference"): lambda c, gamma: lyon(c["beta"], gamma),
    ("lyon", "cross"): lambda c, gamma: lyon_cross(c["beta"], gamma),
    ("gaussian", "dot"): lambda c, gamma: gaussian(c["sharpness"]),
    ("gaussian", "difference"): lambda c, gamma: gaussian(c["sharpness"]),
    ("blinn", "none"): lambda c, gamma: blinn(c["exponent"]),
}


def of(spec: Approximation, form: str, setting: Setting) -> Pair:
    """Energy and momentum by closed form, for light along the normal; NaN where there is none."""
    law = _LAWS.get((spec.name, form))
    if law is None or (setting.space == "half" and spec.name != "blinn"):
        return math.nan, math.nan
    return law(spec.coefficients(setting), float(setting.gamma or 0))
