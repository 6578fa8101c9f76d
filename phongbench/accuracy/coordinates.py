"""Pieces of pairs laid out for the sweep's loops: coordinates in three renderings, and the exact values."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT64, Precision
from phongbench.compiler.precisions import Array
from phongbench.formulas import coordinate_kernels
from phongbench.formulas.coordinate_kernels import coordinates_at
from phongbench.formulas.exact import truth_at, truth_kernel


class Layout:
    """The arrays that pieces of pairs are laid out in, allocated once.

    precision  Precision      of the coordinates `held`
    space      str            reflect, or half: what the exact values are of
    truths     int            1 for the truth `angle` alone, 2 for `given` as well
    alphas     floats         exponents of the exact values
    size       int            pairs in a piece; the last one may be shorter
    """

    def __init__(self, precision: Precision, space: str, truths: int, alphas: Sequence[float], size: int) -> None:
        rows = coordinate_kernels.COORDINATE_ROWS
        self.alphas = np.array(alphas)
        loops = (coordinate_kernels.coordinates_kernel(precision), coordinate_kernels.coordinates_kernel(FLOAT64))
        self.addresses = np.array([jit.address(k) for k in (*loops, truth_kernel(space == "half", truths == 2))])
        self.held = np.empty((rows, size), precision.carrier)
        self.given, self.unit = np.empty((rows, size)), np.empty((rows, size))
        self.a, self.b = np.empty((3, size)), np.empty((3, size))
        self.exact = np.empty((len(alphas), 2, size))

    def lay_out(self, a: Array, b: Array) -> tuple[Array, Array, Array, Array]:
        """(held, given, unit, exact) of these pairs, views of our arrays that the next call overwrites.

        a, b     (3, n)                   in the precision's carrier
        held     (COORDINATE_ROWS, n)     coordinates in the working precision
        given    the same                 in float64, of the vectors as they are
        unit     the same                 in float64, of their directions
        exact    (alphas, 2, n) float64   the truths `angle` and, if asked for, `given`
        """
        if a.shape[1] != self.held.shape[1]:  # the last, shorter piece
            size = a.shape[1]
            self.held, self.given, self.unit = (
                np.ascontiguousarray(x[:, :size]) for x in (self.held, self.given, self.unit)
            )
            self.a, self.b = np.ascontiguousarray(self.a[:, :size]), np.ascontiguousarray(self.b[:, :size])
            self.exact = np.ascontiguousarray(self.exact[:, :, :size])
        _lay_out(self.addresses, self.alphas, a, b, self.a, self.b, self.held, self.given, self.unit, self.exact)
        return self.held, self.given, self.unit, self.exact


@jit.driver
def _lay_out(
    addresses: Any, alphas: Any, a: Any, b: Any, a64: Any, b64: Any, held: Any, given: Any, unit: Any, exact: Any
) -> None:
    """Coordinates of the pairs in the working precision, in float64 as given and as unit directions.

    Then the exact values.
    """
    coordinates_64, truth = coordinates_at(addresses[1], a64), truth_at(addresses[2], a64)
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
    coordinates_64(a64, b64, unit)
    for k in range(len(alphas)):
        truth(unit[1], given[4], alphas[k : k + 1], exact[k, 0], exact[k, 1])
