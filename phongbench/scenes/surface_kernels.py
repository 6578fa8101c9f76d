"""Compiled surfaces: what rays hit, sorted by material, where it lies, how it is turned, and its light into pixels."""

from typing import Any

import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.precisions import Array

#: how far along its normal a ray starts from a sphere or plane, so that it does not find it again, as a share of the
#: point's coordinates and of the distance t it was hit at. The point is off by a few roundings of t and of the ray's
#: origin, which is no farther than point and t together; how far a place is above a surface is in turn known to some
#: ten roundings of its coordinates (`_far_sphere` and `_near_sphere` in ray_kernels.py). This is 32 roundings of each:
#: no part of a pixel
LIFT = np.float32(2.0**-19)
_ZERO, _ONE, _TWO = np.float32(0), np.float32(1), np.float32(2)
#: a squared length, without unit, that stands for 0
_TINY = np.float32(1e-20)


@jit.driver
def sort(rays: Array, count: int, hits: Any, solids: Any, group: Array, sizes: Array) -> None:
    """The group of each ray: its material; after the materials, the same again for Gouraud's colours; then nothing hit.

    hits    t, which and uv, as `gather` takes them
    solids  the arrays of Geometry
    group   int32 (capacity,)  out
    sizes   int64 (2m + 1,)    out: how many are in each of them
    """
    t, which, _ = hits
    spheres, planes, boards, materials, _, _, modes, _ = solids
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
def gather(
    rays: Array, count: int, hits: Any, solids: Any, group: Array, ends: Array, surface: Any, background: bool
) -> None:
    """What the rays hit, each group's together; of triangles only `ray_of` and `seen`, see `gather_triangles`.

    hits     t and which of `nearest`, and uv of `gather_triangles`
    solids   the arrays of Geometry
    ends     int64 (2m + 1,)  in: where each group begins; out: where it ends
    surface  points   float32 (capacity, 3)  out: the point
             starts   float32 (capacity, 3)  out: where rays that leave it start, see LIFT
             normals  float32 (capacity, 3)  out: the shading normal there, on the side of the ray
             seen     float32 (capacity, 3)  out: the unit direction to where the ray came from
             ray_of   int32 (capacity,)      out: the ray that hit it
    background  whether more than `ray_of` is wanted of rays that hit nothing: then a point before the camera
    """
    t, which, _ = hits
    spheres, planes = solids[0], solids[1]
    points, starts, normals, seen, ray_of = surface
    s, p = spheres.shape[1], planes.shape[1]
    nothing = len(ends) - 1
    for i in range(count):
        slot = ends[group[i]]
        ends[group[i]] = slot + 1
        ray_of[slot] = i
        hit = which[i]
        if hit < 0 and not background:
            continue
        dx, dy, dz = rays[3, i], rays[4, i], rays[5, i]
        far = t[i] if group[i] != nothing else _ONE
        x, y, z = rays[0, i] + far * dx, rays[1, i] + far * dy, rays[2, i] + far * dz
        nx, ny, nz = -dx, -dy, -dz
        if hit >= s:
            if hit < s + p:
                nx, ny, nz = planes[0, hit - s], planes[1, hit - s], planes[2, hit - s]
        elif hit >= 0:
            nx, ny, nz = x - spheres[0, hit], y - spheres[1, hit], z - spheres[2, hit]
            scale = _ONE / np.sqrt(nx * nx + ny * ny + nz * nz)
            nx, ny, nz = nx * scale, ny * scale, nz * scale
        if nx * dx + ny * dy + nz * dz > _ZERO:
            nx, ny, nz = -nx, -ny, -nz
        lift = LIFT * (np.abs(x) + np.abs(y) + np.abs(z) + far)
        points[slot, 0], points[slot, 1], points[slot, 2] = x, y, z
        starts[slot, 0], starts[slot, 1], starts[slot, 2] = x + lift * nx, y + lift * ny, z + lift * nz
        normals[slot, 0], normals[slot, 1], normals[slot, 2] = nx, ny, nz
        seen[slot, 0], seen[slot, 1], seen[slot, 2] = -dx, -dy, -dz


@jit.driver
def gather_triangles(rays: Array, count: int, hits: Any, solids: Any, surface: Any) -> None:
    """Point, start and normal of the triangles among what `gather` put together.

    hits  t and which, and
          uv    float32 (2, capacity)  weights of the second and third corner
    A point is mixed from the corners, which are off by a share of their own size; or, of a triangle that is larger than
    its distance, taken from where the ray meets its plane. It is lifted on the ray's side by as much as Embree's
    rounding and this ask for.
    """
    t, which, uv = hits
    spheres, planes, _, _, corners, vertex_normals, modes, faces = solids
    points, starts, normals, seen, ray_of = surface
    first = spheres.shape[1] + planes.shape[1]
    for slot in range(count):
        i = ray_of[slot]
        k = which[i] - first
        if k < 0:
            continue
        u, v = uv[0, i], uv[1, i]
        fx, fy, fz, lift = faces[0, k], faces[1, k], faces[2, k], faces[3, k]
        slope = fx * seen[slot, 0] + fy * seen[slot, 1] + fz * seen[slot, 2]
        front = slope > _ZERO
        x, y, z = corners[0, k], corners[1, k], corners[2, k]
        x += u * (corners[3, k] - x) + v * (corners[6, k] - x)
        y += u * (corners[4, k] - y) + v * (corners[7, k] - y)
        z += u * (corners[5, k] - z) + v * (corners[8, k] - z)
        nearby = np.abs(x) + np.abs(y) + np.abs(z) + t[i]
        if nearby < np.abs(slope) * faces[5, k]:
            x, y, z = rays[0, i], rays[1, i], rays[2, i]
            far = (fx * x + fy * y + fz * z - faces[4, k]) / slope
            x, y, z = x - far * seen[slot, 0], y - far * seen[slot, 1], z - far * seen[slot, 2]
            lift += LIFT * nearby
        nx, ny, nz = fx, fy, fz
        if modes[k] != 0:
            w = _ONE - u - v
            nx = w * vertex_normals[0, k] + u * vertex_normals[3, k] + v * vertex_normals[6, k]
            ny = w * vertex_normals[1, k] + u * vertex_normals[4, k] + v * vertex_normals[7, k]
            nz = w * vertex_normals[2, k] + u * vertex_normals[5, k] + v * vertex_normals[8, k]
            if modes[k] != 1:
                scale = _ONE / np.sqrt(nx * nx + ny * ny + nz * nz + _TINY)
                nx, ny, nz = nx * scale, ny * scale, nz * scale
        # a mesh's faces need not be wound the way its normals point: the side is the ray's, told by the face itself
        if front != (fx * nx + fy * ny + fz * nz > _ZERO):
            nx, ny, nz = -nx, -ny, -nz
        lift = lift if front else -lift
        points[slot, 0], points[slot, 1], points[slot, 2] = x, y, z
        starts[slot, 0], starts[slot, 1], starts[slot, 2] = x + lift * fx, y + lift * fy, z + lift * fz
        normals[slot, 0], normals[slot, 1], normals[slot, 2] = nx, ny, nz


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
