"""Schlick's reflectance, and the exponentials that stand for its fifth power."""

from phongbench.compiler import elementary
from phongbench.formulas.citations import KARIS_2013, LAGARDE_2012, SCHLICK_1994_BRDF
from phongbench.formulas.fresnel.spec import F0, ReflectanceFormula
from phongbench.formulas.spec import Cost

#: exponents of 2 that stand for (1 - v)^5: (SQUARE v + LINEAR) v, Karis' fit, within .0038; STRAIGHT v, within .042
SQUARE, LINEAR = -5.55473, -6.98316
STRAIGHT = -8.65617


def schlick(cosine: float, f0: float) -> float:
    """Schlick's approximation of the reflectance of unpolarised light.

    cosine   float          v = V.H, in 0 .. 1
    f0       float in 0..1  reflectance at normal incidence
    returns  float          reflectance, f0 at v = 1 and 1 at v = 0

    Formula  f0 + (1 - f0) (1 - v)^5
    Source   SCHLICK_1994_BRDF
    Domain   glass within .036; metals lose the dip before grazing incidence, copper .040 too bright near 80 degrees
    """
    rest = 1.0 - cosine
    square = rest * rest
    return f0 + (1.0 - f0) * (square * square * rest)


def schlick_exp2(cosine: float, f0: float) -> float:
    """Schlick's reflectance with the fifth power as one exponential.

    cosine   float          v = V.H, in 0 .. 1
    f0       float in 0..1  reflectance at normal incidence
    returns  float          reflectance, 1 at v = 0

    Formula  f0 + (1 - f0) 2^((-5.55473 v - 6.98316) v)
    Source   KARIS_2013
    Domain   within .0038 (1 - f0) of Schlick's; .00017 (1 - f0) too bright at normal incidence
    """
    return f0 + (1.0 - f0) * elementary.exp2((SQUARE * cosine + LINEAR) * cosine)


def schlick_exp2_linear(cosine: float, f0: float) -> float:
    """Schlick's reflectance with the fifth power as an exponential of the cosine: a product less, ten times the error.

    cosine   float          v = V.H, in 0 .. 1
    f0       float in 0..1  reflectance at normal incidence
    returns  float          reflectance, 1 at v = 0

    Formula  f0 + (1 - f0) 2^(-8.65617 v)
    Source   LAGARDE_2012
    Domain   within .042 (1 - f0) of Schlick's
    """
    return f0 + (1.0 - f0) * elementary.exp2(STRAIGHT * cosine)


SPECS = (
    ReflectanceFormula(
        name="schlick",
        title="Schlick",
        exact=False,
        formula="f0 + (1 - f0) (1 - v)^5",
        source=SCHLICK_1994_BRDF,
        kernel=schlick,
        parameters=(F0,),
        coefficients=lambda f0: {"f0": f0},
        domain="glass within .036, at 85 degrees; metals up to about 70 degrees",
        cost=Cost("three multiplications, one fused multiply-add, two differences", multiplies=3),
    ),
    ReflectanceFormula(
        name="schlick-exp2",
        title="Schlick by an exponential",
        exact=False,
        formula="f0 + (1 - f0) 2^((-5.55473 v - 6.98316) v)",
        source=KARIS_2013,
        kernel=schlick_exp2,
        parameters=(F0,),
        coefficients=lambda f0: {"f0": f0},
        domain="as Schlick's, from which it differs by at most .0038 (1 - f0)",
        cost=Cost("two fused multiply-adds, one multiplication, one exponential", multiplies=1, transcendentals=1),
    ),
    ReflectanceFormula(
        name="schlick-exp2-linear",
        title="Schlick by an exponential of the cosine",
        exact=False,
        formula="f0 + (1 - f0) 2^(-8.65617 v)",
        source=LAGARDE_2012,
        kernel=schlick_exp2_linear,
        parameters=(F0,),
        coefficients=lambda f0: {"f0": f0},
        domain="as Schlick's, from which it differs by at most .042 (1 - f0)",
        cost=Cost("one multiplication, one fused multiply-add, one exponential", multiplies=1, transcendentals=1),
    ),
)
