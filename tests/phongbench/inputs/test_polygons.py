"""Polygons become triangles that cover them once, whatever their shape."""

import numpy as np
import pytest

from phongbench.inputs import polygons

NOTCH = [(-1, -1), (0, -0.5), (1, -1), (0, 1)]
ARROW = [(0, 0), (2, 1), (0, 2), (0.5, 1)]
SHAPES = {
    "square": [(0, 0), (1, 0), (1, 1), (0, 1)],
    "notch": NOTCH,
    "arrow, from each corner": ARROW[3:] + ARROW[:3],
    "L": [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)],
    "U": [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)],
    "comb": [(0, 0), (9, 0), *((9 - i, 3 if i % 2 == 0 else 1) for i in range(10))],
    "spiral": [
        *((0, 0), (6, 0), (6, 6), (1, 6), (1, 2), (4, 2), (4, 4)),
        *((3, 4), (3, 3), (2, 3), (2, 5), (5, 5), (5, 1), (0, 1)),
    ],
    "corners on an edge": [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)],
    "keyhole": [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)],
    "star": [((3 - i % 2) * np.cos(i * np.pi / 9), (3 - i % 2) * np.sin(i * np.pi / 9)) for i in range(18)],
}


def area(points):
    """The signed area of a polygon."""
    x, y = np.asarray(points, float).T
    return 0.5 * float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())


def tilted(points):
    """A flat shape somewhere in space, and the way its front looks."""
    shape = np.column_stack([np.asarray(points, float), np.zeros(len(points))])
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    return shape @ turn.T + (5, -3, 2), turn[:, 2]


def areas(places, triangles, front):
    """The signed area of each triangle, positive where it looks to the front."""
    a, b, c = np.moveaxis(places[triangles], 1, 0)
    return 0.5 * np.cross(b - a, c - a) @ front


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_shape_is_covered_once(name, mirrored):
    shape = SHAPES[name]
    for first in range(len(shape)):
        points = shape[first:] + shape[:first]
        places, front = tilted(points[::-1] if mirrored else points)
        triangles, owners, crossing = polygons.triangles(places, np.array([len(points)]))
        assert crossing == 0
        assert len(triangles) == len(points) - 2
        assert set(owners.tolist()) == {0}
        parts = areas(places, triangles, -front if mirrored else front)
        assert parts.min() > -1e-9
        assert parts.sum() == pytest.approx(area(shape))


def test_a_random_star_of_many_corners_is_covered_once():
    rng = np.random.default_rng(1)
    angles = np.sort(rng.uniform(0, 2 * np.pi, 400))
    points = rng.uniform(0.2, 1, 400)[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    places, front = tilted(points)
    triangles, _, crossing = polygons.triangles(places, np.array([400]))
    parts = areas(places, triangles, front)
    assert (crossing, len(triangles)) == (0, 398)
    assert parts.min() > -1e-12
    assert parts.sum() == pytest.approx(area(points))


def test_triangles_come_in_the_order_of_their_polygons():
    shapes = [SHAPES[name] for name in ("square", "L", "notch", "square")]
    shapes.insert(2, [(0, 0), (1, 0), (0, 1)])
    sizes = np.array([len(shape) for shape in shapes])
    places = np.concatenate([tilted(shape)[0] for shape in shapes])
    triangles, owners, _ = polygons.triangles(places, sizes)
    assert owners.tolist() == np.repeat(np.arange(5), sizes - 2).tolist()
    first = np.cumsum(sizes) - sizes
    assert all(first[o] <= corner < first[o] + sizes[o] for t, o in zip(triangles, owners, strict=True) for corner in t)


BOW = [(0, 0), (1, 1), (1, 0), (0, 1)]
CROSSED = [(0, 0), (3, 3), (3, 0), (0, 3), (-1, 1)]
LINE = [(0, 0), (1, 0), (2, 0), (3, 0)]


@pytest.mark.parametrize("shape", [BOW, CROSSED, LINE])
def test_what_crosses_itself_or_is_flat_is_counted_and_cut_as_a_fan(shape):
    places, _ = tilted(shape)
    triangles, _, crossing = polygons.triangles(places, np.array([len(shape)]))
    assert crossing == (shape is not LINE)
    assert triangles.tolist() == [[0, i, i + 1] for i in range(1, len(shape) - 1)]
