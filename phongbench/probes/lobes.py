"""Values of single cells on chosen pairs, by the compiled loops of the sweep: what the probes of behaviour look at."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench import jit, kernels
from phongbench.kernels import coordinates_at, values_at
from phongbench.lowering import Precision, precision_named
from phongbench.plan import Cell
from phongbench.spec import Approximation, Setting

Array = NDArray[Any]


def coordinates(precision: Precision, a: Array, b: Array) -> Array:
    """The coordinate block of pairs of shape (3, n), which are rounded to the precision first."""
    held_a, held_b = (np.ascontiguousarray(precision.rounded(v)) for v in (a, b))
    block = np.empty((kernels.COORDINATE_ROWS, a.shape[1]), precision.carrier)
    _coordinates(jit.address(kernels.coordinates_kernel(precision)), held_a, held_b, block)
    return block


def values(spec: Approximation, cell: Cell, block: Array, setting: Setting | None = None) -> Array:
    """The cell's values on pairs with these coordinates, in its precision's carrier.

    setting  another than the cell's, which need not pass `spec.check`
    """
    setting, precision = setting or cell.setting, precision_named(cell.precision)
    out = np.empty(block.shape[1], block.dtype)
    kernel = kernels.values_kernel(spec, precision, kernels.known_values(spec, setting))
    with np.errstate(all="ignore"):  # infinite coefficients are what some settings ask for
        row, table = kernels.coefficient_row(spec, setting, precision), kernels.table_row(spec, setting, precision)
    form = kernels.FORM_ROW.get(cell.lambda_form, kernels.COSINE_ROW)
    gate = kernels.COSINE_ROW if cell.gated else kernels.OPEN_ROW
    _values(jit.address(kernel), block[form], block[gate], row, table, out)
    return out


def spread(cells: Sequence[Cell], wanted: Setting) -> list[int]:
    """Positions of one cell for each formula, form, space, precision and gating: the one nearest to a wanted setting.

    Nearest first in gamma, then in alpha, both by ratio; of equal ones the first.
    """
    nearest: dict[Any, tuple[tuple[float, float], int]] = {}
    for position, cell in enumerate(cells):
        key = (cell.approximation, cell.lambda_form, cell.setting.space, cell.precision, cell.gated)
        gamma, alpha = float(cell.setting.gamma or wanted.gamma or 1), cell.setting.alpha
        far = (abs(float(np.log(gamma / (wanted.gamma or 1)))), abs(float(np.log(alpha / wanted.alpha))))
        if key not in nearest or far < nearest[key][0]:
            nearest[key] = (far, position)
    return sorted(position for _, position in nearest.values())


@jit.driver
def _coordinates(address: int, a: Array, b: Array, out: Array) -> None:
    coordinates_at(address, a)(a, b, out)


@jit.driver
def _values(address: int, coordinate: Array, gate: Array, coefficients: Array, table: Array, out: Array) -> None:
    values_at(address, coordinate)(coordinate, gate, coefficients, table, out)
