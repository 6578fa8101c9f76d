"""Vectors made unit as shaders do it, in the working precision: the stratum `normalised`.

A raw vector of any length is multiplied by 1 / sqrt(v.v), or divided by sqrt(v.v), and v.v is summed with every product
rounded, or fused into its sum: of four pairs in a row each goes one of the four ways.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler.precisions import Precision
from phongbench.inputs.random_numbers import uniforms

#: raw vectors are so many times as long as unit ones, or shorter: squares then keep their digits in float16
LONGEST = 4.0
#: what is added to a seed for the lengths of raw vectors
_SEED = 0x0A11
WAYS = 4


def made_unit(
    precision: Precision, a: NDArray[Any], b: NDArray[Any], *, seed: int, start: int
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Unit vectors stretched to random lengths and made unit again; rounded only in fixed point, where none is short.

    a, b   (3, n) in the precision's carrier
    start  index of the first pair: it decides lengths and ways
    """
    if precision.saturates:
        return precision.rounded(a), precision.rounded(b)
    lengths = np.exp(math.log(LONGEST) * (2 * uniforms(seed + _SEED, start, a.shape[1], 2) - 1))
    return _unit(precision, a * lengths[0], start), _unit(precision, b * lengths[1], start + 1)


def _unit(precision: Precision, raw: NDArray[Any], start: int) -> NDArray[Any]:
    held = _rounded(precision, raw)
    for way in range(WAYS):
        part = slice((way - start) % WAYS, None, WAYS)
        v = held[:, part]
        root = _rounded(precision, np.sqrt(_square(precision, v, fused=way >= 2)))
        held[:, part] = _rounded(precision, v / root if way % 2 else v * _rounded(precision, 1.0 / root))
    return np.ascontiguousarray(held, dtype=precision.carrier)


def _square(precision: Precision, v: NDArray[np.float64], *, fused: bool) -> NDArray[np.float64]:
    """v.v, each product rounded before it is added, or with its sum."""
    total = _rounded(precision, v[0] * v[0])
    for row in v[1:]:
        product = row * row if fused else _rounded(precision, row * row)
        total = _rounded(precision, product + total)
    return total


def _rounded(precision: Precision, values: NDArray[Any]) -> NDArray[np.float64]:
    """In float64, whose own rounding is innocuous below: a product of two numbers of float32 is exact there."""
    return np.asarray(precision.rounded(values), np.float64)
