"""A scene as arrays that kernels read: every object's numbers, and which material it wears."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.scenes.scene import MOST_TRIANGLES, Mesh, Plane, Scene, Sphere

#: how triangles are shaded between their vertices
FLAT, RAW, UNIT, COLOURS = 0, 1, 2, 3


@dataclass(frozen=True, eq=False)
class Geometry:
    """Objects are numbered: spheres first, then planes, then the triangles of all meshes.

    spheres    float32 (4, s)   centre and radius
    planes     float32 (4, p)   unit normal and its product with the point
    boards     float32 (8, p)   two unit directions along each plane, each divided by the squares' side, and the
                                coordinates of the plane's own point along them
    materials  int32 (s+p+t, 2) the material of each object, twice; a chequerboard's two
    corners    float32 (9, t)   the corners of each triangle
    normals    float32 (9, t)   unit normals there
    modes      uint8 (t,)       FLAT, RAW, UNIT or COLOURS
    """

    spheres: Array
    planes: Array
    boards: Array
    materials: Array
    corners: Array
    normals: Array
    modes: Array
    meshes: tuple[Mesh, ...]

    @property
    def arrays(self) -> tuple[Array, ...]:
        """All of them, in this order, as `ray_kernels` takes them."""
        return self.spheres, self.planes, self.boards, self.materials, self.corners, self.normals, self.modes

    @cached_property
    def embree(self) -> Callable[..., Any] | None:
        """The query of an Embree scene with all triangles; None without meshes.

        Raises InputError if embreex is not installed.
        """
        if not self.corners.shape[1]:
            return None
        try:
            from embreex.mesh_construction import TriangleMesh
            from embreex.rtcore_scene import EmbreeScene
        except ImportError as problem:
            fix = "install it: pip install 'phongbench[scene]'"
            raise InputError("meshes need Embree, and embreex is not installed", None, fix) from problem
        scene = EmbreeScene()
        corners = np.ascontiguousarray(self.corners.T).reshape(-1, 3)
        TriangleMesh(scene, corners, np.arange(len(corners), dtype=np.int32).reshape(-1, 3))
        query: Callable[..., Any] = scene.run
        # the first query builds the tree, and two threads must not build it at once
        query(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32), query="OCCLUDED")
        return query


def geometry(scene: Scene) -> Geometry:
    """The arrays of a scene, built once for all pictures of its objects, Embree's tree included.

    Raises InputError if its meshes have too many triangles, or if Embree is needed and not installed.
    """
    found: Geometry = scene.cache.of("geometry", None, lambda: _ready(scene))
    return found


def _ready(scene: Scene) -> Geometry:
    """The geometry with its tree, which threads that draw must not begin to build at once."""
    found = _built(scene)
    _ = found.embree
    return found


def _built(scene: Scene) -> Geometry:
    spheres: list[Sphere] = scene.of(Sphere)
    planes: list[Plane] = scene.of(Plane)
    meshes: tuple[Mesh, ...] = tuple(scene.of(Mesh))
    triangles = sum(len(mesh.faces) for mesh in meshes)
    if triangles > MOST_TRIANGLES:
        raise InputError(f"{triangles:,} triangles are more than {MOST_TRIANGLES:,}", "objects", "use coarser meshes")
    worn = [(s.material, s.material) for s in spheres]
    worn += [(p.pattern.even, p.pattern.odd) if p.pattern else (p.material, p.material) for p in planes]
    materials = np.array(worn, np.int32).reshape(-1, 2)
    for mesh in meshes:
        materials = np.concatenate([materials, np.stack([mesh.materials, mesh.materials], axis=1)])
    return Geometry(
        np.array([(*s.centre, s.radius) for s in spheres], np.float32).reshape(-1, 4).T.copy(),
        np.array([(*p.normal, np.dot(p.normal, p.point)) for p in planes], np.float32).reshape(-1, 4).T.copy(),
        np.array([_board(p) for p in planes], np.float32).reshape(-1, 8).T.copy(),
        np.ascontiguousarray(materials, dtype=np.int32),
        _of_corners(meshes, "vertices"),
        _of_corners(meshes, "normals"),
        np.concatenate([np.zeros(0, np.uint8), *(np.full(len(m.faces), _mode(m), np.uint8) for m in meshes)]),
        meshes,
    )


def _of_corners(meshes: tuple[Mesh, ...], name: str) -> Array:
    parts = [getattr(m, name)[m.faces].reshape(-1, 9) for m in meshes]
    return np.concatenate([np.zeros((0, 9)), *parts]).T.astype(np.float32, order="C")


def _mode(mesh: Mesh) -> int:
    if mesh.smooth == "normals":
        return UNIT if mesh.unit else RAW
    return COLOURS if mesh.smooth == "colours" else FLAT


def axes(plane: Plane) -> tuple[Array, Array]:
    """Two unit directions along a plane, as near to the world's axes as can be; their cross product is its normal."""
    normal = np.array(plane.normal)
    least = np.eye(3)[int(np.argmin(np.abs(normal)))]
    across = np.cross(normal, least)
    across /= np.linalg.norm(across)
    return across, np.cross(normal, across)


def _board(plane: Plane) -> tuple[float, ...]:
    """The directions in units of a square, and the plane's own point along them."""
    across, along = axes(plane)
    side = plane.pattern.side if plane.pattern else 1.0
    point = np.array(plane.point)
    return (*across / side, *along / side, np.dot(across, point) / side, np.dot(along, point) / side)
