"""The exact reflectance of what absorbs light: metals."""

from phongbench.compiler import elementary
from phongbench.formulas.citations import FRESNEL
from phongbench.formulas.fresnel.spec import K, N, ReflectanceFormula
from phongbench.formulas.spec import Cost


def conductor(cosine: float, difference: float, product: float) -> float:
    """Fresnel's reflectance of unpolarised light on a smooth surface of complex index n + i k.

    cosine      float  v = V.H, in 0 .. 1
    difference  float  n^2 - k^2
    product     float  4 n^2 k^2
    returns     float  reflectance in 0 .. 1

    Formula  (S + P) / 2 with s^2 = 1 - v^2, q = n^2 - k^2 - s^2, r = sqrt(q^2 + 4 n^2 k^2), a = sqrt((r + q) / 2),
             S = (r + v^2 - 2 a v) / (r + v^2 + 2 a v), P = S (r v^2 + s^4 - 2 a v s^2) / (r v^2 + s^4 + 2 a v s^2)
    Source   FRESNEL
    Domain   all; k = 0 is the dielectric. For q < 0 the sum r + q loses digits, as shaders let it: metals err by some
             roundings in float32, an n below 1 with a k of nearly 0 by up to 1e-3
    """
    square = cosine * cosine
    sine = 1.0 - square
    q = difference - sine
    r = elementary.square_root(q * q + product)
    turned = 2.0 * cosine * elementary.square_root(elementary.positive_part(0.5 * (r + q)))
    most = r + square + turned
    across = (r + square - turned) / most if most > 0.0 else 1.0
    whole = r * square + sine * sine
    part = turned * sine
    return 0.5 * (across + across * ((whole - part) / (whole + part)))


SPEC = ReflectanceFormula(
    name="conductor",
    title="Fresnel, conductor",
    exact=True,
    formula="that of a complex index n + i k",
    source=FRESNEL,
    kernel=conductor,
    parameters=(N, K),
    coefficients=lambda n, k: {"difference": n * n - k * k, "product": 4 * n * n * k * k},
    domain="smooth surfaces of metals, or of anything with a known n and k",
    cost=Cost("two square roots, two divisions, about twenty multiplications and sums", multiplies=10, divisions=2),
)
