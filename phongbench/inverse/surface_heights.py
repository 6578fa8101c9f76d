"""Heights of a surface from its normals: the surface whose slopes are nearest to theirs, inside a mask.

The sum over neighbouring pixels of (height difference - mean slope of the two)^2 is least where a sparse Poisson
equation holds. Heights are towards the viewer, a pixel is 1 wide, x to the right and y up while rows go down. They are
known up to a constant in each connected part of the mask: here its mean is 0.

Source  Horn and Brooks 1986, Computer Vision, Graphics, and Image Processing 33(2); the methods are surveyed by Queau,
        Durou and Aujol 2018, Journal of Mathematical Imaging and Vision 60
"""

from collections.abc import Callable
from dataclasses import dataclass

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
    inside = usable(normals)
    if mask is not None:
        if np.shape(mask) != inside.shape:
            raise InputError(f"a mask of shape {np.shape(mask)}", "mask", f"give {inside.shape}")
        inside &= np.asarray(mask, bool)
    return HeightEquations.of(inside).heights(normals)


def usable(normals: Array) -> Array:
    """Where normals (h, w, 3) are known and face the viewer (h, w)."""
    with np.errstate(invalid="ignore"):
        across = np.hypot(normals[..., 0], normals[..., 1])
        return np.asarray(np.isfinite(normals).all(axis=2) & (across < STEEPEST * normals[..., 2]))


@dataclass(frozen=True, eq=False)
class HeightEquations:
    """The factorised equations of a mask, for any normals inside it.

    inside    (h, w)   the mask
    right     indices of neighbours in a row: (first, second), in the order of pixels inside
    up        indices of neighbours in a column, the lower one first
    parts     (n,)     which connected part a pixel belongs to
    solve     right side (n,) -> heights (n,)
    """

    inside: Array
    right: tuple[Array, Array]
    up: tuple[Array, Array]
    parts: Array
    solve: Callable[[Array], Array]

    @classmethod
    def of(cls, inside: Array) -> "HeightEquations":
        """The equations of a mask (h, w); a mask without pixels has none."""
        from scipy.sparse import coo_array, csc_array
        from scipy.sparse.csgraph import connected_components
        from scipy.sparse.linalg import splu

        count = int(inside.sum())
        numbers = np.full(inside.shape, -1)
        numbers[inside] = np.arange(count)
        right, up = _neighbours(numbers[:, :-1], numbers[:, 1:]), _neighbours(numbers[1:], numbers[:-1])
        if not count:
            return cls(inside, right, up, np.zeros(0, int), lambda side: side)
        one, other = (np.concatenate(both) for both in zip(right, up, strict=True))
        link = np.ones(len(one))
        parts = connected_components(coo_array((link, (one, other)), shape=(count, count)), directed=False)[1]
        diagonal = (np.bincount(one, minlength=count) + np.bincount(other, minlength=count)).astype(np.float64)
        # holds one pixel of each part: in the sum of all equations only its own height is left, so that is 0
        diagonal[np.unique(parts, return_index=True)[1]] += 1.0
        rows, columns = np.concatenate([one, other, np.arange(count)]), np.concatenate([other, one, np.arange(count)])
        entries = np.concatenate([-link, -link, diagonal])
        matrix = csc_array(coo_array((entries, (rows, columns)), shape=(count, count)))
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        return cls(inside, right, up, parts, factors.solve)

    def heights(self, normals: Array) -> Array:
        """Heights (h, w) of normals (h, w, 3) that are usable all over the mask; NaN outside it."""
        slopes = -normals[self.inside][:, :2] / normals[self.inside][:, 2:]
        side = np.zeros(len(slopes))
        for (one, other), slope in ((self.right, slopes[:, 0]), (self.up, slopes[:, 1])):
            rise = (slope[one] + slope[other]) / 2
            side += np.bincount(other, rise, len(side)) - np.bincount(one, rise, len(side))
        found = self.solve(side)
        heights = np.full(self.inside.shape, np.nan)
        if len(found):
            heights[self.inside] = found - (np.bincount(self.parts, found) / np.bincount(self.parts))[self.parts]
        return heights


def _neighbours(one: Array, other: Array) -> tuple[Array, Array]:
    """Numbers of neighbours that are both inside, which is not negative."""
    both = (one >= 0) & (other >= 0)
    return one[both], other[both]
