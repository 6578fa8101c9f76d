"""Cells as the arrays that `measure.measure_cells` takes: made once, passed over by every piece of pairs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT64, Precision
from phongbench.compiler.precisions import Array
from phongbench.formulas import coordinate_kernels
from phongbench.formulas.kernel import coefficient_row, known_values, table_row
from phongbench.formulas.spec import MAX_COEFFICIENTS, Approximation
from phongbench.inputs.plan import Cell


@dataclass(frozen=True)
class CellArrays:
    """What the compiled loops need to know of some cells; see `measure_cells` for the columns."""

    rows: Array
    coefficients: Array
    coefficients_64: Array
    tables: Array
    tables_64: Array

    @staticmethod
    def of(
        chosen: Sequence[tuple[Cell, Approximation]], alphas: Sequence[float], precision: Precision, truths: int
    ) -> "CellArrays":
        """The arrays of these cells; the rows of their errors follow the same order, each cell's truths together.

        alphas     the exponents that the exact values are given for, in that order
        precision  the working precision
        truths     1 or 2
        """
        tables = [table_row(spec, cell.setting, FLOAT64) for cell, spec in chosen]
        rows = np.empty((len(chosen), 7), np.int64)
        for i, (cell, spec) in enumerate(chosen):
            known = known_values(spec, cell.setting)
            rows[i] = (
                coordinate_kernels.FORM_ROW.get(cell.lambda_form, coordinate_kernels.COSINE_ROW),
                coordinate_kernels.COSINE_ROW if cell.gated else coordinate_kernels.OPEN_ROW,
                alphas.index(cell.alpha),
                i * truths,
                jit.address(coordinate_kernels.values_kernel(spec, precision, known)),
                jit.address(coordinate_kernels.values_kernel(spec, FLOAT64, known)),
                len(tables[i]),
            )
        padded = np.zeros((len(chosen), max((len(t) for t in tables), default=1)))
        for i, table in enumerate(tables):
            padded[i, : len(table)] = table
        return CellArrays(
            rows, _stacked(precision, chosen), _stacked(FLOAT64, chosen), precision.rounded(padded), padded
        )


def _stacked(precision: Precision, chosen: Sequence[tuple[Cell, Approximation]]) -> Array:
    rows = [coefficient_row(spec, cell.setting, precision) for cell, spec in chosen]
    return np.array(rows, precision.carrier).reshape(len(rows), MAX_COEFFICIENTS)
