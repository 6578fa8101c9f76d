"""Heights of a surface from its normals: the surface whose slopes are nearest to theirs, inside a mask.

The sum over neighbouring pixels of (height difference - mean slope of the two)^2 is least where a sparse Poisson
equation holds. Heights are towards the viewer, a pixel is 1 wide, x to the right and y up while rows go down. They are
known up to a constant in each connected part of the mask: here its mean is 0.

Source  Horn and Brooks 1986; Queau, Durou and Aujol 2018 survey the methods
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError

#: normals that are turned further from the viewer than this slope are the surface's edge
STEEPEST = 100.0


def integrate(normals: Array, mask: Array | None = None) -> Array:
    """Heights (h, w) of normals (h, w, 3); NaN outside the mask, where normals are NaN, and at edges.

    mask  (h, w) bool | None  parts that do not touch are integrated by themselves: cut it where the surface breaks
    """
    normals = np.asarray(normals, np.float64)
    if normals.ndim != 3 or normals.shape[2] != 3:
        raise InputError(f"normals of shape {normals.shape}", "normals", "give (height, width, 3)")
    with np.errstate(invalid="ignore"):
        across = np.hypot(normals[..., 0], normals[..., 1])
        inside = np.isfinite(normals).all(axis=2) & (across < STEEPEST * normals[..., 2])
    if mask is not None:
        if np.shape(mask) != inside.shape:
            raise InputError(f"a mask of shape {np.shape(mask)}", "mask", f"give {inside.shape}")
        inside &= np.asarray(mask, bool)
    heights = np.full(inside.shape, np.nan)
    heights[inside] = _solved(normals, inside)
    return heights


def _solved(normals: Array, inside: Array) -> Array:
    """Heights of the pixels inside, in the order of rows."""
    from scipy.sparse import coo_array, csc_array
    from scipy.sparse.csgraph import connected_components
    from scipy.sparse.linalg import spsolve

    count = int(inside.sum())
    if not count:
        return np.zeros(0)
    numbers = np.full(inside.shape, -1)
    numbers[inside] = np.arange(count)
    with np.errstate(invalid="ignore", divide="ignore"):
        slopes = -normals[..., :2] / normals[..., 2:]
    rightwards = _differences(numbers, slopes[..., 0], (slice(None), slice(None, -1)), (slice(None), slice(1, None)))
    upwards = _differences(numbers, slopes[..., 1], (slice(1, None), slice(None)), (slice(None, -1), slice(None)))
    one, other, rise = (np.concatenate(parts) for parts in zip(rightwards, upwards, strict=True))
    link = np.ones(len(one))
    links = coo_array((link, (one, other)), shape=(count, count))
    degree = np.bincount(one, minlength=count) + np.bincount(other, minlength=count)
    right = np.bincount(other, rise, count) - np.bincount(one, rise, count)
    _, parts = connected_components(links, directed=False)
    first = np.unique(parts, return_index=True)[1]
    diagonal = degree.astype(np.float64)
    diagonal[first] += 1.0  # holds one pixel of each part; its equation then says that this pixel's height is 0
    places = np.arange(count)
    entries = (np.concatenate([diagonal, -link, -link]), _pairs(places, one, other))
    matrix = csc_array(coo_array(entries, shape=(count, count)))
    found = spsolve(matrix, right, permc_spec="MMD_AT_PLUS_A")
    return np.asarray(found - (np.bincount(parts, found) / np.bincount(parts))[parts])


def _pairs(places: Array, one: Array, other: Array) -> tuple[Array, Array]:
    return np.concatenate([places, one, other]), np.concatenate([places, other, one])


def _differences(numbers: Array, slopes: Array, first: Any, second: Any) -> Sequence[Array]:
    """Neighbours inside the mask: numbers of both, and the rise from the first to the second."""
    both = (numbers[first] >= 0) & (numbers[second] >= 0)
    return numbers[first][both], numbers[second][both], (slopes[first][both] + slopes[second][both]) / 2
