"""Cells as the arrays that compiled loops take: made once, passed over by every piece of pairs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from phongbench.accuracy.accumulators import ErrorAccumulator
from phongbench.accuracy.coordinates import Piece, coordinate_row, gate_row
from phongbench.accuracy.reductions import measure_cells
from phongbench.compiler.lowering import Precision
from phongbench.compiler.precisions import Array
from phongbench.formulas.kernel import Kernel
from phongbench.formulas.spec import MAX_COEFFICIENTS
from phongbench.inputs.plan import Cell


@dataclass(frozen=True)
class CellArrays:
    """Cells of one precision, ready to be measured; the rows of their errors follow their order.

    alphas             their exponents, each once: what the exact values of a piece are of, in this order
    truths             1 (angle) or 2 (angle, given): a cell's truths are consecutive rows of its errors
    rows               int64 (cells, 8): coordinate row, gate row, position in alphas, first row of the errors,
                       addresses of the loops in the working precision and in float64, where the table begins and ends
    coefficients..64   (cells, MAX_COEFFICIENTS) in the working precision and in float64
    tables..64         (entries,) likewise, those of the cells one after the other
    """

    alphas: tuple[float, ...]
    truths: int
    rows: Array
    coefficients: Array
    coefficients_64: Array
    tables: Array
    tables_64: Array

    @classmethod
    def of(cls, cells: Sequence[tuple[Cell, Kernel, Kernel]], precision: Precision, truths: int) -> "CellArrays":
        """The arrays of these cells, each with its kernels in the working precision and in float64."""
        alphas = tuple(dict.fromkeys(cell.alpha for cell, _, _ in cells))
        ends = np.cumsum([0] + [len(kernel.table) for _, kernel, _ in cells])
        rows = [
            (
                coordinate_row(cell),
                gate_row(cell),
                alphas.index(cell.alpha),
                i * truths,
                kernel.address,
                kernel_64.address,
                ends[i],
                ends[i + 1],
            )
            for i, (cell, kernel, kernel_64) in enumerate(cells)
        ]
        kernels, kernels_64 = [k for _, k, _ in cells], [k for _, _, k in cells]
        return cls(
            alphas,
            truths,
            np.array(rows, np.int64).reshape(len(rows), 8),
            _stacked([k.coefficients for k in kernels], precision.carrier),
            _stacked([k.coefficients for k in kernels_64], np.float64),
            np.concatenate([np.empty(0, precision.carrier), *(k.table for k in kernels)]),
            np.concatenate([np.empty(0), *(k.table for k in kernels_64)]),
        )

    def measure(self, piece: Piece, errors: ErrorAccumulator) -> None:
        """Add the errors of all cells over one piece, whose exact values are of our alphas."""
        measure_cells(
            self.rows,
            self.coefficients,
            self.coefficients_64,
            self.tables,
            self.tables_64,
            *piece,
            errors.sums,
            errors.counts,
            errors.bins,
            errors.worst,
            self.truths,
        )
        errors.samples += piece.a.shape[1]


def _stacked(rows: Sequence[Array], dtype: np.typing.DTypeLike) -> Array:
    """Coefficients below one another, padded with zeros."""
    stacked = np.zeros((len(rows), MAX_COEFFICIENTS), dtype)
    for target, row in zip(stacked, rows, strict=True):
        target[: len(row)] = row
    return stacked
