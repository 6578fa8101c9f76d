"""Rays find what geometry says they find."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from phongbench.benchmarks import numpy_tracer
from phongbench.errors import CancelledError
from phongbench.formulas.formula import Formula
from phongbench.inputs import meshes
from phongbench.scenes import camera as views
from phongbench.scenes import ray_kernels
from phongbench.scenes.geometry import geometry
from phongbench.scenes.render import render
from phongbench.scenes.scene import Camera, Chequerboard, Material, Mesh, Picture, Plane, Scene, Sphere, SurfaceMaterial
from phongbench.scenes.scene_files import examples, read_scene
from phongbench.scenes.skip_bounds import Bounds
from phongbench.scenes.skips import SceneSkips
from phongbench.shading.lighting import Light
from phongbench.support.progress import Progress

Written = Callable[[str], Scene]


def nearest(origins: Any, directions: Any, spheres: Any = (), planes: Any = ()) -> tuple[Any, Any]:
    """Distances and numbers of what rays hit: spheres (x, y, z, r), planes (nx, ny, nz, c)."""
    count = len(origins)
    rays = np.concatenate([np.transpose(origins), np.transpose(directions)]).astype(np.float32, order="C")
    t, spare, which = np.empty(count, np.float32), np.empty(count, np.float32), np.empty(count, np.int32)
    *c, r = np.array(spheres, float).reshape(-1, 4).T
    balls = np.array([*c, r, *(-np.array(c) / r), (np.square(c).sum(axis=0) - r * r) / r], np.float32)
    walls = np.array(planes, np.float32).reshape(-1, 4).T.copy()
    names = np.arange(len(spheres) + len(planes), dtype=np.int32)
    ray_kernels.nearest(rays, count, (balls, walls, names), (t, which, spare))
    return t, which


@given(st.floats(0, 0.99), st.floats(0, 2 * math.pi), st.floats(0.01, 10), st.floats(2, 200))
@settings(max_examples=60, deadline=None)
def test_a_sphere_is_hit_where_its_chord_begins(offset: float, turn: float, radius: float, away: float) -> None:
    """Passing the centre at b, a ray that starts at distance D goes D - sqrt(r^2 - b^2)."""
    b = offset * radius
    origin = (b * math.cos(turn), b * math.sin(turn), 0.0)
    t, which = nearest([origin], [(0.0, 0.0, 1.0)], [(0.0, 0.0, away + radius, radius)])
    assert which[0] == 0
    exact = away + radius - math.sqrt(radius**2 - b**2)
    # float32 rounds b^2 against r^2 by an epsilon, which the square root of what is left turns into this much
    rounding = 2e-7 * (radius**2 / math.sqrt(radius**2 - b**2) + away + radius)
    assert abs(float(t[0]) - exact) < 4 * rounding


@given(st.floats(1.001, 5), st.floats(0.1, 10))
@settings(max_examples=30, deadline=None)
def test_a_ray_that_passes_a_sphere_misses_it(offset: float, radius: float) -> None:
    t, which = nearest([(offset * radius, 0, 0)], [(0, 0, 1)], [(0, 0, 3 * radius, radius)])
    assert which[0] == -1
    assert np.isinf(t[0])


def test_a_ray_from_inside_hits_the_far_side_and_one_that_leads_away_nothing() -> None:
    t, which = nearest([(0, 0, 0), (0, 0, 3)], [(0, 0, 1), (0, 0, 1)], [(0, 0, 0, 2)])
    assert t[0] == pytest.approx(2)
    assert list(which) == [0, -1]


@given(st.floats(0.05, 1.5), st.floats(0.1, 50))
@settings(max_examples=40, deadline=None)
def test_a_plane_is_hit_at_its_height_over_the_slope(angle: float, height: float) -> None:
    direction = (math.cos(angle), -math.sin(angle), 0.0)
    t, which = nearest([(0, height, 0)] * 2, [direction, (0, 1, 0)], planes=[(0, 1, 0, 0)])
    assert t[0] == pytest.approx(height / math.sin(angle), rel=1e-5)
    assert list(which) == [0, -1]


def test_the_nearest_of_many_wins_and_is_named() -> None:
    spheres = [(0, 0, z, 0.5) for z in (9, 3, 6)]
    t, which = nearest([(0, 0, 0)], [(0, 0, 1)], spheres, [(0, 0, 1, 2.75), (0, 0, 1, 2.25)])
    assert (float(t[0]), int(which[0])) == (2.25, 4)


def test_rays_of_the_camera_are_unit_and_meet_the_corners() -> None:
    camera = Camera((1.0, 2.0, 3.0), (1.0, 2.0, -7.0), field_of_view=90.0)
    places, pixels = views.pixel_order(4, 2, 1)
    rays = np.empty((6, 8), np.float32)
    views.primary_rays(views.frame(camera, 4, 2), (0, 0), places, (4, 2), rays)
    assert np.allclose(np.linalg.norm(rays[3:], axis=0), 1)
    assert sorted(pixels) == list(range(8))
    first = rays[:, list(pixels).index(0)]  # upper left: one and a half pixels left of the middle, half a pixel up
    assert np.allclose(first[3:] / -first[5], (-1.5, 0.5, -1), atol=1e-6)


@pytest.mark.parametrize("samples", [1, 3])
def test_every_sample_of_a_tile_is_drawn_once(samples: int) -> None:
    places, pixels = views.pixel_order(50, 35, samples)
    assert len({(int(x), int(y)) for x, y in places}) == 50 * 35 * samples**2
    assert (np.bincount(pixels) == samples**2).all()


ANALYTIC = [name for name in examples() if not read_scene(name).of(Mesh)]


@pytest.mark.parametrize("name", ANALYTIC)
def test_the_plain_twin_draws_the_same_picture(name: str) -> None:
    """All pixels agree but those whose ray passes an edge: of a sphere, a shadow or a square."""
    scene = read_scene(name)
    size = (128, 72)
    fast = render(scene, size=size, skips=SceneSkips.exact()).picture
    slow, rays = numpy_tracer.trace(scene, size=size)
    apart = np.abs(fast - slow).max(axis=2)
    assert (apart > 1e-3).mean() < 2e-3
    assert np.median(apart) < 1e-6
    assert abs(render(scene, size=size, skips=SceneSkips.exact()).rays - rays) < 1e-3 * rays


def box(reflectivity: float, depth: int) -> Scene:
    """A camera in a closed box of mirrors with a lamp that shines nowhere: what it sees is ambient light."""
    wall = SurfaceMaterial("wall", Material((0.5, 0.25, 0.125)), reflectivity)
    sides = [(axis, sign) for axis in range(3) for sign in (-1.0, 1.0)]
    normals = [[sign * (axis == i) for i in range(3)] for axis, sign in sides]
    planes = [Plane((-2 * x, -2 * y, -2 * z), (x, y, z), 0) for x, y, z in normals]
    picture = Picture((20, 12), depth)
    return Scene(
        "box", Camera((0.1, 0.2, 0.3), (1.0, 0.7, 0.1)), (wall,), tuple(planes), (), (1.0, 1.0, 1.0), picture=picture
    )


@pytest.mark.parametrize("depth", [0, 1, 5, 64])
@pytest.mark.parametrize("reflectivity", [0.5, 1.0])
def test_a_closed_box_of_mirrors_ends_at_the_depth_limit(reflectivity: float, depth: int) -> None:
    """Every surface shows ambient light a: (1 - k) a (1 + k + ... + k^depth) = a (1 - k^(depth + 1))."""
    done = render(box(reflectivity, depth), skips=SceneSkips.exact())
    expected = np.array([0.5, 0.25, 0.125]) * (1 - reflectivity ** (depth + 1))
    assert np.allclose(done.picture, expected, atol=1e-5)
    assert done.rays == 20 * 12 * (depth + 1)


@pytest.mark.parametrize("cutoff", [0.3, 0.05, 0.01])
def test_a_contribution_cutoff_costs_no_more_than_it_says(cutoff: float) -> None:
    scene = box(0.7, 64)
    full, cut = (render(scene, skips=replace(SceneSkips.exact(), cutoff=c)) for c in (0.0, cutoff))
    lost = float(np.abs(full.picture - cut.picture).max())
    line = next(line for line in cut.ledger if line.name == "cutoff")
    assert line.bound == pytest.approx(cutoff * Bounds(scene).brightest)
    assert 0 < lost <= line.bound
    assert cut.rays < full.rays


def test_light_adds_up(small: str, written: Written) -> None:
    """The picture under two lights is that under each, together, with ambient light and background once."""
    scene = replace(written(small), background=(0.0, 0.0, 0.0), ambient_light=(0.0, 0.0, 0.0))
    both, *each = (
        render(replace(scene, lights=lights), skips=SceneSkips.exact()).picture
        for lights in (scene.lights, scene.lights[:1], scene.lights[1:])
    )
    assert np.allclose(both, sum(each), rtol=1e-5, atol=1e-6)


def test_supersampling_is_the_mean_of_a_larger_picture(small: str, written: Written) -> None:
    scene = written(small)
    fine = render(scene, size=(96, 64), skips=SceneSkips.exact()).picture
    mixed = render(scene, size=(48, 32), supersampling=2, skips=SceneSkips.exact()).picture
    assert np.allclose(mixed, fine.reshape(32, 2, 48, 2, 3).mean(axis=(1, 3)), atol=1e-6)


@pytest.mark.parametrize(("tile", "threads"), [(16, 1), (16, 3), (64, 2), (1000, 2)])
def test_a_picture_depends_on_neither_tiles_nor_threads(small: str, written: Written, tile: int, threads: int) -> None:
    scene = written(small)
    one, two = render(scene, threads=1), render(scene, tile=tile, threads=threads)
    assert np.array_equal(one.picture, two.picture)
    assert one.rays == two.rays


@pytest.mark.parametrize("threads", [1, 2])
def test_a_cancelled_picture_is_given_up(small: str, written: Written, threads: int) -> None:
    asked: list[int] = []

    def cancelled() -> bool:
        asked.append(1)
        return len(asked) > 3

    with pytest.raises(CancelledError):
        render(written(small), tile=8, threads=threads, cancelled=cancelled)
    assert len(asked) <= 3 + threads  # of 24 tiles


def test_progress_is_told_of_every_tile(small: str, written: Written) -> None:
    class Told(Progress):
        """Counts."""

        def __init__(self) -> None:
            self.total, self.done = 0.0, 0.0

        def stage(self, text: str, total: float | None = None) -> None:
            self.total = total or 0

        def advance(self, steps: float = 1) -> None:
            self.done += steps

    told = Told()
    render(written(small), tile=16, progress=told)
    assert told.done == told.total == 6


@pytest.mark.parametrize("far", [True, False])
@pytest.mark.parametrize("meshed", [False, True])
def test_shadows_fall_where_the_light_is_hidden(meshed: bool, far: bool) -> None:
    """A ball of radius 1 at height 3, lit from straight above, darkens the ground within radius 1 and nothing else."""
    white = SurfaceMaterial("white", Material((0, 0, 0), (1, 1, 1)))
    made = meshes.icosphere(1.0)
    mesh = Mesh(
        np.add(made.vertices, (0, 3, 0)), made.faces.astype(np.int32), made.normals, np.zeros(len(made.faces), np.int32)
    )
    light = Light(direction=(0.0, 1.0, 0.0)) if far else Light(position=(0.0, 1e5, 0.0))
    scene = Scene(
        "ball",
        Camera((0.0, 1.5, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), 90.0),
        (white,),
        (mesh if meshed else Sphere((0.0, 3.0, 0.0), 1.0, 0), Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0)),
        (light,),
        picture=Picture((200, 200), 0, shadows=True),
    )
    picture = render(scene).picture[..., 0]
    y, x = np.mgrid[0:200, 0:200]
    radius = 1.5 * np.hypot((x + 0.5) / 100 - 1, (y + 0.5) / 100 - 1)
    assert (picture[radius < 0.99] == 0).all()
    assert np.allclose(picture[radius > 1.01], 1, atol=1e-5)


def test_a_pattern_changes_at_its_squares() -> None:
    reds = [SurfaceMaterial(name, Material((red, 0, 0))) for name, red in (("even", 1.0), ("odd", 0.25))]
    plane = Plane((0.25, 0.0, 0.25), (0.0, 1.0, 0.0), 0, Chequerboard(0, 1, 0.5))
    scene = Scene(
        "board",
        Camera((0.0, 2.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), 53.13010235),
        tuple(reds),
        (plane,),
        (),
        (1.0, 1.0, 1.0),
        picture=Picture((64, 64), 0),
    )
    picture = render(scene).picture[..., 0]  # 2 units wide: 32 pixels a unit, 16 a square, shifted by 8
    assert set(np.unique(picture)) == {0.25, 1.0}
    blocks = picture[8:56, 8:56].reshape(3, 16, 3, 16).transpose(0, 2, 1, 3).reshape(9, -1)
    assert (blocks == blocks[:, :1]).all()
    assert (blocks[:-1, 0] != blocks[1:, 0]).all()


@pytest.mark.parametrize("depth", [0, 1])
@pytest.mark.parametrize("smooth", ["normals", "none", "colours"])
def test_a_fine_mesh_looks_like_the_sphere_it_stands_for(small: str, written: Written, smooth: str, depth: int) -> None:
    """Its mirror image and shadows, too; Gouraud shading mirrors, and takes light and shadow from its corners."""
    scene = written(small)
    ball = 'shape = "sphere"\ncentre = [0.0, 0.8, 0.0]\nradius = 0.8\nmaterial = "mirror"'
    assert ball in small
    mesh = f'shape = "mesh"\nsurface = "icosphere"\ndegrees = 1\nsmooth = "{smooth}"\nscale = 0.8\n'
    other = written(small.replace(ball, mesh + 'translate = [0.0, 0.8, 0.0]\nmaterial = "mirror"'))
    one, two = (render(s, depth=depth, shadows=True, specular=Formula()).picture for s in (scene, other))
    apart = np.abs(one - two).max(axis=2)
    assert np.median(apart) < 1e-4
    assert (apart > 0.02).mean() < 0.03 + 0.03 * depth


def test_raw_normals_are_shorter_than_unit_inside_a_triangle(small: str, written: Written) -> None:
    mesh = '[[objects]]\nshape = "mesh"\nsurface = "icosphere"\ndegrees = 40\nmaterial = "white"\n'
    mesh += "translate = [3.0, 1.0, 0.0]\n"
    unit, raw = (written(small + mesh + f'normals = "{kind}"\n') for kind in ("unit", "raw"))
    assert geometry(unit).modes[0] != geometry(raw).modes[0]
    bright, dim = (render(s, depth=0).picture.sum() for s in (unit, raw))
    assert dim < bright
