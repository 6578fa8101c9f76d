"""The table of fixed-function OpenGL: Phong at 256 equally spaced cosines, and straight lines between them."""

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler import elementary
from phongbench.compiler.lowering import Table
from phongbench.formulas.citations import MESA_TABLE
from phongbench.formulas.spec import Approximation, Cost, Setting

ENTRIES = 256


def table_x(cosine: float, table: Table) -> float:
    """Phong's term from a table over the cosine.

    cosine   float                a.b; outside [0, 1] the nearest end is taken, and NaN counts as 0
    table    float array (256,)   (i / 255) ** alpha
    returns  float                highlight factor in [0, 1]

    Formula  linear interpolation of max(0, cosine) ** alpha between multiples of 1/255
    Source   MESA_TABLE
    Domain   too bright by about alpha * (alpha - 1) / (8 * 255**2): fine below alpha = 40, useless above 200; one table
             per alpha
    """
    return elementary.interpolated(table, (ENTRIES - 1) * cosine)


def entries(setting: Setting) -> NDArray[np.float64]:
    """The 256 entries for an alpha; the first is 0 at alpha 0 too, or light would leak behind the surface."""
    table = np.linspace(0.0, 1.0, ENTRIES) ** setting.alpha
    table[0] = 0.0
    return np.asarray(table)


SPEC = Approximation(
    name="table-x",
    title="Table over the cosine",
    kind="approximation",
    formula="linear interpolation of x^alpha between 256 cosines",
    source=MESA_TABLE,
    kernel=table_x,
    coefficients=lambda s: {},
    domain="alpha up to about 40; the error grows like alpha^2, to 0.02 at 100 and 0.4 at 1000",
    cost=Cost("one multiplication, clamping, one conversion, one fused multiply-add", multiplies=1, lookups=2),
    lambda_forms=("none",),
    table=entries,
    at_zero=lambda s: None,
    falls=True,
)
