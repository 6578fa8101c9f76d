"""The camera: where its rays go in eye space, and where it must not stand."""

import math
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from phongbench.compiler import jit
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.scenes.scene import Camera, Mesh, Plane, Scene, Sphere

#: nearer to a surface than this share of the coordinates, which float64 rounds, a camera is on it
_TOUCHING = 1e-14
#: radians that rays and angles in float32 may be astray: an arc cosine near 1 is wrong by the root of the rounding
ASTRAY = np.float32(2e-3)
_ZERO, _HALF, _ONE, _TWO = np.float32(0), np.float32(0.5), np.float32(1), np.float32(2)


def frame(camera: Camera, width: int, height: int) -> Array:
    """The camera as a kernel takes it.

    returns  float32 (3, 3)  what makes a direction: forward + x right + y down, x and y in -1 .. 1
    """
    position, target = np.array(camera.position), np.array(camera.target)
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    half = math.tan(math.radians(camera.field_of_view) / 2)
    down = -half * np.cross(right, forward)
    return np.array([forward, half * width / height * right, down], np.float32)


@cache
def pixel_order(columns: int, rows: int, samples: int) -> tuple[Array, Array]:
    """The samples of a tile in blocks of 8 x 8 inside blocks of 32 x 32, so that neighbours are shaded together.

    What is left out is left out by blocks: square ones hold fewer lights and edges than rows do.
    returns  int32 (n, 2) column and row of each sample, and int32 (n,) the pixel it belongs to
    """
    across, down = columns * samples, rows * samples
    y, x = (axis.ravel() for axis in np.mgrid[0:down, 0:across])
    order = np.lexsort((x, y, x // 8, y // 8, x // 32, y // 32))
    x, y = x[order], y[order]
    return np.stack([x, y], axis=1).astype(np.int32), (y // samples * columns + x // samples).astype(np.int32)


@jit.driver
def primary_rays(view: Array, first: Any, places: Array, size: Any, rays: Array) -> None:
    """Rays through the middles of a tile's samples.

    view    float32 (3, 3)         of `frame`
    first   (column, row)          the tile's upper left sample
    places  int32 (n, 2)           column and row of each sample in the tile
    size    (width, height)        of the whole picture, in samples
    rays    float32 (6, capacity)  out: origin and unit direction of each
    """
    across, along = _TWO / np.float32(size[0]), _TWO / np.float32(size[1])
    for i in range(len(places)):
        x = (np.float32(first[0] + places[i, 0]) + _HALF) * across - _ONE
        y = (np.float32(first[1] + places[i, 1]) + _HALF) * along - _ONE
        dx = view[0, 0] + x * view[1, 0] + y * view[2, 0]
        dy = view[0, 1] + x * view[1, 1] + y * view[2, 1]
        dz = view[0, 2] + x * view[1, 2] + y * view[2, 2]
        scale = _ONE / np.sqrt(dx * dx + dy * dy + dz * dz)
        rays[0, i], rays[1, i], rays[2, i] = _ZERO, _ZERO, _ZERO
        rays[3, i], rays[4, i], rays[5, i] = dx * scale, dy * scale, dz * scale


@jit.driver
def in_sight(view: Array, spheres: Array, first: Any, shape: Any, size: Any, seen: Array) -> int:
    """The spheres that rays of a tile may hit: those that the cone around the tile touches. Returns how many.

    view, first, size  as in `primary_rays`
    spheres            float32 (8, s)  as in Geometry
    shape              columns and rows of the tile, in samples
    seen               int32 (s,)      out: their numbers, ascending
    """
    middle = np.zeros(3, np.float32)
    corner = np.zeros(3, np.float32)
    _towards(view, first[0] + shape[0] * _HALF, first[1] + shape[1] * _HALF, size, middle)
    least = _ONE  # the cosine of the corner that is farthest from the middle
    for c in range(4):
        _towards(view, first[0] + shape[0] * np.float32(c % 2), first[1] + shape[1] * np.float32(c // 2), size, corner)
        least = min(least, middle[0] * corner[0] + middle[1] * corner[1] + middle[2] * corner[2])
    width = np.arccos(max(-_ONE, min(_ONE, least)))
    count = 0
    for s in range(spheres.shape[1]):
        seen[count] = s
        if spheres[7, s] <= _ZERO:  # the camera is inside
            count += 1
            continue
        x, y, z = spheres[0, s], spheres[1, s], spheres[2, s]
        distance = np.sqrt(x * x + y * y + z * z)
        apart = np.arccos(max(-_ONE, min(_ONE, (x * middle[0] + y * middle[1] + z * middle[2]) / distance)))
        if apart <= width + np.arcsin(min(_ONE, spheres[3, s] / distance)) + ASTRAY:
            count += 1
    return count


@jit.inline
def _towards(view: Array, column: Any, row: Any, size: Any, out: Array) -> None:
    """The unit direction through a place of the picture, in samples."""
    x, y = _TWO * np.float32(column) / np.float32(size[0]) - _ONE, _TWO * np.float32(row) / np.float32(size[1]) - _ONE
    for axis in range(3):
        out[axis] = view[0, axis] + x * view[1, axis] + y * view[2, axis]
    scale = _ONE / np.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2])
    for axis in range(3):
        out[axis] *= scale


def check_camera(scene: Scene) -> None:
    """Raise InputError, naming the object by its index, if the camera is inside one or on its surface."""
    position = np.array(scene.camera.position)
    for index, thing in enumerate(scene.objects):
        if _holds(thing, position):
            kind = type(thing).__name__.lower()
            where = "lies on" if isinstance(thing, Plane) else "is inside or on"
            raise InputError(f"the camera {where} the {kind} objects[{index}]", None, "move one of them")


def _holds(thing: Sphere | Plane | Mesh, position: Array) -> bool:
    if isinstance(thing, Sphere):
        height = float(np.linalg.norm(position - thing.centre)) - thing.radius
        return height <= _TOUCHING * (_size(position) + _size(thing.centre) + thing.radius)
    if isinstance(thing, Plane):
        height = abs(float(np.dot(position - thing.point, thing.normal)))
        return height <= _TOUCHING * (_size(position) + _size(thing.point))
    return abs(winding(thing, position)) > 0.5


def _size(place: ArrayLike) -> float:
    return float(np.abs(place).sum())


def winding(mesh: Mesh, point: Array) -> float:
    """How often a mesh winds around a point: 1 inside a closed one, 0 outside, in between for open ones.

    The sum of the triangles' solid angles over that of the whole sphere (formula of van Oosterom and Strackee, 1983).
    """
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] - point for corner in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    top = np.einsum("ij,ij->i", a, np.cross(b, c))
    ab, bc, ca = (np.einsum("ij,ij->i", p, q) for p, q in ((a, b), (b, c), (c, a)))
    return float(np.arctan2(top, la * lb * lc + ab * lc + bc * la + ca * lb).sum() / (2 * math.pi))
