"""Pairs as a renderer makes them: a normal interpolated over a triangle, a light, a viewer.

Everything here is in float64 and of shape (3, n). Point i of a surface is a pure function of (seed, i), and all
exponents share their points, so that rows differ by what is studied and not by luck.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler.precisions import Array
from phongbench.inputs.meshes import Surface
from phongbench.inputs.random_numbers import uniforms
from phongbench.inputs.strata import HIGHLIGHT_REACH

NORMALS = ("raw", "renormalised")
#: R = 2(L.N)N - L, R = 2(N.L)N - (N.N)L, or (N, H)
PAIRS = ("classic", "lengthwise", "half")
#: one point in so many looks anywhere; the others look into the highlight
ANYWHERE = 8


@dataclass(frozen=True, eq=False)
class Points:
    """Random points on triangles of a surface.

    raw    interpolated normals, shorter than 1 between vertices
    true   unit normals of the true surface, or None where it is unknown
    draws  (6, n) uniform numbers in [0, 1): viewer, deficit, azimuth
    """

    raw: Array
    true: Array | None
    draws: Array

    @cached_property
    def unit(self) -> Array:
        """The interpolated normals made unit length: what shading is meant to see."""
        return unit(self.raw)

    # whatever the exponent:

    @cached_property
    def viewer(self) -> Array:
        """Directions to a viewer anywhere above the horizon."""
        return _above(_anywhere(self.draws[0], self.draws[1]), self.unit)

    @cached_property
    def somewhere(self) -> Array:
        """Directions anywhere: what turns the light about the viewer, and H about the normal."""
        return _anywhere(self.draws[3], self.draws[4])

    @cached_property
    def above(self) -> Array:
        """These directions, those below the horizon mirrored."""
        return _above(self.somewhere, self.unit)

    @cached_property
    def across_viewer(self) -> Array:
        """Unit vectors across the viewer's, by these directions, not below the horizon."""
        return _across(self.viewer, self.somewhere, self.unit)

    @cached_property
    def across_normal(self) -> Array:
        """Unit vectors across the normals, likewise."""
        return _across(self.unit, self.somewhere, self.unit)


def points(surface: Surface, triangles: NDArray[np.int64], seed: int, count: int) -> Points:
    """Points spread evenly over the area of some triangles of a surface."""
    draws = uniforms(seed, 0, count, 8)
    area = np.cumsum(surface.areas()[triangles])
    at = np.minimum(np.searchsorted(area, draws[0] * area[-1], side="right"), len(area) - 1)
    corners = surface.faces[triangles[at]]
    root = np.sqrt(draws[1])
    weights = np.stack([1 - root, root * (1 - draws[2]), root * draws[2]], axis=1)
    raw = np.einsum("nk,nkc->cn", weights, surface.normals[corners])
    true = None
    if surface.true_normals is not None:
        true = np.ascontiguousarray(surface.true_normals(np.einsum("nk,nkc->nc", weights, surface.vertices[corners])).T)
    return Points(raw, true, draws[[3, 4, 5, 6, 7, 0]])


@dataclass(frozen=True, eq=False)
class Lit:
    """Points with a viewer and a light chosen for one exponent.

    Seven points in eight lie in the highlight: the light's true reflection is at alpha * lambda uniform in 0 .. 12 from
    the viewer, with a uniform azimuth, and likewise H from N at half the angle. The eighth has them anywhere above the
    horizon of the interpolated normal. For (N, H) only those two vectors matter, so L and V are not spelled out.
    """

    points: Points
    viewer: Array
    reflected: Array
    half: Array

    def pair(self, normals: str, pair: str) -> tuple[Array, Array]:
        """What a renderer passes to the formula: (R, V) with R built as `pair` says, or (N, H)."""
        n = self.points.raw if normals == "raw" else self.points.unit
        if pair == "half":
            return n, self.half
        return (classic if pair == "classic" else lengthwise)(n, self.light), self.viewer

    def true_pair(self, pair: str) -> tuple[Array, Array]:
        """The same with the interpolated normal made unit first, for which both ways of building R agree."""
        return (self.points.unit, self.half) if pair == "half" else (self.reflected, self.viewer)

    def surface_deficit(self, pair: str) -> Array | None:
        """1 - cos of the angle between the pair's directions on the true surface; None where it is unknown."""
        if self.points.true is None:
            return None
        n = self.points.true
        a, b = (n, self.half) if pair == "half" else (classic(n, self.light), self.viewer)
        return np.asarray(0.5 * ((a - b) ** 2).sum(axis=0))

    @cached_property
    def light(self) -> Array:
        """The direction to the light: the reflection mirrored at the normal."""
        return classic(self.points.unit, self.reflected)


def lit(points: Points, alpha: float) -> Lit:
    """The points with viewer, light and H for this exponent."""
    deficit = points.draws[2] * min(HIGHLIGHT_REACH / alpha, 1.0)
    reflected = _at(points.viewer, deficit, points.across_viewer)
    half = _at(points.unit, halved(deficit), points.across_normal)
    for vectors in (reflected, half):
        vectors[:, ::ANYWHERE] = points.above[:, ::ANYWHERE]
    return Lit(points, points.viewer, reflected, half)


def classic(n: Array, light: Array) -> Array:
    """2 (L.N) N - L: the reflection of L at N if N has unit length; a short N turns it towards -L."""
    return np.asarray(2 * dots(light, n) * n - light)


def lengthwise(n: Array, light: Array) -> Array:
    """2 (N.L) N - (N.N) L: the direction of the reflection of L at N, as long as |N|^2 |L|."""
    return np.asarray(2 * dots(n, light) * n - dots(n, n) * light)


def dots(a: Array, b: Array) -> Array:
    """(n,) a.b of each pair."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def unit(vectors: Array) -> Array:
    """The directions, of length 1."""
    return np.asarray(vectors / np.sqrt(dots(vectors, vectors)))


def halved(deficit: Array) -> Array:
    """1 - cos of half the angle whose 1 - cos is given."""
    return np.asarray(0.5 * deficit / (1.0 + np.sqrt(np.maximum(0.0, 1.0 - 0.5 * deficit))))


def _anywhere(height: Array, turn: Array) -> Array:
    """Unit vectors, uniform on the sphere for uniform arguments."""
    z, angle = 2 * height - 1, 2 * np.pi * turn
    radius = np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z])


def _above(vectors: Array, n: Array) -> Array:
    """The vectors, mirrored at the origin where they are below the horizon of n."""
    return np.asarray(np.where(dots(vectors, n) < 0, -vectors, vectors))


def _across(axis: Array, towards: Array, n: Array) -> Array:
    """Unit vectors across unit axes, towards random directions or away from them.

    Of these two the one higher above n's horizon is taken, so that a light above the horizon makes it.
    """
    return _above(unit(towards - dots(towards, axis) * axis), n)


def _at(axis: Array, deficit: Array, across: Array) -> Array:
    """Unit vectors at a deficit <= 1 from unit axes, turned to those across."""
    return np.asarray((1 - deficit) * axis + np.sqrt(deficit * (2 - deficit)) * across)
