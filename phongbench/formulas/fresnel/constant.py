"""The constant ks of Phong's model: what all others are compared with."""

from phongbench.formulas.citations import PHONG_1975
from phongbench.formulas.fresnel.spec import F0, ReflectanceFormula
from phongbench.formulas.spec import Cost


def constant(cosine: float, f0: float) -> float:
    """The same reflectance at every incidence.

    cosine   float          v = V.H; not looked at
    f0       float in 0..1  reflectance
    returns  float          f0

    Formula  f0
    Source   PHONG_1975
    Domain   metals up to about 60 degrees; glass seen from the front
    """
    return f0


SPEC = ReflectanceFormula(
    name="constant",
    title="Constant",
    exact=False,
    formula="f0",
    source=PHONG_1975,
    kernel=constant,
    parameters=(F0,),
    coefficients=lambda f0: {"f0": f0},
    domain="incidence far from grazing: near 90 degrees every real surface mirrors all light",
    cost=Cost("nothing"),
)
