"""Compiled rays: many at once against every sphere and plane, and those that surfaces reflect.

A wavefront is float32 rows, one for each component: loops run over rays, so that they vectorise. Spheres and planes are
solved here, for all rays against one object at a time; triangles are Embree's. Lengths are those of eye space.
"""

from typing import Any

import numpy as np

from phongbench.compiler import intrinsics, jit
from phongbench.compiler.precisions import Array

#: distance of what no ray hits
FAR = np.float32(np.inf)
_ZERO, _ONE, _TWO = np.float32(0), np.float32(1), np.float32(2)
#: a slope or a squared length, both without unit, that stands for 0
_TINY = np.float32(1e-20)

select, put = intrinsics.select, intrinsics.put


@jit.driver
def nearest(rays: Array, count: int, solids: Any, hits: Any) -> None:
    """The nearest sphere or plane of each ray.

    rays    float32 (6, capacity)  origin, unit direction
    solids  spheres  float32 (8, s)   as in Geometry
            planes   float32 (4, p)   unit normal n and c: n.x = c
            names    int32 (s + p,)   the numbers of these objects in the scene
    hits    t        float32 (capacity,)  out: distance, FAR where nothing is hit
            which    int32 (capacity,)    out: number of the object, or -1
            spare    float32 (capacity,)  scratch
    """
    spheres, planes, names = solids
    t, which, spare = hits
    ox, oy, oz, dx, dy, dz = rays[0], rays[1], rays[2], rays[3], rays[4], rays[5]
    for i in range(count):
        t[i] = FAR
        which[i] = -1
    for s in range(spheres.shape[1]):
        cx, cy, cz, r = spheres[0, s], spheres[1, s], spheres[2, s], spheres[3, s]
        if _is_near(spheres, s):
            mx, my, mz, power, bend = spheres[4, s], spheres[5, s], spheres[6, s], spheres[7, s], _ONE / r
            for i in range(count):
                put(spare, i, _near_sphere(ox[i], oy[i], oz[i], dx[i], dy[i], dz[i], mx, my, mz, power, bend, r))
        else:
            for i in range(count):
                put(spare, i, _far_sphere(ox[i] - cx, oy[i] - cy, oz[i] - cz, dx[i], dy[i], dz[i], r))
        _keep(count, names[s], spare, t, which)
    for p in range(planes.shape[1]):
        nx, ny, nz, c = planes[0, p], planes[1, p], planes[2, p], planes[3, p]
        for i in range(count):
            put(spare, i, _plane(c - (nx * ox[i] + ny * oy[i] + nz * oz[i]), nx * dx[i] + ny * dy[i] + nz * dz[i]))
        _keep(count, names[spheres.shape[1] + p], spare, t, which)


@jit.inline
def _keep(count: Any, number: Any, distance: Array, t: Array, which: Array) -> None:
    """Take over what is nearer."""
    for i in range(count):
        nearer = distance[i] < t[i]
        put(which, i, select(nearer, number, which[i]))
        put(t, i, select(nearer, distance[i], t[i]))


@jit.inline
def _is_near(spheres: Array, s: Any) -> Any:
    """Whether the camera is within a radius of a sphere: then what it sees of it may be a small part."""
    mx, my, mz = spheres[4, s], spheres[5, s], spheres[6, s]
    return mx * mx + my * my + mz * mz < _TWO * _TWO


@jit.inline
def _far_sphere(fx: Any, fy: Any, fz: Any, dx: Any, dy: Any, dz: Any, r: Any) -> Any:
    """Distance along a unit direction d, from f relative to the centre, to a sphere; FAR where it is missed.

    The discriminant is taken from the ray's point nearest to the centre: b^2 - c, the textbook form, cancels in float32
    for a small sphere far away. Right to a few roundings of the distance of f, and of the camera, from the centre.
    """
    b = fx * dx + fy * dy + fz * dz
    px, py, pz = fx - b * dx, fy - b * dy, fz - b * dz
    beyond = r * r - (px * px + py * py + pz * pz)
    half = np.sqrt(select(beyond > _ZERO, beyond, _ZERO))
    near, far = -b - half, half - b
    t = select(near > _ZERO, near, far)
    return select((beyond > _ZERO) & (t > _ZERO), t, FAR)


