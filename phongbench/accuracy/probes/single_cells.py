"""Values of single cells on chosen pairs, by the compiled loops of the sweep: what the probes of behaviour look at."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from phongbench.accuracy.coordinates import coordinate_row, gate_row
from phongbench.compiler.lowering import Precision, precision_named
from phongbench.compiler.precisions import Array
from phongbench.formulas import coordinate_kernels
from phongbench.formulas.kernel import Kernel
from phongbench.formulas.spec import Approximation, Setting
from phongbench.inputs.plan import Cell


def coordinates(precision: Precision, a: Array, b: Array) -> Array:
    """The coordinate block of pairs of shape (3, n), which are rounded to the precision first."""
    return coordinate_kernels.coordinates(precision, *(np.ascontiguousarray(precision.rounded(v)) for v in (a, b)))


def values(spec: Approximation, cell: Cell, block: Array, setting: Setting | None = None) -> Array:
    """The cell's values on pairs with these coordinates, in its precision's carrier.

    setting  another than the cell's, which need not pass `spec.check`
    """
    with np.errstate(all="ignore"):  # infinite coefficients are what some settings ask for
        kernel = Kernel.of(spec, setting or cell.setting, precision_named(cell.precision))
    return values_of(kernel, cell, block)


def values_of(kernel: Kernel, cell: Cell, block: Array) -> Array:
    """The same of a kernel that is there: the cell's own, or one in the precision of the block."""
    return kernel.values(block[coordinate_row(cell)], block[gate_row(cell)])


def spread(cells: Sequence[Cell], wanted: Setting) -> list[int]:
    """Positions of one cell for each formula, form, space, precision and gating: the one nearest to a wanted setting.

    Formulas for raw vectors are left out. Nearest first in gamma, then in alpha, both by ratio; of equals the first.
    """
    nearest: dict[Any, tuple[tuple[float, float], int]] = {}
    for position, cell in enumerate(cells):
        if cell.formula.raw:
            continue
        key = (cell.approximation, cell.lambda_form, cell.formula.space, cell.precision, cell.gated)
        gamma, alpha = float(cell.formula.gamma or wanted.gamma or 1), cell.alpha
        far = (abs(float(np.log(gamma / (wanted.gamma or 1)))), abs(float(np.log(alpha / wanted.alpha))))
        if key not in nearest or far < nearest[key][0]:
            nearest[key] = (far, position)
    return sorted(position for _, position in nearest.values())
