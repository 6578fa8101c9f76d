"""Known surfaces to invert pictures of: normals and heights in closed form, x right, y up, z to the viewer."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from phongbench.compiler.precisions import Array


@dataclass(frozen=True, eq=False)
class KnownSurface:
    """A surface on a grid of pixels over the square from -1 to 1.

    normals  (n, n, 3)  unit
    heights  (n, n)     in pixels, towards the viewer
    mask     (n, n)     True where the surface is
    """

    normals: Array
    heights: Array
    mask: Array


def degrees_between(one: Array, other: Array) -> Array:
    """Angles (..) between vectors (.., 3), in degrees; near 0 as exact as anywhere."""
    across, along = np.linalg.norm(np.cross(one, other), axis=-1), (one * other).sum(axis=-1)
    return np.asarray(np.degrees(np.arctan2(across, along)))


def _grid(size: int) -> tuple[Array, Array]:
    y, x = np.mgrid[1 : -1 : size * 1j, -1 : 1 : size * 1j]
    return x, y


def _of_slopes(size: int, heights: Array, over_x: Array, over_y: Array, mask: Array) -> KnownSurface:
    normals = np.dstack([-over_x, -over_y, np.ones_like(over_x)])
    normals /= np.linalg.norm(normals, axis=2)[..., None]
    return KnownSurface(normals, heights * (size - 1) / 2, mask)


def sphere(size: int) -> KnownSurface:
    """The unit sphere's front, within 0.9 of its radius."""
    x, y = _grid(size)
    mask = np.hypot(x, y) < 0.9
    z = np.sqrt(np.where(mask, 1 - x * x - y * y, 1.0))
    return _of_slopes(size, z, -x / z, -y / z, mask)


def vase(size: int) -> KnownSurface:
    """A solid of revolution around y whose radius is 0.6 + 0.2 sin(3 y), within 0.85 of it."""
    x, y = _grid(size)
    radius, change = 0.6 + 0.2 * np.sin(3 * y), 0.6 * np.cos(3 * y)
    mask = np.abs(x) < 0.85 * radius
    z = np.sqrt(np.where(mask, radius * radius - x * x, 1.0))
    return _of_slopes(size, z, -x / z, radius * change / z, mask)


#: Gaussian bumps: place, width and height
_BUMPS = ((-0.4, 0.35, 0.25, 0.3), (0.45, 0.3, 0.3, -0.25), (0.1, -0.4, 0.35, 0.4), (-0.5, -0.5, 0.2, -0.15))


def bumps(size: int) -> KnownSurface:
    """Four Gaussian bumps and hollows on a plane."""
    x, y = _grid(size)
    heights, over_x, over_y = (np.zeros_like(x) for _ in range(3))
    for at_x, at_y, width, height in _BUMPS:
        one = height * np.exp(-((x - at_x) ** 2 + (y - at_y) ** 2) / (2 * width * width))
        heights += one
        over_x -= (x - at_x) / width**2 * one
        over_y -= (y - at_y) / width**2 * one
    return _of_slopes(size, heights, over_x, over_y, np.ones_like(x, dtype=bool))


def tent(size: int) -> KnownSurface:
    """Two planes that meet in a ridge along y, 30 degrees steep."""
    x, _ = _grid(size)
    steep = math.tan(math.radians(30))
    return _of_slopes(size, -steep * np.abs(x), -steep * np.sign(x), np.zeros_like(x), np.ones_like(x, dtype=bool))


#: the surfaces by name
SURFACES: Mapping[str, Callable[[int], KnownSurface]] = {"sphere": sphere, "vase": vase, "bumps": bumps, "tent": tent}


@cache
def known_surface(name: str, size: int) -> KnownSurface:
    """One of SURFACES, size x size pixels."""
    return SURFACES[name](size)
