"""Triangle meshes with a normal at each vertex, and three tessellated surfaces whose true normals are known.

Coordinates are float64. Normals are unit length; between vertices a renderer interpolates them linearly, and that is
where short normals come from. An edge's angle is the angle between the normals at its two ends.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler.precisions import Array

#: a triangle whose height is below this share of its longest edge is degenerate
FLAT = 1e-12
#: radius of the torus' tube, where its circle has radius 1
TUBE = 0.4


@dataclass(frozen=True, eq=False)
class Surface:
    """A triangle mesh.

    name          str              icosphere, torus, uv-sphere, or a file's name
    vertices      float64 (n, 3)   finite
    normals       float64 (n, 3)   unit length, one for each vertex
    faces         int64   (m, 3)   vertices of each triangle, none degenerate; m >= 1
    notes         sentences        what a file holds that is changed or left out, with counts
    remarks       sentences        what a file leaves to its reader, with counts: polygons to cut, normals to make
    left_out      int              degenerate triangles that a file holds
    true_normals  (n, 3) -> (n, 3) unit normals of the true surface at the points nearest to these; None if unknown
    """

    name: str
    vertices: Array
    normals: Array
    faces: NDArray[np.int64]
    notes: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    left_out: int = 0
    true_normals: Callable[[Array], Array] | None = field(default=None, repr=False)

    def edge_degrees(self) -> Array:
        """(m,) the angle of each triangle's widest edge, in degrees."""
        corners = self.normals[self.faces]
        chords = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        return np.asarray(np.degrees(2 * np.arcsin(np.minimum(chords / 2, 1.0))))

    def areas(self) -> Array:
        """(m,) the area of each triangle."""
        return np.asarray(0.5 * np.linalg.norm(_twice_area(self.vertices[self.faces]), axis=1))


def icosphere(degrees: float) -> Surface:
    """The unit sphere as an icosahedron whose faces are divided evenly, and pushed out.

    degrees  the widest edge wanted; divisions are whole, so the edges are near it: 1 % at 5 degrees, a fifth at 30
    """
    golden = (1 + math.sqrt(5)) / 2
    base = np.array([p for x in (-1, 1) for y in (-golden, golden) for p in ((0, x, y), (x, y, 0), (y, 0, x))])
    near = np.abs(np.linalg.norm(base[:, None] - base, axis=2) - 2) < 1e-9
    triples = ((i, j, k) for i in range(12) for j in range(i) for k in range(j))
    triangles = [t for t in triples if near[t[0], t[1]] and near[t[1], t[2]] and near[t[2], t[0]]]
    # an edge in the middle of a face is the widest: the face's edge over its distance from the centre
    widest = math.degrees(2 / math.sqrt(np.sum(base[list(triangles[0])].mean(axis=0) ** 2)))
    n = max(1, round(widest / degrees))
    steps = np.array([(i, j) for i in range(n + 1) for j in range(n + 1 - i)])
    place = np.full((n + 1, n + 1), -1)
    place[steps[:, 0], steps[:, 1]] = np.arange(len(steps))
    i, j = steps[steps.sum(axis=1) < n].T
    up = np.stack([place[i, j], place[i + 1, j], place[i, j + 1]], axis=1)
    i, j = steps[steps.sum(axis=1) < n - 1].T
    down = np.stack([place[i + 1, j], place[i + 1, j + 1], place[i, j + 1]], axis=1)
    weights = np.column_stack([n - steps.sum(axis=1), steps]) / n
    points = unit((weights @ base[np.array(triangles)]).reshape(-1, 3))
    shifts = len(steps) * np.arange(len(triangles))[:, None, None]
    faces = _outward(points, points, (np.concatenate([up, down]) + shifts).reshape(-1, 3))
    return Surface("icosphere", points, points, faces, true_normals=unit)


