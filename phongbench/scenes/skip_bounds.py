"""What leaving something out may change at most, from a scene's lights, materials and distances."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.scenes.scene import Mesh, Plane, Scene, Sphere
from phongbench.shading.lighting import Skips


@dataclass(frozen=True, eq=False)
class Bounds:
    """The bounds of one scene; computed when first asked for."""

    scene: Scene

    @cached_property
    def brightest(self) -> float:
        """A bound on every colour: what a surface, facing every light from the nearest place, would show.

        Reflections mix and do not add, (1 - k) direct + k reflected, so they are no brighter than what they mix.
        """
        scene = self.scene
        ambient = _largest(m.reflection.ambient for m in scene.materials) * scene.ambient_light
        lit = (self.fades[:, None] * self._products).sum(axis=0)
        return float(max(*(ambient + lit), *scene.background))

    @cached_property
    def beyond_reach(self) -> float:
        """How bright all lights with a reach are together where each one's reach ends."""
        reaches = np.array([np.inf if light.reach is None else light.reach for light in self.scene.lights])
        limited = np.isfinite(reaches)
        fades = self._fades(np.where(limited, reaches, 0.0))
        return float((limited * fades * self._products.max(axis=1, initial=0.0)).sum())

    def dark_tail(self, skips: Skips) -> float:
        """How bright all highlights are together where each counts as dark."""
        tail = 4 * float(np.finfo(np.float32).eps) if skips.tail is None else skips.tail
        return tail * float((self.fades * self.highlights.max(axis=1, initial=0.0)).sum())

    @cached_property
    def fades(self) -> Array:
        """(lights,) what is left of each light at the surface nearest to it."""
        return self._fades(self._distances)

    @cached_property
    def highlights(self) -> Array:
        """(lights, 3) each light's highlight on the material that has the brightest, before it fades.

        A reflectance that depends on incidence is at most 1.
        """
        specular = _largest(m.reflection.specular for m in self.scene.materials)
        return specular * _rows(light.specular for light in self.scene.lights)

    @cached_property
    def _products(self) -> Array:
        """(lights, 3) the most that each light adds to a colour, before it fades."""
        lights, materials = self.scene.lights, self.scene.materials
        diffuse = _largest(m.reflection.diffuse for m in materials) * _rows(light.diffuse for light in lights)
        ambient = _largest(m.reflection.ambient for m in materials) * _rows(light.ambient for light in lights)
        return np.asarray(diffuse + ambient + self.highlights)

    @cached_property
    def _distances(self) -> Array:
        """(lights,) the distance to the nearest surface, or less; 0 for a light far away, where it does not matter."""
        places = tuple(light.position for light in self.scene.lights)
        return np.asarray(self.scene.cache.of("distances", places, self._measured))

    def _measured(self) -> Array:
        scene = self.scene
        places = _rows((0.0, 0.0, 0.0) if light.position is None else light.position for light in scene.lights)
        nearest = np.full(len(places), np.inf)
        for thing in scene.objects:
            nearest = np.minimum(nearest, _distances(thing, places))
        return np.where([light.position is None for light in scene.lights], 0.0, nearest)

    def _fades(self, distances: Array) -> Array:
        """1 / (c + l d + q d^2), and the largest float32 where that is infinite."""
        c, linear, quadratic = _rows(light.attenuation for light in self.scene.lights).T
        below = c + linear * distances + quadratic * distances**2
        with np.errstate(divide="ignore"):
            return np.asarray(np.minimum(1 / below, float(np.finfo(np.float32).max)))


def _distances(thing: Sphere | Plane | Mesh, places: Array) -> Array:
    """(n,) how far places are from an object's surface, or less."""
    if isinstance(thing, Sphere):
        return np.asarray(np.abs(np.linalg.norm(places - thing.centre, axis=1) - thing.radius))
    if isinstance(thing, Plane):
        return np.asarray(np.abs((places - thing.point) @ thing.normal))
    corners = thing.vertices[thing.faces]
    # no point of a triangle is farther from its nearest corner than the longest edge over the square root of 3
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1) / np.sqrt(3)
    gaps = [(np.linalg.norm(corners - place, axis=2).min(axis=1) - edges).min() for place in places]
    return np.maximum(0.0, gaps)


def _rows(vectors: Iterable[Any]) -> Array:
    """(n, 3), also of none."""
    return np.array(list(vectors), float).reshape(-1, 3)


def _largest(colours: Iterable[Any]) -> Array:
    """The largest of each channel."""
    return np.asarray(_rows(colours).max(axis=0, initial=0.0))