@jit.inline
def _near_sphere(
    ox: Any, oy: Any, oz: Any, dx: Any, dy: Any, dz: Any, mx: Any, my: Any, mz: Any, power: Any, bend: Any, r: Any
) -> Any:
    """The same for a sphere that is large beside its distance from the camera, as a ground is; o is a place.

    m, power  -c / r and (|c|^2 - r^2) / r of its centre c; bend is 1 / r

    F = (|o - c|^2 - r^2) / r = power + 2 o.m + |o|^2 / r needs no number of the size of r^2, and becomes a plane's
    height as r grows. With the cosine B = d.(o - c) / r the roots are r (-B -+ root(B^2 - F / r)); the smaller one is
    taken as F over the larger, since the difference would cancel (Vieta; Press et al., Numerical Recipes, 5.6).
    Where o is far outside, the discriminant is that of `_far_sphere`. Right to a few roundings of |o|.
    """
    ux, uy, uz = mx + bend * ox, my + bend * oy, mz + bend * oz
    height = power + (ox * (ux + mx) + oy * (uy + my) + oz * (uz + mz))
    b = ux * dx + uy * dy + uz * dz
    px, py, pz = ux - b * dx, uy - b * dy, uz - b * dz
    beyond = select(height * bend < _ONE, b * b - height * bend, _ONE - (px * px + py * py + pz * pz))
    larger = np.abs(b) + np.sqrt(select(beyond > _ZERO, beyond, _ZERO))
    t = select((b < _ZERO) & (height <= _ZERO), larger * r, np.abs(height) / larger)
    return select((beyond > _ZERO) & ((b < _ZERO) | (height < _ZERO)), t, FAR)


@jit.inline
def _plane(height: Any, slope: Any) -> Any:
    """Distance to a plane that is `height` away along its normal, approached with `slope`; FAR where it is missed."""
    t = height / select(np.abs(slope) > _TINY, slope, _TINY)
    return select(t > _ZERO, t, FAR)


@jit.driver
def reflect(surface: Any, first: int, count: int, share: Any, least: Any, here: Any, ahead: Any, filled: int) -> int:
    """Append the reflected rays of a group to the next wavefront; returns how many that then has.

    surface      of `gather`
    share        float32  k, the weight that a reflection keeps
    least        float32  rays whose accumulated weight would be below are left out
    here, ahead  rays, weights and pixels of this wavefront and of the next, which has `filled` rays so far
    """
    _, starts, normals, seen, ray_of = surface
    _, weights, pixels = here
    rays, new_weights, new_pixels = ahead
    for i in range(first, first + count):
        ray = ray_of[i]
        weight = share * weights[ray]
        if weight >= least:
            nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
            vx, vy, vz = seen[i, 0], seen[i, 1], seen[i, 2]
            # along 2 (N.V) N - (N.N) V, which no normal is too short for; scaled, or its length would drift from 1
            twice, square = _TWO * (nx * vx + ny * vy + nz * vz), nx * nx + ny * ny + nz * nz
            x, y, z = twice * nx - square * vx, twice * ny - square * vy, twice * nz - square * vz
            scale = _ONE / np.sqrt(x * x + y * y + z * z + _TINY)
            rays[0, filled], rays[1, filled], rays[2, filled] = starts[i, 0], starts[i, 1], starts[i, 2]
            rays[3, filled], rays[4, filled], rays[5, filled] = x * scale, y * scale, z * scale
            new_weights[filled] = weight
            new_pixels[filled] = pixels[ray]
            filled += 1
    return filled
