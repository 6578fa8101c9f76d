"""The plain float64 tracer with triangles, one at a time: slow, and nothing in common with Embree."""

from dataclasses import replace
from typing import Any

import numpy as np

from phongbench.benchmarks import numpy_tracer
from phongbench.scenes.scene import Mesh, Scene

Array = Any


def trace(scene: Scene) -> Array:
    """The picture (height, width, 3) as the scene wants it; meshes are flat or their normals unit."""
    objects: list[Any] = []
    for thing in scene.objects:
        objects += _triangles(thing) if isinstance(thing, Mesh) else [thing]
    twin = _Twin(replace(scene, objects=tuple(objects)), scene.picture.shadows, np.float64)
    width, height = scene.picture.size
    return twin.follow(*twin.camera(width, height), scene.picture.depth).reshape(height, width, 3)


def _triangles(mesh: Mesh) -> list[Mesh]:
    parts = [slice(k, k + 1) for k in range(len(mesh.faces))]
    return [replace(mesh, faces=mesh.faces[part], materials=mesh.materials[part]) for part in parts]


def _corners(mesh: Mesh) -> Array:
    return mesh.vertices[mesh.faces[0]]


def _weights(mesh: Mesh, origins: Array, directions: Array) -> tuple[Array, Array, Array]:
    """Weights of the second and third corner, and the distance, where rays meet the plane (Moeller and Trumbore)."""
    a, b, c = _corners(mesh)
    u, v = b - a, c - a
    p = np.cross(directions, v)
    q = np.cross(origins - a, u)
    scale = 1 / (p @ u)
    return ((origins - a) * p).sum(axis=1) * scale, (directions * q).sum(axis=1) * scale, (q @ v) * scale


class _Twin(numpy_tracer._Tracer):
    def distance(self, thing: Any, origins: Array, directions: Array) -> Array:
        if not isinstance(thing, Mesh):
            return super().distance(thing, origins, directions)
        with np.errstate(all="ignore"):
            x, y, t = _weights(thing, origins, directions)
            return np.where((x >= 0) & (y >= 0) & (x + y <= 1) & (t > 0), t, np.inf)

    def surface(self, points: Array, directions: Array, which: Array) -> tuple[Array, Array]:
        normals, worn = super().surface(points, directions, which)
        for index, thing in enumerate(self.scene.objects):
            mine = which == index
            if isinstance(thing, Mesh) and mine.any():
                a, b, c = _corners(thing)
                face = np.cross(b - a, c - a)
                normals[mine] = face / np.linalg.norm(face)
                if thing.smooth == "normals":
                    x, y, _ = _weights(thing, points[mine] - directions[mine], directions[mine])
                    mixed = np.stack([1 - x - y, x, y], axis=1) @ thing.normals[thing.faces[0]]
                    normals[mine] = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
                side = np.sign(normals[mine] @ face) * np.sign(directions[mine] @ face)
                normals[mine] *= -side[:, None]
                worn[mine] = thing.materials[0]
        return normals, worn

    def sizes(self) -> Array:
        solids = iter(super().sizes())
        things = self.scene.objects
        return np.array([np.abs(_corners(t)).sum() if isinstance(t, Mesh) else next(solids) for t in things])
