"""Compiled shadow rays: which points see which light past spheres and planes."""

from typing import Any

import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.precisions import Array
from phongbench.scenes.ray_kernels import FAR, nearest

#: share of its terms' sizes that a cosine or a squared distance may be wrong by
ROUNDING = np.float32(1e-5)
#: share of its distance that a light is taken to be nearer: a lamp on a surface is not hidden by it
SHORT = np.float32(1 - 2.0**-16)
_ZERO, _ONE = np.float32(0), np.float32(1)


@jit.driver
def shadow_rays(surface: Any, light: Array, far: bool, reach: Any, rays: Array, limit: Array, point_of: Array) -> int:
    """Rays from the points that a light can light at all towards it; returns how many.

    surface   points, starts, normals  float32 (n, 3)  of `gather`
    light     float32 (3,) or more where it is, or, if `far`, the unit direction towards it
    reach     float32              how far it shines; negative: rays from all points
    rays      float32 (6, n)       out: origin, a little above the surface, and unit direction
    limit     float32 (n,)         out: how near a thing must be to hide the light
    point_of  int32 (n,)           out: the point each ray comes from
    """
    points, starts, normals = surface
    count = 0
    for i in range(len(points)):
        lx, ly, lz = light[0], light[1], light[2]
        if not far:
            lx, ly, lz = lx - points[i, 0], ly - points[i, 1], lz - points[i, 2]
        squared = lx * lx + ly * ly + lz * lz
        px, py, pz = lx * normals[i, 0], ly * normals[i, 1], lz * normals[i, 2]
        # the shading rounds elsewhere: what is nearly behind, or nearly out of reach, counts as lit
        faces = px + py + pz > -ROUNDING * (np.abs(px) + np.abs(py) + np.abs(pz))
        within = far or squared <= reach * reach * (_ONE + ROUNDING)
        if reach < _ZERO or (within and faces):
            x, y, z = starts[i, 0], starts[i, 1], starts[i, 2]
            limit[count] = FAR
            if not far:
                lx, ly, lz = light[0] - x, light[1] - y, light[2] - z
                distance = np.sqrt(lx * lx + ly * ly + lz * lz)
                scale = _ONE / distance if distance > _ZERO else _ZERO
                lx, ly, lz = lx * scale, ly * scale, lz * scale
                limit[count] = SHORT * distance
            rays[0, count], rays[1, count], rays[2, count] = x, y, z
            rays[3, count], rays[4, count], rays[5, count] = lx, ly, lz
            point_of[count] = i
            count += 1
    return count


@jit.driver
def hide(t: Array, limit: Array, point_of: Array, count: int, visible: Array) -> None:
    """Which points see a light: all but those whose shadow ray hits something, at t, nearer than its limit.

    visible  bool (n,)  out
    """
    for i in range(len(visible)):
        visible[i] = True
    for i in range(count):
        visible[point_of[i]] = t[i] >= limit[i]


@jit.driver
def shadows(surface: Any, lights: Array, spans: Array, wave: Any, solids: Any, hits: Any, visible: Array) -> int:
    """Which points see which light past spheres and planes; returns how many rays that took.

    surface       points, starts and normals of shadow_rays
    lights        float32 (l, 4)  place or unit direction of each, and 1 if it is far away
    spans         float32 (l,)    `reach` of shadow_rays for each
    wave          rays, limit and point_of of shadow_rays
    solids, hits  of nearest
    visible       bool (l, n)     out
    One call for all lights: a call costs some microseconds.
    """
    rays, limit, point_of = wave
    total = 0
    for k in range(len(lights)):
        count = shadow_rays(surface, lights[k], lights[k, 3] > _ZERO, spans[k], rays, limit, point_of)
        nearest(rays, count, solids, hits)
        hide(hits[0], limit, point_of, count, visible[k])
        total += count
    return total
