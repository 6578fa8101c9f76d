"""Doom 3's highlight: one fixed ramp of N.H, the best-known case of Lyon's formula, with gamma 2 and beta 4."""

from phongbench.compiler import elementary
from phongbench.formulas.citations import DOOM_3
from phongbench.formulas.spec import Approximation, Cost


def doom3(cosine_deficit: float) -> float:
    """A squared ramp instead of the sixteenth power, for chips whose fragment programs have no power function.

    cosine_deficit  float  lambda = 1 - N.H
    returns         float  highlight factor, in [0, 1] where lambda >= 0

    Formula  max(0, 1 - 4 * lambda)**2, which is max(0, 4 * (N.H - 0.75))**2
    Source   DOOM_3
    Domain   one lobe, whatever the alpha: meant for (N.H)**16, alpha = 4, from which it is 0.21 off; nearest to
             (N.H)**10.56, alpha = 2.64, within 0.058. Exactly 0 from 41.4 degrees of N.H on
    """
    return elementary.squared(1.0 - 4.0 * cosine_deficit, 1)


SPEC = Approximation(
    name="doom3",
    title="Doom 3",
    kind="alternative",
    formula="max(0, 4 (N.H - 0.75))^2, whatever the alpha: Lyon with gamma 2 and beta 4",
    source=DOOM_3,
    kernel=doom3,
    coefficients=lambda s: {},
    domain="one fixed lobe, nearest to Phong at alpha 2.64, within 0.058; at alpha 4, for which it is meant, 0.21 off",
    cost=Cost("one fused multiply-add, one maximum, one squaring", multiplies=1),
    lambda_forms=("dot",),
    spaces=("half",),
    cutoff=lambda s: 0.25,
    at_zero=lambda s: "its lobe is the same at every alpha",
    falls=True,
)
