"""Lyon's approximation: a clipped straight line in lambda, squared n times."""

import math

from phongbench.compiler import elementary
from phongbench.formulas import slopes
from phongbench.formulas.citations import LYON_1993
from phongbench.formulas.spec import ALPHA, GAMMA, Approximation, Cost, Setting


def lyon(cosine_deficit: float, beta: float, n: int) -> float:
    """Lyon's highlight from a cosine deficit.

    cosine_deficit  float      lambda, about 1 - cos(angle); any of the lambda forms
    beta            float > 0  slope at the peak; alpha / gamma for Lyon's own choice
    n               int 0..8   squarings; gamma = 2**n
    returns         float      highlight factor, in [0, 1] where lambda >= 0

    Formula  max(0, 1 - beta * lambda) ** (2 ** n)
    Source   LYON_1993
    Domain   exactly 0 beyond lambda = 1 / beta; a negative lambda (dot form, over-long vectors) gives values above 1;
             where alpha < gamma the support reaches past 90 degrees, so light leaks unless a.b > 0 is asked for
    """
    return elementary.squared(1.0 - beta * cosine_deficit, n)


def beta(setting: Setting) -> float:
    """The slope by policy: taylor is Lyon's own, exponent / gamma."""
    return slopes.beta(setting.slope, setting.exponent, float(2**setting.n))


def cutoff(setting: Setting) -> float:
    """The lambda from which the value is 0; infinite for a slope of 0."""
    slope = beta(setting)
    return 1 / slope if slope else math.inf


SPEC = Approximation(
    name="lyon",
    title="Lyon",
    kind="approximation",
    formula="max(0, 1 - beta lambda)^gamma, gamma = 2^n",
    source=LYON_1993,
    kernel=lyon,
    coefficients=lambda s: {"beta": beta(s), "n": s.n},
    domain="gamma <= alpha; best for alpha up to about 2 gamma, a Gaussian is better beyond",
    cost=Cost("one fused multiply-add, one maximum, n squarings"),
    parameters=(ALPHA, GAMMA),
    spaces=("reflect", "half"),
    slopes=slopes.OF_POWERS,
    cutoff=cutoff,
    at_zero=slopes.at_zero,
    falls=True,
)
