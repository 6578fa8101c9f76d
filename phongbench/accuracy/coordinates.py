"""Pieces of pairs laid out for the loops of cells: coordinates in three renderings, and the exact values."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from phongbench.accuracy.batches import Batch
from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT64, Precision
from phongbench.compiler.precisions import Array
from phongbench.formulas.coordinate_kernels import (
    COORDINATE_ROWS,
    COSINE_ROW,
    FORM_ROW,
    OPEN_ROW,
    coordinates,
    coordinates_at,
    coordinates_kernel,
)
from phongbench.formulas.exact import of_deficits, truth_at, truth_kernel
from phongbench.formulas.recipes import PAIR
from phongbench.inputs.plan import Cell


class Piece(NamedTuple):
    """Pairs measured together, with all that a cell may ask of them.

    a, b   (3, n)                   in the precision's carrier
    held   (COORDINATE_ROWS, n)     coordinates in the working precision
    given  the same                 in float64, of the vectors as they are
    unit   the same                 in float64, of their directions
    exact  (alphas, 2, n) float64   the truths `angle` and, if asked for, `given`
    """

    a: Array
    b: Array
    held: Array
    given: Array
    unit: Array
    exact: Array

    @classmethod
    def of(cls, precision: Precision, a: Array, b: Array, exact: Array, unit: Array | None = None) -> "Piece":
        """The pairs with their coordinates; those of the directions are the same if they are not given."""
        given = coordinates(FLOAT64, a.astype(np.float64), b.astype(np.float64))
        return cls(a, b, coordinates(precision, a, b), given, given if unit is None else unit, exact)

    @classmethod
    def of_cosines(cls, precision: Precision, x: Array, alphas: Sequence[float], half_space: bool) -> "Piece":
        """Pairs (1, 0, 0), (x, 0, 0), whose product is x without rounding; the truth is of the angle that x names."""
        a, b = np.zeros((3, len(x)), x.dtype), np.zeros((3, len(x)), x.dtype)
        a[0], b[0] = 1, x
        piece = cls.of(precision, a, b, np.empty((len(alphas), 2, len(x))))
        for exact, alpha in zip(piece.exact, alphas, strict=True):
            exact[0] = of_deficits(piece.given[FORM_ROW["dot"]], alpha, half_space)
        return piece


def coordinate_row(cell: Cell) -> int:
    """The row of a coordinate block that the cell's formula is given: its lambda form's, or the cosine's."""
    return FORM_ROW.get(cell.lambda_form, COSINE_ROW)


def gate_row(cell: Cell) -> int:
    """The row of a coordinate block that opens the cell's gate."""
    return COSINE_ROW if cell.gated and not cell.formula.raw else OPEN_ROW


#: how what is left of the lengths of unit directions is removed: exactly, or a cheap root would change the truth
_EXACT_WAY = {"squared": "squared"}


class Layout:
    """The arrays that pieces of a batch's pairs are laid out in, allocated once.

    alphas  floats   exponents of the exact values
    size    int      pairs in a piece; the last one may be shorter
    """

    def __init__(self, batch: Batch, alphas: Sequence[float], size: int) -> None:
        self.alphas = np.array(alphas)
        way, recipe = batch.normalise, batch.recipe
        truth = truth_kernel(batch.half_space_truth, batch.truths == 2)
        loops = (
            coordinates_kernel(batch.precision, way, recipe),
            coordinates_kernel(FLOAT64, way, recipe),
            truth,
            coordinates_kernel(FLOAT64, _EXACT_WAY.get(way, "each") if batch.raw else "none", recipe),
        )
        self.fill = _lay_out if batch.recipe == PAIR else _lay_out_configurations
        self.addresses = np.array([jit.address(loop) for loop in loops])
        self.held = np.empty((COORDINATE_ROWS, size), batch.precision.carrier)
        self.given, self.unit = np.empty((COORDINATE_ROWS, size)), np.empty((COORDINATE_ROWS, size))
        self.a, self.b = np.empty((3, size)), np.empty((3 if batch.recipe == PAIR else 6, size))
        self.exact = np.empty((len(alphas), 2, size))

    def lay_out(self, a: Array, b: Array) -> Piece:
        """The piece of these pairs, as `Batch.pairs` gives them; the next call overwrites its arrays."""
        size = a.shape[1]
        if size != self.held.shape[1]:  # the last, shorter piece
            for name in ("held", "given", "unit", "a", "b", "exact"):
                setattr(self, name, np.ascontiguousarray(getattr(self, name)[..., :size]))
        self.fill(self.addresses, self.alphas, a, b, self.a, self.b, self.held, self.given, self.unit, self.exact)
        return Piece(a, b, self.held, self.given, self.unit, self.exact)


