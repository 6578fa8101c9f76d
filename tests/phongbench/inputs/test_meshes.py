"""Surfaces: closed, turned outwards, as finely cut as asked, and with the true normals of what they stand for."""

import math

import numpy as np
import pytest

from phongbench.inputs import meshes
from phongbench.inputs.meshes import TESSELLATIONS, TUBE

AREA = {"icosphere": 4 * math.pi, "uv-sphere": 4 * math.pi, "torus": 4 * math.pi**2 * TUBE}


@pytest.fixture(params=[(name, degrees) for name in TESSELLATIONS for degrees in (3.0, 10.0, 30.0)], ids=str)
def tessellated(request):
    """A surface and the widest edge that was asked for."""
    name, degrees = request.param
    return TESSELLATIONS[name](degrees), degrees


def test_edges_are_as_wide_as_asked(tessellated):
    surface, degrees = tessellated
    assert surface.edge_degrees().max() == pytest.approx(degrees, rel=0.25 if degrees > 20 else 0.07)


@pytest.mark.parametrize("degrees", [2.0, 360 * 2**0.5 / 200])
@pytest.mark.parametrize("name", TESSELLATIONS)
def test_a_surface_of_many_triangles_has_edges_as_wide_as_asked_to_the_nearest_division(name, degrees):
    """From n divisions to n + 1 the edge changes by 1 / n, so half of that is as near as a whole n comes."""
    surface = TESSELLATIONS[name](degrees)
    divisions = {"icosphere": (len(surface.faces) / 20) ** 0.5, "torus": (len(surface.faces) / 2) ** 0.5}
    n = divisions.get(name, 0.5 + (len(surface.faces) / 4 + 0.25) ** 0.5)
    assert surface.edge_degrees().max() == pytest.approx(degrees, rel=0.5 / n + 1e-3)


def test_a_surface_is_closed_and_each_triangle_is_turned_outwards(tessellated):
    surface, _ = tessellated
    _, place = np.unique(surface.vertices.round(9), axis=0, return_inverse=True)
    faces = place.reshape(-1)[surface.faces]
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forward, backward = ({tuple(e) for e in way.tolist()} for way in (edges, edges[:, ::-1]))
    assert len(forward) == len(edges)  # no edge twice in one direction
    assert forward == backward  # each has a triangle on either side
    corners = surface.vertices[surface.faces]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((outward * surface.normals[surface.faces].mean(axis=1)).sum(axis=1) > 0).all()


def test_the_area_comes_near_the_true_one_as_edges_shrink():
    for name, tessellate in TESSELLATIONS.items():
        missing = [1 - tessellate(degrees).areas().sum() / AREA[name] for degrees in (20.0, 10.0, 5.0)]
        assert 0 < missing[2] < missing[1] < missing[0]
        assert missing[1] / missing[2] == pytest.approx(4, rel=0.25)  # the square of the edge


def test_normals_are_unit_and_the_true_ones_at_the_vertices(tessellated):
    surface, _ = tessellated
    np.testing.assert_allclose(np.linalg.norm(surface.normals, axis=1), 1, rtol=1e-12)
    np.testing.assert_allclose(surface.true_normals(surface.vertices), surface.normals, atol=1e-12)


def test_true_normals_are_those_of_the_nearest_point():
    points = np.random.default_rng(5).normal(size=(200, 3))
    normals = meshes.torus(30.0).true_normals(points)
    circle = points * (1, 1, 0)
    circle /= np.linalg.norm(circle, axis=1, keepdims=True)
    away = points - circle
    np.testing.assert_allclose(np.cross(normals, away), 0, atol=1e-12)
    assert ((normals * away).sum(axis=1) > 0).all()


def test_law_10_interpolation_shortens_a_normal_by_an_eighth_of_the_edge_squared(tessellated):
    surface, _ = tessellated
    for first, second in ((0, 1), (1, 2), (2, 0)):
        a, b = (surface.normals[surface.faces[:, corner]] for corner in (first, second))
        angle = np.arccos(np.clip((a * b).sum(axis=1), -1, 1))
        short = 1 - np.linalg.norm((a + b) / 2, axis=1)
        np.testing.assert_allclose(short, 1 - np.cos(angle / 2), atol=1e-12)
        assert (short <= angle**2 / 8 + 1e-12).all()
        assert (short >= angle**2 / 8 - angle**4 / 384 - 1e-12).all()


def test_area_weighted_normals_do_not_see_seams_and_weigh_by_area():
    quad = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 0), (0, 2, 0), (0, 0, 1)], float)
    normals = meshes.area_weighted_normals(quad, np.array([(0, 1, 2), (3, 4, 5)]))
    np.testing.assert_allclose(normals[0], normals[3])  # one place, though two vertices
    np.testing.assert_allclose(normals[1], (0, 0, 1))
    np.testing.assert_allclose(normals[0], np.array([1, 0, 1]) / math.sqrt(2))
    sphere = meshes.icosphere(5.0)
    assert (meshes.area_weighted_normals(sphere.vertices.round(9), sphere.faces) * sphere.normals).sum(
        axis=1
    ).min() > 0.9999


def test_degenerate_triangles_are_found_at_any_size():
    flat, slim = [(0, 0, 0), (1, 1, 1), (2, 2, 2)], [(0, 0, 0), (1, 0, 0), (0.5, 1e-6, 0)]
    for size in (1e-20, 1.0, 1e20):
        vertices = size * np.array(flat + slim)
        faces = np.array([(0, 1, 2), (0, 0, 1), (3, 4, 5)])
        assert meshes.have_area(vertices, faces).tolist() == [False, False, True]
