"""Where a picture is computed: lengths from the camera, in a unit between the nearest and the farthest that is there.

float32 holds a coordinate to a share of its size, so its origin belongs where precision is wanted: at the camera
("rendering relative to eye": Cozzi and Ring, 3D Engine Design for Virtual Globes, 2011, chapter 5). What is d away is
then off by a share of d, which the camera sees as the same small angle everywhere; and a scene that is moved or scaled
is the same numbers again, but for rounding.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.scenes.scene import Mesh, Plane, Scene, Sphere
from phongbench.shading.lighting import Light
from phongbench.support.documents import Vector

#: units a light may be away: far from where the square of a distance is infinite
_FARTHEST = 1e17


@dataclass(frozen=True, slots=True)
class EyeSpace:
    """World coordinates moved and scaled, not turned.

    origin  where the camera is
    unit    a power of two, so that scaling rounds nothing: a world length is divided by it
    """

    origin: Vector
    unit: float

    def places(self, points: ArrayLike) -> Array:
        """Points (..., 3) of the world, float64."""
        return np.asarray((np.asarray(points, np.float64) - self.origin) / self.unit)

    def lights(self, lights: Sequence[Light]) -> tuple[Light, ...]:
        """The same lights: what is 1 / (c + l d + q d^2) at a distance d of the world stays that.

        Raises InputError, naming the light, for one beside which float32 cannot hold the objects.
        """
        return tuple(self._placed(k, light) for k, light in enumerate(lights))

    def _placed(self, number: int, light: Light) -> Light:
        if light.position is None:
            return light
        x, y, z = self.places(light.position).tolist()
        if not max(map(abs, (x, y, z))) < _FARTHEST:
            what = f"more than {_FARTHEST:g} times as far away as what is lit"
            raise InputError(what, f"lights[{number}].position", "bring it nearer, or give it a direction")
        constant, linear, quadratic = light.attenuation
        fading = constant, linear * self.unit, quadratic * self.unit * self.unit
        reach = None if light.reach is None else light.reach / self.unit
        return replace(light, position=(x, y, z), attenuation=fading, reach=reach)


def eye_space(scene: Scene) -> EyeSpace:
    """The space of a scene's pictures; it depends on the camera's place and the objects alone.

    The unit is midway, by factors, between the nearest and the farthest surface: squares of everything stay within
    float32's range.
    """
    origin = np.array(scene.camera.position, np.float64)
    lengths = np.concatenate([_from_spheres(scene, origin), _from_planes(scene, origin), _from_meshes(scene, origin)])
    exponents = np.frexp(lengths[np.isfinite(lengths) & (lengths > 0)])[1]
    middle = (int(exponents.min()) + int(exponents.max())) // 2 if len(exponents) else 0
    return EyeSpace(scene.camera.position, math.ldexp(1.0, middle))


def _from_spheres(scene: Scene, origin: Array) -> Array:
    """How far the nearest and the farthest point of each sphere are."""
    spheres: list[Sphere] = scene.of(Sphere)
    away = np.linalg.norm(np.array([s.centre for s in spheres]).reshape(-1, 3) - origin, axis=1)
    radii = np.array([s.radius for s in spheres])
    return np.concatenate([np.abs(away - radii), away + radii])


def _from_planes(scene: Scene, origin: Array) -> Array:
    """How far each plane is."""
    planes: list[Plane] = scene.of(Plane)
    return np.array([abs(np.dot(p.normal, np.subtract(p.point, origin))) for p in planes])


def _from_meshes(scene: Scene, origin: Array) -> Array:
    """How far the nearest and the farthest vertex of each mesh are."""
    meshes: list[Mesh] = scene.of(Mesh)
    away = [np.linalg.norm(m.vertices - origin, axis=1) for m in meshes if len(m.vertices)]
    return np.array([end for distances in away for end in (distances.min(), distances.max())])
