"""Kuijk and Blake's highlight: parabolas in the angle, for renderers that interpolate angles, not vectors."""

from phongbench.compiler import elementary
from phongbench.formulas.citations import KUIJK_BLAKE_1989
from phongbench.formulas.spec import Approximation, Cost, Parameter, Setting

ALPHA_TO_64 = Parameter("alpha", "shininess; the constants were fitted up to 64", 1, 64)


def kuijk_blake(cosine: float, inner: float, outer: float, top: float, skirt: float) -> float:
    """Piecewise quadratic highlight in the angle.

    cosine   float        a.b; outside [-1, 1] the nearest end is taken, and NaN counts as -1
    inner    float        angle in radians where the two parabolas meet with equal slope
    outer    float        angle in radians from which the value is 0, above inner
    top      float        1 / (inner * outer): the inner parabola's factor
    skirt    float        1 / (outer * (outer - inner)): the outer parabola's factor
    returns  float        highlight factor in [0, 1]

    Formula  1 - t**2 / (inner * outer) for t < inner, (t - outer)**2 / (outer * (outer - inner)) up to outer, t the
             angle
    Source   KUIJK_BLAKE_1989
    Domain   1 <= alpha <= 64; within 0.03 from alpha = 3, 0.052 at 1. Below alpha = 2.2 outer is past 90 degrees: light
             leaks
    """
    angle = elementary.arc_cosine(cosine)
    rest = elementary.positive_part(outer - angle)
    near = 1.0 - top * (angle * angle)
    return near if angle < inner else skirt * (rest * rest)


def coefficients(setting: Setting) -> dict[str, float]:
    """The authors' fit. The print has a and b exchanged; Kuijk corrected it in comp.graphics.research, 19 Sep 1991."""
    n = setting.alpha
    a, b = (n + 5.6) / (n * (0.09 * n + 5.2)), (n + 65.0) / (5.0 * n + 31.7)
    return {"inner": a, "outer": b, "top": 1 / (a * b), "skirt": 1 / (b * (b - a))}


SPEC = Approximation(
    name="kuijk-blake",
    title="Kuijk and Blake",
    kind="approximation",
    formula="1 - t^2/(ab) for t < a, (t - b)^2/(b (b - a)) up to b, t = acos x",
    source=KUIJK_BLAKE_1989,
    kernel=kuijk_blake,
    coefficients=coefficients,
    domain="1 <= alpha <= 64: within 0.03 from alpha = 3 on; beyond 64 it fails, 0.036 at 100 and 0.11 at 200",
    cost=Cost("one arc cosine (square root and polynomial), four multiplications", multiplies=4, transcendentals=1),
    parameters=(ALPHA_TO_64,),
    lambda_forms=("none",),
    falls=True,
)
