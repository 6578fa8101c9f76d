"""A scene as arrays that kernels read: every object's numbers in eye space, and which material it wears."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.scenes.eye_space import EyeSpace, eye_space
from phongbench.scenes.scene import MOST_TRIANGLES, Mesh, Plane, Scene, Sphere

#: how triangles are shaded between their vertices
FLAT, RAW, UNIT, COLOURS = 0, 1, 2, 3
#: how far from a triangle a ray starts, in bounds of what one rounding of float32 moves it by. Of six million rays,
#: grazing ones and narrow triangles among them, Embree stopped some at their own triangle from 1 away, none from 2
_FACE_LIFT = 4 * 2.0**-24


@dataclass(frozen=True, eq=False)
class Geometry:
    """Objects are numbered: spheres first, then planes, then the triangles of all meshes. Lengths are in eye space.

    spheres    float32 (8, s)   centre c and radius r; -c / r, and (|c|^2 - r^2) / r, without the cancellation that
                                float32 would suffer
    planes     float32 (4, p)   unit normal and its product with the point
    boards     float32 (8, p)   two unit directions along each plane, each divided by the squares' side, and the
                                coordinates of the plane's own point along them
    materials  int32 (s+p+t, 2) the material of each object, twice; a chequerboard's two
    corners    float32 (9, t)   the corners of each triangle
    normals    float32 (9, t)   unit normals there
    modes      uint8 (t,)       FLAT, RAW, UNIT or COLOURS
    faces      float32 (6, t)   unit normal of each triangle itself, and how far above it a ray must start that shall
                                not find it again by rounding; the normal's product with a corner; the box's size and
                                distance
    space      of the camera that it was built for
    """

    spheres: Array
    planes: Array
    boards: Array
    materials: Array
    corners: Array
    normals: Array
    modes: Array
    faces: Array
    space: EyeSpace

    @property
    def arrays(self) -> tuple[Array, ...]:
        """All of them, in this order, as `ray_kernels` takes them."""
        bodies = self.spheres, self.planes, self.boards, self.materials
        return *bodies, self.corners, self.normals, self.modes, self.faces

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
    """The arrays of a scene, built once for all pictures of its objects from one place, Embree's tree included.

    Raises InputError if its meshes have too many triangles, or if Embree is needed and not installed.
    """
    found: Geometry = scene.cache.of("geometry", tuple(scene.camera.position), lambda: _ready(scene))
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
    space = eye_space(scene)
    corners = _of_corners([space.places(mesh.vertices) for mesh in meshes], meshes)
    return Geometry(
        _spheres(spheres, space),
        np.array([_plane(p, space) for p in planes], np.float32).reshape(-1, 4).T.copy(),
        np.array([_board(p, space) for p in planes], np.float32).reshape(-1, 8).T.copy(),
        np.ascontiguousarray(materials, dtype=np.int32),
        corners,
        _of_corners([mesh.normals for mesh in meshes], meshes),
        np.concatenate([np.zeros(0, np.uint8), *(np.full(len(m.faces), _mode(m), np.uint8) for m in meshes)]),
        _faces(corners),
        space,
    )


def _spheres(spheres: list[Sphere], space: EyeSpace) -> Array:
    centres = space.places(np.array([s.centre for s in spheres]).reshape(-1, 3)).T
    radii = np.array([s.radius for s in spheres]) / space.unit
    away = np.sqrt((centres * centres).sum(axis=0))
    powers = (away - radii) * (away + radii) / radii
    with np.errstate(over="ignore"):  # of a sphere so small and far that its power is never asked for
        return np.array([*centres, radii, *(-centres / radii), powers], np.float32)


def _plane(plane: Plane, space: EyeSpace) -> tuple[float, ...]:
    return (*plane.normal, np.dot(plane.normal, space.places(plane.point)))


def _of_corners(rows: list[Array], meshes: tuple[Mesh, ...]) -> Array:
    """What the vertices of each mesh have, at the corners of its triangles: float32 (9, t)."""
    parts = [row[mesh.faces].reshape(-1, 9) for row, mesh in zip(rows, meshes, strict=True)]
    return np.concatenate([np.zeros((0, 9)), *parts]).T.astype(np.float32, order="C")


def _faces(corners: Array) -> Array:
    """Each triangle's own normal, 0 where it has no area, its lift, its plane and its size: the rows of `faces`.

    Rounding moves a point of it along the normal n by |n|.(|v| + |e|), v the corners and e the box's sides, and Embree,
    which takes n from two edges, turns it by as much of every product (a narrow triangle most): component by component,
    so that nothing is lost where a side is 0. After Waechter and Raab, Self-Intersection Avoidance, NVIDIA 2022.
    """
    a, b, c = corners.astype(np.float64).reshape(3, 3, -1)
    (u, v), ends = (b - a, c - a), np.stack([a, b, c])
    normals = np.cross(u, v, axis=0)
    lengths = np.sqrt((normals * normals).sum(axis=0))
    lengths = np.where(lengths > 0, lengths, 1.0)
    sides = ends.max(axis=0) - ends.min(axis=0)
    u, v = np.abs(u), np.abs(v)
    turned = u[[1, 2, 0]] * v[[2, 0, 1]] + u[[2, 0, 1]] * v[[1, 2, 0]]
    reach = np.abs(ends).max(axis=0) + sides
    lifts = _FACE_LIFT * (np.abs(normals) * reach + turned * sides).sum(axis=0) / lengths
    normals /= lengths
    return np.array([*normals, lifts, (normals * a).sum(axis=0), reach.sum(axis=0)], np.float32)


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


def _board(plane: Plane, space: EyeSpace) -> tuple[float, ...]:
    """The directions in units of a square, and the plane's own point along them, but for whole pairs of squares."""
    directions = np.array(axes(plane)) * (space.unit / plane.pattern.side if plane.pattern else 1.0)
    return (*directions.ravel(), *(directions @ space.places(plane.point) % 2.0))
