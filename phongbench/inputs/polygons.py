"""Polygons cut into triangles: fans where these fit, ears elsewhere, so that a notch stays open."""

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler.precisions import Array
from phongbench.inputs import ears

#: a fan is tried from this many corners before ears are cut
_FANS = 8
#: share of the polygon's squared size below which an area counts as none
_FLAT = 1e-15


def triangles(places: Array, sizes: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64], int]:
    """The triangles of polygons, in the polygons' order and sense of rotation.

    places   float64 (k, 3)  the corners of all polygons, one polygon after the other
    sizes    int64 (m,)      corners of each polygon, at least 3
    returns  int64 (t, 3) indices of corners; int64 (t,) the polygon of each triangle; and the number of polygons that
             cross themselves, which are cut into fans
    """
    first = np.cumsum(sizes) - sizes
    parts, owners, crossing = [], [], 0
    for size in np.unique(sizes).tolist():
        polygons = np.flatnonzero(sizes == size)
        corners = first[polygons, None] + np.arange(size)
        fans = np.arange(size - 2)[:, None] * (0, 1, 1) + (0, 1, 2)
        chosen = corners[:, fans]
        left = np.arange(len(polygons)) if size > 3 else np.empty(0, np.int64)
        for start in range(min(size, _FANS)):
            candidates = corners[left][:, (fans + start) % size]
            fits = _fits(places, corners[left], candidates)
            chosen[left[fits]] = candidates[fits]
            left = left[~fits]
            if not len(left):
                break
        for polygon in left:
            ears = _ears(places[corners[polygon]])
            crossing += ears is None
            if ears is not None:
                chosen[polygon] = corners[polygon][np.array(ears)]
        parts.append(chosen.reshape(-1, 3))
        owners.append(np.repeat(polygons, size - 2))
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(parts)[order], owner[order], crossing


def _fits(places: Array, polygons: NDArray[np.int64], fans: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(m,) whether all triangles of a fan turn the way the polygon does: then they cover it once."""
    normal = _twice_areas(places, polygons[:, None, :]).sum(axis=1)
    areas = np.einsum("mtk,mk->mt", _twice_areas(places, fans), normal)
    return np.asarray((areas > _FLAT * (normal**2).sum(axis=1)[:, None]).all(axis=1))


def _twice_areas(places: Array, polygons: NDArray[np.int64]) -> Array:
    """(m, t, 3) normals of polygons (m, t, n), as long as twice their areas."""
    arms = places[polygons[..., 1:]] - places[polygons[..., :1]]
    return np.asarray(np.cross(arms[..., :-1, :], arms[..., 1:, :]).sum(axis=-2))


def _ears(places: Array) -> list[tuple[int, int, int]] | None:
    """The n - 2 triangles of a polygon's (n, 3) corners by cutting ears off; None if it crosses itself."""
    x, y = _projected(places).T.tolist()
    return ears.cut(x, y, max(max(x) - min(x), max(y) - min(y)) ** 2 * _FLAT)


def _projected(places: Array) -> Array:
    """(n, 2) corners seen along the axis that the polygon faces most, counter-clockwise."""
    arms = places - places[0]
    normal = np.cross(arms[:-1], arms[1:]).sum(axis=0)
    size = np.ptp(arms, axis=0)
    # what crosses itself may face nowhere, and then lies in the plane across its least extent
    axis = int(np.abs(normal).argmax() if np.abs(normal).max() > _FLAT * size.max() ** 2 else size.argmin())
    kept = [(axis + 1) % 3, (axis + 2) % 3]
    return np.asarray(arms[:, kept if normal[axis] >= 0 else kept[::-1]])
