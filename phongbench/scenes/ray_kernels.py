"""Compiled wavefronts: many rays at once against every object, then what they hit, sorted by material.

A wavefront is float32 rows, one for each component: loops run over rays, so that they vectorise. Spheres and planes are
solved here, for all rays against one object at a time; triangles are Embree's.
"""

from typing import Any

import numpy as np

from phongbench.compiler import intrinsics, jit
from phongbench.compiler.precisions import Array

#: how far along its normal a ray starts, as a share of the coordinates' size: beyond what float32 may be wrong by
LIFT = np.float32(4e-5)
#: distance of what no ray hits
FAR = np.float32(np.inf)
_ZERO, _ONE, _TWO = np.float32(0), np.float32(1), np.float32(2)
_TINY = np.float32(1e-20)

select, put = intrinsics.select, intrinsics.put


@jit.driver
def nearest(rays: Array, count: int, solids: Any, hits: Any) -> None:
    """The nearest sphere or plane of each ray.

    rays    float32 (6, capacity)  origin, unit direction
    solids  spheres  float32 (4, s)       centre, radius
            planes   float32 (4, p)       unit normal n and c: n.x = c
            names    int32 (s + p,)       the numbers of these objects in the scene
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
        for i in range(count):
            put(spare, i, _sphere(ox[i] - cx, oy[i] - cy, oz[i] - cz, dx[i], dy[i], dz[i], r))
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
def _sphere(fx: Any, fy: Any, fz: Any, dx: Any, dy: Any, dz: Any, r: Any) -> Any:
    """Distance along a unit direction d, from f relative to the centre, to a sphere; FAR where it is missed.

    The discriminant is taken from the ray's point nearest to the centre: b^2 - c, the textbook form, cancels in float32
    for a small sphere far away.
    """
    b = fx * dx + fy * dy + fz * dz
    px, py, pz = fx - b * dx, fy - b * dy, fz - b * dz
    beyond = r * r - (px * px + py * py + pz * pz)
    half = np.sqrt(select(beyond > _ZERO, beyond, _ZERO))
    near, far = -b - half, half - b
    t = select(near > _ZERO, near, far)
    return select((beyond > _ZERO) & (t > _ZERO), t, FAR)


@jit.inline
def _plane(height: Any, slope: Any) -> Any:
    """Distance to a plane that is `height` away along its normal, approached with `slope`; FAR where it is missed."""
    t = height / select(np.abs(slope) > _TINY, slope, _TINY)
    return select(t > _ZERO, t, FAR)


@jit.inline
def lifted(points: Array, normals: Array, i: Any) -> Any:
    """A little above the surface, so that a ray from there does not find it again."""
    x, y, z = points[i, 0], points[i, 1], points[i, 2]
    lift = LIFT * (np.abs(x) + np.abs(y) + np.abs(z) + _ONE)
    return x + lift * normals[i, 0], y + lift * normals[i, 1], z + lift * normals[i, 2]


@jit.driver
def sort(rays: Array, count: int, hits: Any, solids: Any, group: Array, sizes: Array) -> None:
    """The group of each ray: its material; after the materials, the same again for Gouraud's colours; then nothing hit.

    hits    t, which and uv, as `gather` takes them
    solids  the arrays of Geometry
    group   int32 (capacity,)  out
    sizes   int64 (2m + 1,)    out: how many are in each of them
    """
    t, which, _ = hits
    spheres, planes, boards, materials, _, _, modes = solids
    s, p = spheres.shape[1], planes.shape[1]
    sizes[:] = 0
    nothing = len(sizes) - 1
    for i in range(count):
        hit = which[i]
        if hit < 0:
            name = np.int32(nothing)
        elif hit < s:
            name = materials[hit, 0]
        elif hit < s + p:
            k = hit - s
            x, y, z = rays[0, i] + t[i] * rays[3, i], rays[1, i] + t[i] * rays[4, i], rays[2, i] + t[i] * rays[5, i]
            u = np.floor(boards[0, k] * x + boards[1, k] * y + boards[2, k] * z - boards[6, k])
            v = np.floor(boards[3, k] * x + boards[4, k] * y + boards[5, k] * z - boards[7, k])
            odd = (u + v) - _TWO * np.floor((u + v) / _TWO)
            name = materials[hit, 1] if odd == _ONE else materials[hit, 0]
        elif modes[hit - s - p] == 3:
            name = np.int32(nothing // 2 + materials[hit, 0])
        else:
            name = materials[hit, 0]
        group[i] = name
        sizes[name] += 1


@jit.driver
def gather(rays: Array, count: int, hits: Any, solids: Any, group: Array, starts: Array, surface: Any) -> None:
    """What the rays hit, each group's together.

    hits     t and which of `nearest`, and
             uv       float32 (2, capacity)  weights of a triangle's second and third corner; read where one is hit
    solids   the arrays of Geometry
    starts   int64 (2m + 1,)  in: where each group begins; out: where it ends
    surface  points   float32 (capacity, 3)  out: the point
             normals  float32 (capacity, 3)  out: the shading normal there, on the side of the ray
             seen     float32 (capacity, 3)  out: the unit direction to where the ray came from
             ray_of   int32 (capacity,)      out: the ray that hit it
    """
    t, which, uv = hits
    spheres, planes, _, _, corners, vertex_normals, modes = solids
    points, normals, seen, ray_of = surface
    s, p = spheres.shape[1], planes.shape[1]
    nothing = len(starts) - 1
    for i in range(count):
        slot = starts[group[i]]
        starts[group[i]] = slot + 1
        ray_of[slot] = i
        hit = which[i]
        dx, dy, dz = rays[3, i], rays[4, i], rays[5, i]
        far = t[i] if group[i] != nothing else _ONE
        x, y, z = rays[0, i] + far * dx, rays[1, i] + far * dy, rays[2, i] + far * dz
        if hit < 0:
            nx, ny, nz = -dx, -dy, -dz
        elif hit < s:
            scale = _ONE / spheres[3, hit]
            nx, ny, nz = (x - spheres[0, hit]) * scale, (y - spheres[1, hit]) * scale, (z - spheres[2, hit]) * scale
        elif hit < s + p:
            nx, ny, nz = planes[0, hit - s], planes[1, hit - s], planes[2, hit - s]
            if nx * dx + ny * dy + nz * dz > _ZERO:
                nx, ny, nz = -nx, -ny, -nz
        else:
            nx, ny, nz = _interpolated(hit - s - p, uv[0, i], uv[1, i], corners, vertex_normals, modes, (dx, dy, dz))
        points[slot, 0], points[slot, 1], points[slot, 2] = x, y, z
        normals[slot, 0], normals[slot, 1], normals[slot, 2] = nx, ny, nz
        seen[slot, 0], seen[slot, 1], seen[slot, 2] = -dx, -dy, -dz


@jit.inline
def _interpolated(k: Any, u: Any, v: Any, corners: Array, normals: Array, modes: Array, direction: Any) -> Any:
    """The shading normal inside a triangle, on the side that the ray comes from."""
    dx, dy, dz = direction
    ax, ay, az = corners[3, k] - corners[0, k], corners[4, k] - corners[1, k], corners[5, k] - corners[2, k]
    bx, by, bz = corners[6, k] - corners[0, k], corners[7, k] - corners[1, k], corners[8, k] - corners[2, k]
    fx, fy, fz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    w = _ONE - u - v
    nx = w * normals[0, k] + u * normals[3, k] + v * normals[6, k]
    ny = w * normals[1, k] + u * normals[4, k] + v * normals[7, k]
    nz = w * normals[2, k] + u * normals[5, k] + v * normals[8, k]
    if modes[k] == 0:
        nx, ny, nz = fx, fy, fz
    if modes[k] != 1:
        scale = _ONE / np.sqrt(nx * nx + ny * ny + nz * nz + _TINY)
        nx, ny, nz = nx * scale, ny * scale, nz * scale
    # a mesh's faces need not be wound the way its normals point: the side is the ray's, told by the face itself
    inside = (fx * dx + fy * dy + fz * dz > _ZERO) == (fx * nx + fy * ny + fz * nz > _ZERO)
    if inside:
        nx, ny, nz = -nx, -ny, -nz
    return nx, ny, nz


@jit.driver
def accumulate(
    colours: Array, first: int, count: int, share: Any, ray_of: Array, weights: Array, pixels: Array, picture: Array
) -> None:
    """Add a group's light to the pixels it belongs to.

    colours  float32 (count, 3)
    share    float32              1 - k, the part of direct light
    weights  float32 (capacity,)  of each ray
    pixels   int32 (capacity,)    of each ray
    picture  float32 (n, 3)       in and out
    """
    for i in range(count):
        ray = ray_of[first + i]
        weight = share * weights[ray]
        pixel = pixels[ray]
        picture[pixel, 0] += weight * colours[i, 0]
        picture[pixel, 1] += weight * colours[i, 1]
        picture[pixel, 2] += weight * colours[i, 2]


@jit.driver
def reflect(surface: Any, first: int, count: int, share: Any, least: Any, here: Any, ahead: Any, filled: int) -> int:
    """Append the reflected rays of a group to the next wavefront; returns how many that then has.

    surface      of `gather`
    share        float32  k, the weight that a reflection keeps
    least        float32  rays whose accumulated weight would be below are left out
    here, ahead  rays, weights and pixels of this wavefront and of the next, which has `filled` rays so far
    """
    points, normals, seen, ray_of = surface
    _, weights, pixels = here
    rays, new_weights, new_pixels = ahead
    for i in range(first, first + count):
        ray = ray_of[i]
        weight = share * weights[ray]
        if weight >= least:
            nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
            scale = _ONE / np.sqrt(nx * nx + ny * ny + nz * nz + _TINY)
            nx, ny, nz = nx * scale, ny * scale, nz * scale
            vx, vy, vz = seen[i, 0], seen[i, 1], seen[i, 2]
            twice = _TWO * (nx * vx + ny * vy + nz * vz)
            rays[0, filled], rays[1, filled], rays[2, filled] = lifted(points, normals, i)
            rays[3, filled], rays[4, filled], rays[5, filled] = twice * nx - vx, twice * ny - vy, twice * nz - vz
            new_weights[filled] = weight
            new_pixels[filled] = pixels[ray]
            filled += 1
    return filled


@jit.driver
def blend(corners: Array, which: Array, offset: int, uv: Array, ray_of: Array, first: int, colours: Array) -> None:
    """Gouraud shading: the colours of a triangle's corners, mixed by where the ray hit it.

    corners  float32 (9, t)       colours of the corners
    offset   int                  number of the first triangle among the objects
    colours  float32 (count, 3)   out: of the rays of the group that begins at `first`
    """
    for i in range(len(colours)):
        ray = ray_of[first + i]
        k, u, v = which[ray] - offset, uv[0, ray], uv[1, ray]
        w = _ONE - u - v
        for c in range(3):
            colours[i, c] = w * corners[c, k] + u * corners[3 + c, k] + v * corners[6 + c, k]
