"""One small table for every alpha: the highlight over u, alpha lambda with the logarithm's curvature put back."""

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler import elementary
from phongbench.compiler.lowering import Table
from phongbench.formulas.citations import PHONGBENCH
from phongbench.formulas.spec import Approximation, Cost, Setting

#: 64 steps over 0 <= u <= 7: the bend of exp(-u) within a step and the tail cut off at 7 then both cost 0.001
STEPS, REACH = 64, 7.0


def table_u(cosine_deficit: float, scale: float, bend: float, table: Table) -> float:
    """A highlight from one table shared by every alpha.

    cosine_deficit  float              lambda, about 1 - cos(angle); any of the lambda forms
    scale           float > 0          steps per lambda at the peak, alpha * 64 / 7
    bend            float > 0          steps per lambda**2, (alpha / 2 + 0.7) * 64 / 7
    table           float array (65,)  exp(-u) at u = 0, 7/64, ... 7, lowered a little to
                                       share a step's error; 1 at the peak, 0 at the end
    returns         float              highlight factor in [0, 1]

    Formula  linear interpolation of exp(-u), u = alpha * lambda + (alpha / 2 + 0.7) * lambda**2
    Source   PHONGBENCH
    Domain   within 0.0011 for alpha >= 14; 0.006 at 5, 0.11 at 1. Exactly 0 beyond u = 7; NaN gives 0, a negative
             lambda 1
    """
    position = cosine_deficit * (scale + bend * cosine_deficit)
    end = float(STEPS)
    return elementary.interpolated(table, position if position < end else end)


def entries(setting: Setting) -> NDArray[np.float64]:
    """The 65 entries; the setting changes nothing."""
    step = REACH / STEPS
    table = np.exp(-step * np.arange(STEPS + 1)) * (1.0 - step**2 / 12.0)
    table[0], table[-1] = 1.0, 0.0
    return np.asarray(table)


def coefficients(setting: Setting) -> dict[str, float]:
    """u is -alpha log(1 - lambda) = alpha (lambda + lambda^2 / 2 + ...); 0.7, found by search, stands for the rest."""
    per_u = STEPS / REACH
    return {"scale": setting.exponent * per_u, "bend": (setting.exponent / 2 + 0.7) * per_u}


def cutoff(setting: Setting) -> float:
    """The lambda at which u = 7."""
    linear, quadratic = setting.exponent, setting.exponent / 2 + 0.7
    return 2 * REACH / (linear + float(np.sqrt(linear**2 + 4 * quadratic * REACH)))


SPEC = Approximation(
    name="table-u",
    title="Table over u",
    kind="approximation",
    formula="linear interpolation of exp(-u), u = alpha lambda + (alpha/2 + 0.7) lambda^2, 65 entries for every alpha",
    source=PHONGBENCH,
    kernel=table_u,
    coefficients=coefficients,
    domain="alpha >= 14, error 0.0011 whatever the alpha; below that it grows, to 0.006 at 5 and 0.11 at 1",
    cost=Cost("one multiplication, two fused multiply-adds, clamping, one conversion", multiplies=1, lookups=2),
    cutoff=cutoff,
    table=entries,
    at_zero=lambda s: "its bend, fitted for high alpha, is then all there is of u",
    falls=True,
)
