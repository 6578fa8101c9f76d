"""Schlick's reflectance with the dip of metals before grazing incidence: exact in a second place."""

from phongbench.compiler import elementary
from phongbench.formulas.citations import LAZANYI_2005
from phongbench.formulas.fresnel.schlick import schlick
from phongbench.formulas.fresnel.spec import F0, F82, ReflectanceFormula
from phongbench.formulas.spec import Cost

#: the cosine where v (1 - v)^6 is largest: arccos(1/7) is 81.8 degrees
DIP = 1 / 7


def f82(cosine: float, f0: float, dip: float) -> float:
    """Schlick's reflectance less a bump that is widest where v = 1/7.

    cosine   float          v = V.H, in 0 .. 1
    f0       float in 0..1  reflectance at normal incidence
    dip      float          factor of the bump: (Schlick's reflectance - f82) / (v (1 - v)^6), both at v = 1/7
    returns  float          reflectance: f0 at v = 1, f82 at v = 1/7, 1 at v = 0

    Formula  f0 + (1 - f0) (1 - v)^5 - dip v (1 - v)^6, limited to 0 .. 1
    Source   LAZANYI_2005
    Domain   metals; an f82 far from Schlick's reflectance there would leave 0 .. 1 beside v = 1/7, and is cut off
    """
    rest = 1.0 - cosine
    square = rest * rest
    fifth = square * square * rest
    return elementary.clamped(f0 + fifth * ((1.0 - f0) - dip * (cosine * rest)), 0.0, 1.0)


def coefficients(f0: float, f82: float) -> dict[str, float]:
    """The bump's factor, which makes the reflectance f82 at v = 1/7."""
    return {"f0": f0, "dip": (schlick(DIP, f0) - f82) / (DIP * (1 - DIP) ** 6)}


SPEC = ReflectanceFormula(
    name="f82",
    title="Schlick with an edge",
    exact=False,
    formula="f0 + (1 - f0) (1 - v)^5 - a v (1 - v)^6, a so that it is f82 at v = 1/7",
    source=LAZANYI_2005,
    kernel=f82,
    parameters=(F0, F82),
    coefficients=coefficients,
    domain="metals: copper within .007; limited to 0 .. 1",
    cost=Cost("five multiplications, two fused multiply-adds, two comparisons", multiplies=5),
)