# ten arrays, for compiled code takes no objects
@jit.driver
def _lay_out(
    addresses: Any, alphas: Any, a: Any, b: Any, a64: Any, b64: Any, held: Any, given: Any, unit: Any, exact: Any
) -> None:
    """Coordinates of the pairs in the working precision, in float64 as given and as unit directions.

    Then the exact values.
    """
    coordinates_64, truth = coordinates_at(addresses[1], a64), truth_at(addresses[2], a64)
    of_unit = coordinates_at(addresses[3], a64)
    coordinates_at(addresses[0], a)(a, b, held)
    for row in range(3):
        for i in range(a.shape[1]):
            a64[row, i] = a[row, i]
            b64[row, i] = b[row, i]
    coordinates_64(a64, b64, given)
    for i in range(a.shape[1]):  # loops along rows, which vectorise; the block to be filled lends two of them
        unit[0, i] = 1.0 / np.sqrt(a64[0, i] * a64[0, i] + a64[1, i] * a64[1, i] + a64[2, i] * a64[2, i])
    for i in range(a.shape[1]):
        unit[1, i] = 1.0 / np.sqrt(b64[0, i] * b64[0, i] + b64[1, i] * b64[1, i] + b64[2, i] * b64[2, i])
    for row in range(3):
        for i in range(a.shape[1]):
            a64[row, i] *= unit[0, i]
        for i in range(a.shape[1]):
            b64[row, i] *= unit[1, i]
    of_unit(a64, b64, unit)
    for k in range(len(alphas)):
        truth(unit[1], given[4], alphas[k : k + 1], exact[k, 0], exact[k, 1])


@jit.driver
def _lay_out_configurations(
    addresses: Any, alphas: Any, n: Any, vl: Any, n64: Any, vl64: Any, held: Any, given: Any, unit: Any, exact: Any
) -> None:
    """The same of configurations: N, and V above L. The exact values are of the true mirror direction and V."""
    coordinates_64, of_unit = coordinates_at(addresses[1], n64), coordinates_at(addresses[3], n64)
    truth, count = truth_at(addresses[2], n64), n.shape[1]
    coordinates_at(addresses[0], n)(n, vl, held)
    for row in range(3):
        for i in range(count):
            n64[row, i] = n[row, i]
    for row in range(6):
        for i in range(count):
            vl64[row, i] = vl[row, i]
    coordinates_64(n64, vl64, given)
    _make_unit(n64)
    _make_unit(vl64[:3])
    _make_unit(vl64[3:])
    deficit = np.empty(count)
    for i in range(count):
        x, y, z, lx, ly, lz = n64[0, i], n64[1, i], n64[2, i], vl64[3, i], vl64[4, i], vl64[5, i]
        twice = 2.0 * (x * lx + y * ly + z * lz)
        dx, dy, dz = twice * x - lx - vl64[0, i], twice * y - ly - vl64[1, i], twice * z - lz - vl64[2, i]
        deficit[i] = 0.5 * (dx * dx + dy * dy + dz * dz)
    of_unit(n64, vl64, unit)
    for k in range(len(alphas)):
        truth(deficit, deficit, alphas[k : k + 1], exact[k, 0], exact[k, 1])


@jit.driver
def _make_unit(v: Any) -> None:
    for i in range(v.shape[1]):
        inverse = 1.0 / np.sqrt(v[0, i] * v[0, i] + v[1, i] * v[1, i] + v[2, i] * v[2, i])
        v[0, i] *= inverse
        v[1, i] *= inverse
        v[2, i] *= inverse
