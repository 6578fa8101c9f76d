"""The exact reflectance of what absorbs no light: glass, water, plastic."""

from phongbench.compiler import elementary
from phongbench.formulas.citations import FRESNEL
from phongbench.formulas.fresnel.spec import N, ReflectanceFormula
from phongbench.formulas.spec import Cost


def dielectric(cosine: float, index_squared: float) -> float:
    """Fresnel's reflectance of unpolarised light on a smooth surface between two transparent media.

    cosine         float      v = V.H, in 0 .. 1
    index_squared  float > 0  n^2, of the refractive index inside over outside
    returns        float      reflectance in 0 .. 1; 1 where all light is reflected, which happens for n < 1

    Formula  (((v - g) / (v + g))^2 + ((n^2 v - g) / (n^2 v + g))^2) / 2, g = sqrt(n^2 - 1 + v^2)
    Source   FRESNEL
    Domain   all; the two squares are those of light polarised across and along the plane of incidence
    """
    inside = index_squared - 1.0 + cosine * cosine
    g = elementary.square_root(elementary.positive_part(inside))
    across = (cosine - g) / (cosine + g)
    along = (index_squared * cosine - g) / (index_squared * cosine + g)
    value = 0.5 * (across * across + along * along)
    return value if inside > 0.0 else 1.0


SPEC = ReflectanceFormula(
    name="dielectric",
    title="Fresnel, dielectric",
    exact=True,
    formula="(((v - g)/(v + g))^2 + ((n^2 v - g)/(n^2 v + g))^2)/2, g = sqrt(n^2 - 1 + v^2)",
    source=FRESNEL,
    kernel=dielectric,
    parameters=(N,),
    coefficients=lambda n: {"index_squared": n * n},
    domain="smooth surfaces of what absorbs no light",
    cost=Cost("one square root, two divisions, about ten multiplications and sums", multiplies=5, divisions=2),
)