def uv_sphere(degrees: float) -> Surface:
    """The unit sphere in meridians and parallels, each quad cut in two: the widest edge is a diagonal at the equator.

    degrees  the widest edge wanted; divisions are whole, so the edges are near it
    """
    n = max(2, round(180 * math.sqrt(2) / degrees))
    turn, tilt = _grid(2 * n, n, math.pi)
    points = np.stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)], axis=-1).reshape(-1, 3)
    points, halves = unit(points), _halves(2 * n, n)
    faces = _outward(points, points, halves[have_area(points, halves)])
    return Surface("uv-sphere", points, points, faces, true_normals=unit)


def torus(degrees: float) -> Surface:
    """A circle of radius 1 around z with a tube of radius TUBE: it bends both ways, and inwards on its inner side.

    degrees  the widest edge wanted, a diagonal on the outer equator; divisions are whole, so the edges are near it
    """
    n = max(3, round(360 * math.sqrt(2) / degrees))
    turn, tilt = _grid(n, n, 2 * math.pi)
    normals = np.stack([np.cos(tilt) * np.cos(turn), np.cos(tilt) * np.sin(turn), np.sin(tilt)], axis=-1).reshape(-1, 3)
    circle = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=-1).reshape(-1, 3)
    points = circle + TUBE * normals
    faces = _outward(points, normals, _halves(n, n))
    return Surface("torus", points, normals, faces, true_normals=_torus_normals)


#: name -> (widest edge in degrees) -> Surface
TESSELLATIONS: Mapping[str, Callable[[float], Surface]] = {
    "icosphere": icosphere,
    "torus": torus,
    "uv-sphere": uv_sphere,
}


def area_weighted_normals(vertices: Array, faces: NDArray[np.int64]) -> Array:
    """(n, 3) unit normals: the mean over the triangles at each place, weighted by their areas.

    Vertices at equal places share one normal, so a seam of a texture does not show. +z where no triangle meets, or
    where they cancel.
    """
    _, place = np.unique(vertices, axis=0, return_inverse=True)
    place = place.reshape(-1)
    total = np.zeros((int(place.max()) + 1, 3))
    weighted = _twice_area(vertices[faces])
    for corner in range(3):
        np.add.at(total, place[faces[:, corner]], weighted)
    total[np.abs(total).max(axis=1) == 0] = (0.0, 0.0, 1.0)
    return unit(total / np.abs(total).max(axis=1, keepdims=True))[place]


def unit(vectors: Array) -> Array:
    """The directions of vectors along the last axis, of length 1."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _twice_area(corners: Array) -> Array:
    """(m, 3) normals of triangles, as long as twice their areas."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def have_area(vertices: Array, faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(m,) whether each triangle is not degenerate."""
    corners = vertices[faces]
    longest = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2).max(axis=1)
    return np.asarray(np.linalg.norm(_twice_area(corners), axis=1) > FLAT * longest)


def _outward(vertices: Array, normals: Array, faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """The triangles, each counter-clockwise as seen from where its normals point."""
    inward = (_twice_area(vertices[faces]) * normals[faces].sum(axis=1)).sum(axis=1) < 0
    return np.where(inward[:, None], faces[:, ::-1], faces)


def _grid(columns: int, rows: int, height: float) -> tuple[Array, Array]:
    """(rows + 1, columns + 1) angles: a full turn along, 0 .. height down."""
    turn, tilt = np.meshgrid(np.linspace(0, 2 * np.pi, columns + 1), np.linspace(0, height, rows + 1))
    return turn, tilt


def _halves(columns: int, rows: int) -> NDArray[np.int64]:
    """Two triangles for each quad of a grid."""
    down, along = (x.ravel() for x in np.mgrid[0:rows, 0:columns])
    a = down * (columns + 1) + along
    b, c, d = a + columns + 1, a + columns + 2, a + 1
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def _torus_normals(points: Array) -> Array:
    """Away from the nearest point of the circle."""
    across = np.hypot(points[:, 0], points[:, 1])[:, None]
    middle = np.concatenate([points[:, :2] / across, np.zeros_like(across)], axis=1)
    return unit(points - middle)
