"""The spherical Gaussian: what every narrow highlight tends to, and Lyon's real rival when alpha > 2 gamma."""

from phongbench.compiler import elementary
from phongbench.formulas import slopes
from phongbench.formulas.citations import KARIS_2013
from phongbench.formulas.spec import Approximation, Cost


def gaussian(cosine_deficit: float, sharpness: float) -> float:
    """A Gaussian lobe on the sphere.

    cosine_deficit  float      lambda, about 1 - cos(angle); any of the lambda forms
    sharpness       float > 0  alpha plus an offset c: 0 taylor, about 0.66 minimax, 1 energy, 0.775 unreal
    returns         float      highlight factor, in (0, 1] where lambda >= 0

    Formula  exp(-sharpness * lambda)
    Source   KARIS_2013
    Domain   alpha above about 20; never exactly 0, so at low alpha light leaks past 90 degrees unless a.b > 0 is asked
             for; a negative lambda (dot form, over-long vectors) gives values above 1
    """
    return elementary.exponential(-sharpness * cosine_deficit)


SPEC = Approximation(
    name="gaussian",
    title="Spherical Gaussian",
    kind="approximation",
    formula="exp(-(alpha + c) lambda)",
    source=KARIS_2013,
    kernel=gaussian,
    coefficients=lambda s: {"sharpness": slopes.sharpness(s.slope, s.exponent)},
    domain="alpha above about 20; the error falls like 0.27 / alpha (taylor), half of that with minimax",
    cost=Cost("one multiplication, one exponential", multiplies=1, transcendentals=1),
    slopes=tuple(slopes.OFFSETS),
    at_zero=slopes.at_zero,
    falls=True,
)
