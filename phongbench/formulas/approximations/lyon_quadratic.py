"""Lyon's approximation with one more term: a clipped parabola in lambda, squared n times."""

from phongbench.compiler import elementary
from phongbench.formulas import minimax_fits
from phongbench.formulas.citations import PHONGBENCH
from phongbench.formulas.spec import ALPHA, GAMMA, Approximation, Cost, Setting


def lyon_quadratic(cosine_deficit: float, beta: float, curvature: float, turn: float, n: int) -> float:
    """Lyon's highlight with a quadratic term.

    cosine_deficit  float      lambda, about 1 - cos(angle); any of the lambda forms
    beta            float > 0  slope at the peak
    curvature       float      of the parabola in v = beta * lambda; from fitting.parabola
    turn            float      v from which the value stays what it is: the parabola's lowest point, or its zero
    n               int 0..8   squarings; gamma = 2**n
    returns         float      highlight factor, in [0, 1] where lambda >= 0

    Formula  max(0, 1 - v + curvature * v**2) ** (2 ** n), v = min(beta * lambda, turn)
    Source   PHONGBENCH
    Domain   one fused multiply-add dearer than Lyon; for gamma <= 8 and high alpha the lowest point lies above 0, so a
             floor as high as the largest error stays everywhere, behind the surface too, unless a.b > 0 is asked for
    """
    v = beta * cosine_deficit
    v = v if v < turn else turn
    return elementary.squared(1.0 - v * (1.0 - curvature * v), n)


def coefficients(setting: Setting) -> dict[str, float]:
    """The fitted coefficients for the setting's exponent and gamma."""
    beta, curvature = minimax_fits.parabola(setting.exponent, 2**setting.n)
    return {"beta": beta, "curvature": curvature, "turn": minimax_fits.turn(curvature), "n": setting.n}


SPEC = Approximation(
    name="lyon-quadratic",
    title="Lyon, quadratic",
    kind="approximation",
    formula="max(0, 1 - v + q v^2)^gamma, v = min(beta lambda, 1/(2q)), gamma = 2^n; beta and q minimax",
    source=PHONGBENCH,
    kernel=lyon_quadratic,
    coefficients=coefficients,
    domain="alpha >= 1, gamma <= alpha; for gamma <= 8 a floor as high as the largest error stays far from the peak",
    cost=Cost("one multiplication, one minimum, two fused multiply-adds, one maximum, n squarings"),
    parameters=(ALPHA, GAMMA),
    accepts=lambda s: s.alpha >= 1,
    at_zero=lambda s: "its parabola is fitted from alpha 1 on",
    falls=True,
)
