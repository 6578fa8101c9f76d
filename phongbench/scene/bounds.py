"""What leaving something out may change at most, from a scene's lights, materials and distances."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench.lighting import Light, Skips
from phongbench.scene.parts import Mesh, Plane, Scene, Sphere

Array = NDArray[Any]


def brightest(scene: Scene) -> float:
    """A bound on every colour of the scene: what a surface, facing every light from the nearest place, would show.

    Reflections mix and do not add, (1 - k) direct + k reflected, so they are no brighter than what they mix.
    """
    lit = [0.0, 0.0, 0.0]
    for light in scene.lights:
        lit = [sum(pair) for pair in zip(lit, _most(scene, light, nearest(scene, light)), strict=True)]
    ambient = _largest(m.reflection.ambient for m in scene.materials)
    direct = [a * i + one for a, i, one in zip(ambient, scene.ambient_light, lit, strict=True)]
    return max(*direct, *scene.background)


def beyond_reach(scene: Scene) -> float:
    """How bright all lights with a reach are together where each one's reach ends."""
    return sum(max(_most(scene, light, light.reach)) for light in scene.lights if light.reach is not None)


def dark_tail(scene: Scene, skips: Skips) -> float:
    """How bright all highlights are together where each counts as dark."""
    tail = 4 * float(np.finfo(np.float32).eps) if skips.tail is None else skips.tail
    specular = _largest(m.reflection.specular for m in scene.materials)
    return tail * float(
        sum(
            attenuation(light, nearest(scene, light)) * max(np.multiply(specular, light.specular))
            for light in scene.lights
        )
    )


def nearest(scene: Scene, light: Light) -> float:
    """The distance from a light to the nearest surface, or less; 0 for one far away, where it does not matter."""
    if light.position is None:
        return 0.0
    return min(_distance(thing, np.array(light.position)) for thing in scene.objects)


def _distance(thing: Sphere | Plane | Mesh, place: Array) -> float:
    if isinstance(thing, Sphere):
        return abs(float(np.linalg.norm(place - thing.centre)) - thing.radius)
    if isinstance(thing, Plane):
        return abs(float(np.dot(place - thing.point, thing.normal)))
    corners = thing.vertices[thing.faces]
    # no point of a triangle is farther from its nearest corner than the longest edge over the square root of 3
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    gaps = np.linalg.norm(corners - place, axis=2).min(axis=1) - edges / np.sqrt(3)
    return max(0.0, float(gaps.min()))


def attenuation(light: Light, distance: float) -> float:
    """What is left of a light at this distance; the largest float32 where its formula is infinite."""
    if light.position is None:
        return 1.0
    c, l, q = light.attenuation  # noqa: E741  the letters of the formula
    below = c + l * distance + q * distance**2
    return 1 / below if below > 0 else float(np.finfo(np.float32).max)


def _most(scene: Scene, light: Light, distance: float | None) -> list[float]:
    """The most that a light adds to a colour at this distance or beyond."""
    fade = attenuation(light, distance or 0.0)
    diffuse = _largest(m.reflection.diffuse for m in scene.materials)
    specular = _largest(m.reflection.specular for m in scene.materials)
    return [
        fade * (kd * d + ks * s) for kd, d, ks, s in zip(diffuse, light.diffuse, specular, light.specular, strict=True)
    ]


def _largest(colours: Iterable[Any]) -> list[float]:
    """The largest of each channel."""
    return [max(channel) for channel in zip(*colours, strict=True)] or [0.0, 0.0, 0.0]
