"""Pictures at any scale and any place: as the plain float64 tracer draws them, and as they are at scale 1."""

from dataclasses import replace
from typing import Any

import mesh_twin
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from phongbench.benchmarks import numpy_tracer
from phongbench.errors import InputError
from phongbench.inputs import meshes
from phongbench.scenes.camera import check_camera
from phongbench.scenes.eye_space import eye_space
from phongbench.scenes.render import render
from phongbench.scenes.scene import Camera, Chequerboard, Mesh, Picture, Plane, Scene, Sphere, SurfaceMaterial
from phongbench.scenes.skips import SceneSkips
from phongbench.shading.lighting import Light, Material
from phongbench.support.image_files import codes

Array = Any
EXACT = SceneSkips.exact()
GREY = SurfaceMaterial("grey", Material((0.1,) * 3, (0.7,) * 3, (0.3,) * 3, 20.0), 0.4)
DARK = SurfaceMaterial("dark", Material((0.05,) * 3, (0.2,) * 3), 0.1)
BALL = meshes.icosphere(40.0)


def scene(objects: Any, camera: Camera, lights: Any = (), depth: int = 3, size: tuple[int, int] = (96, 64)) -> Scene:
    """Grey things under a lamp at (2, 4, 3), if no other light is given."""
    lit = tuple(lights) or (Light(position=(2.0, 4.0, 3.0)),)
    picture = Picture(size, depth, shadows=True)
    return Scene("s", camera, (GREY, DARK), tuple(objects), lit, background=(0.3, 0.4, 0.5), picture=picture)


def ball(smooth: str, centre: Any = (0.0, 0.5, 0.0), radius: float = 0.5) -> Mesh:
    """A sphere of some eighty triangles."""
    vertices = np.add(np.multiply(BALL.vertices, radius), centre)
    faces = BALL.faces.astype(np.int32)
    return Mesh(vertices, faces, BALL.normals, np.zeros(len(faces), np.int32), smooth=smooth)


def moved(old: Scene, scale: float = 1.0, shift: Any = (0.0, 0.0, 0.0)) -> Scene:
    """The same, all lengths multiplied, then all places shifted: a similar scene."""

    def place(point: Any) -> Any:
        return tuple((np.multiply(point, scale) + shift).tolist())

    def thing(one: Any) -> Any:
        if isinstance(one, Sphere):
            return replace(one, centre=place(one.centre), radius=one.radius * scale)
        if isinstance(one, Mesh):
            return replace(one, vertices=one.vertices * scale + shift)
        board = one.pattern and replace(one.pattern, side=one.pattern.side * scale)
        return replace(one, point=place(one.point), pattern=board)

    def light(one: Light) -> Light:
        if one.position is None:
            return one
        c, l, q = one.attenuation  # noqa: E741  its name in texts
        reach = one.reach and one.reach * scale
        return replace(one, position=place(one.position), attenuation=(c, l / scale, q / scale / scale), reach=reach)

    camera = replace(old.camera, position=place(old.camera.position), target=place(old.camera.target))
    return replace(old, camera=camera, objects=tuple(map(thing, old.objects)), lights=tuple(map(light, old.lights)))


def off(one: Array, two: Array) -> int:
    """How many pixels differ by more than an 8-bit code of linear light."""
    return int((np.abs(one - two).max(axis=2) > 1 / 255).sum())


def by_a_code(one: Array, two: Array) -> float:
    """The share of pixels whose sRGB codes differ."""
    return float((codes(one) != codes(two)).any(axis=2).mean())


TWO_BALLS = (Sphere((0.0, 0.5, 0.0), 0.5, 0), Sphere((1.1, 0.3, 0.4), 0.3, 0))
BOARD = Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0, Chequerboard(0, 1, 0.5))
FLOOR = Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1)
EYE = Camera((0.0, 1.5, 4.0), (0.0, 0.3, 0.0))
LAMPS = (
    Light(position=(2.0, 4.0, 3.0), attenuation=(0.5, 0.1, 0.02), reach=9.0),
    Light(direction=(-1.0, 2.0, 1.0), diffuse=(0.4, 0.3, 0.2)),
)
#: spheres and squares, mirrors that see each other, lights that fade and end, a mesh
STILL_LIFE = scene((*TWO_BALLS, BOARD, ball("normals", (-1.2, 0.5, 0.3))), EYE, LAMPS)


@pytest.mark.parametrize("shadows", [True, False])
@pytest.mark.parametrize("radius", [1e2, 1e3, 1e4, 1e5, 1e6, 1e7])
def test_a_ground_sphere_of_any_radius_is_drawn_as_in_float64(radius: float, shadows: bool) -> None:
    ground = Sphere((0.0, -radius, 0.0), radius, 0)
    wanted = scene((ground, *TWO_BALLS), EYE, size=(192, 128))
    truth, _ = numpy_tracer.trace(wanted, shadows=shadows)
    assert off(render(wanted, shadows=shadows, skips=EXACT).picture, truth) <= 2


def test_the_float64_tracer_agrees_with_one_of_longer_numbers() -> None:
    """What is a bar for others is itself far from its rounding, where a radius is 10^7."""
    if np.finfo(np.longdouble).eps == np.finfo(np.float64).eps:
        pytest.skip("no longer numbers here")
    wanted = scene((Sphere((0.0, -1e7, 0.0), 1e7, 0), *TWO_BALLS), EYE)

    class Longer(numpy_tracer._Tracer):
        rounding = np.longdouble(1e-12)

    longer = Longer(wanted, True, np.longdouble)
    picture = longer.follow(*longer.camera(96, 64), 3).reshape(64, 96, 3)
    assert off(picture.astype(float), numpy_tracer.trace(wanted)[0]) == 0


@pytest.mark.parametrize("scale", [1e-5, 1e-3, 1e3, 1e6])
def test_similar_scenes_are_equal_pictures(scale: float) -> None:
    one, two = (render(s, skips=EXACT).picture for s in (STILL_LIFE, moved(STILL_LIFE, scale)))
    assert by_a_code(one, two) <= 1e-3


@pytest.mark.parametrize("power", [-60, -17, 20, 60])
def test_scaling_by_a_power_of_two_changes_no_bit(power: int) -> None:
    """No length is compared with a fixed number: attenuation, reach, skips and their bounds are similar, too."""
    one, two = (render(s) for s in (STILL_LIFE, moved(STILL_LIFE, 2.0**power)))
    assert np.array_equal(one.picture, two.picture)
    assert [line.skipped for line in one.ledger] == [line.skipped for line in two.ledger]
    assert [line.bound for line in one.ledger] == pytest.approx([line.bound for line in two.ledger])


@pytest.mark.parametrize("shift", [(1e4, -2e4, 3e4), (-3e8, 0.0, 0.0)])
def test_a_scene_far_from_the_origin_is_the_same_picture(shift: Any) -> None:
    one, two = (render(s, skips=EXACT).picture for s in (STILL_LIFE, moved(STILL_LIFE, shift=shift)))
    assert by_a_code(one, two) <= 1e-3


@pytest.mark.parametrize("smooth", ["none", "normals"])
@pytest.mark.parametrize(("scale", "shift"), [(1.0, 0.0), (1e-5, 0.0), (1e5, 0.0), (1.0, 1e4), (1e-5, 1.0)])
def test_a_mesh_of_any_size_anywhere_is_drawn_as_in_float64(smooth: str, scale: float, shift: float) -> None:
    """Its shadows on itself and on a plane that it touches, its mirror images, at every depth."""
    made = scene((ball(smooth), ball(smooth, (0.9, 0.35, 0.4), 0.35), FLOOR), EYE, size=(48, 32))
    wanted = moved(made, scale, (shift, -shift, 2 * shift))
    assert off(render(wanted, skips=EXACT).picture, mesh_twin.trace(wanted)) <= 3


TOUCHING = (Sphere((0.0, 1.0, 0.0), 1.0, 0), Sphere((1.25, 1.0, 0.0), 0.25, 0), Sphere((-1.001, 1.0, 0.0), 1e-3, 0))
INSIDE = (Sphere((0.0, 1.0, 0.0), 3.0, 0), Sphere((0.7, 0.8, -1.0), 0.5, 0))
ROOMS = {
    "shadows between touching spheres": scene((*TOUCHING, FLOOR), EYE, depth=6),
    "where they touch": scene(TOUCHING, Camera((0.9, 1.3, 0.9), (1.0, 1.0, 0.0))),
    "a speck beside a ball": scene(TOUCHING, Camera((-1.0, 1.001, 0.01), (-1.0, 1.0, 0.0)), depth=5),
    "the camera inside a mirror": scene(INSIDE, EYE, (Light(position=(0.5, 2.0, 1.0)),), depth=8),
    "the camera at its centre": scene(INSIDE, Camera((0.0, 1.0, 0.0), (0.7, 0.8, -1.0)), depth=5),
    "a light inside a sphere": scene(TWO_BALLS, EYE, (Light(position=(0.0, 0.5, 0.0)), LAMPS[1])),
    "lamps on surfaces": scene(
        (*TWO_BALLS, FLOOR), EYE, (Light(position=(0.0, 1.0, 0.0)), Light(position=(1.0, 0.0, 1.0)))
    ),
    "a grazing eye": scene((Sphere((0.0, -1e6, 0.0), 1e6, 0), *TWO_BALLS), Camera((0.0, 1e-3, 4.0), (0.0, 0.3, 0.0))),
    "a planet from afar": scene((Sphere((0.0, 0.0, 0.0), 6e6, 0),), Camera((0.0, 0.0, 2e7), (0.0, 0.0, 0.0))),
}


@pytest.mark.parametrize("name", ROOMS)
def test_hard_places_are_drawn_as_in_float64(name: str) -> None:
    wanted = ROOMS[name]
    assert off(render(wanted, skips=EXACT).picture, numpy_tracer.trace(wanted)[0]) <= 4


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_a_sphere_or_plane_neither_shadows_nor_mirrors_itself(seed: int) -> None:
    """Alone, whatever its size, place and distance, it is the picture without shadows, and one reflection is all."""
    rng = np.random.default_rng(seed)
    radius = 10 ** rng.uniform(-6, 7)
    gap = radius * 10 ** rng.uniform(-7, 3)
    centre = rng.normal(size=3) * radius * rng.choice([0.0, 1e3])
    up, other = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    side = np.cross(up, other) / np.linalg.norm(np.cross(up, other))
    eye = centre + up * (radius + gap)
    target = eye - up * gap + side * gap * 10 ** rng.uniform(-1, 2)
    lights = (
        Light(direction=tuple(0.3 * up + rng.normal() * side)),
        Light(position=tuple(eye + gap * side + gap * rng.uniform(-0.9, 1) * up)),
    )
    sphere = Sphere(tuple(centre), radius, 0)
    plane = Plane(tuple(centre + radius * up + radius * side), tuple(up), 0)
    # the same thing twice must not hide itself either
    for things in ((sphere,), (sphere, sphere), (plane,)):
        wanted = scene(things, Camera(tuple(eye), tuple(target), tuple(up + 0.2 * side)), lights, 1, (32, 24))
        lone, shadowed, deeper = (
            render(wanted, shadows=shadows, depth=depth, skips=EXACT, threads=1)
            for shadows, depth in ((False, 1), (True, 1), (False, 4))
        )
        assert np.array_equal(lone.picture, shadowed.picture)
        assert np.array_equal(lone.picture, deeper.picture)


@pytest.mark.parametrize("extent", [1e1, 1e3, 1e5, 1e7])
def test_two_triangles_are_as_good_a_ground_as_a_plane(extent: float) -> None:
    """A corner far away does not make what is near less precise, at least where its plane lies along the axes."""
    corners = np.multiply([[-1, 0, -0.9], [1, 0, -1], [0.8, 0, 1], [-1, 0, 1.1]], extent)
    normals, worn = np.tile((0.0, 1.0, 0.0), (4, 1)), np.zeros(2, np.int32)
    ground = Mesh(corners, np.array([[0, 2, 1], [0, 3, 2]], np.int32), normals, worn, smooth="none")
    wanted = scene((ground, *TWO_BALLS), EYE)
    assert off(render(wanted, skips=EXACT).picture, mesh_twin.trace(wanted)) <= 2


@pytest.mark.parametrize("narrow", [1.0, 1e-2, 1e-4])
def test_a_triangle_does_not_shadow_itself(narrow: float) -> None:
    """However it is turned, far from the origin or near, in any shape: a bound on Embree's rounding and ours."""
    rng = np.random.default_rng(7)
    for _ in range(20):
        corners = rng.normal(size=3) * 10 ** rng.uniform(-3, 3) + rng.normal(size=(3, 3))
        corners[2] = corners[0] + 0.5 * (corners[1] - corners[0]) + narrow * rng.normal(size=3)
        face = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        face /= np.linalg.norm(face)
        middle = corners.mean(axis=0)
        mesh = Mesh(
            corners, np.array([[0, 1, 2]], np.int32), np.tile(face, (3, 1)), np.zeros(1, np.int32), smooth="none"
        )
        along = corners[1] - corners[0]
        lights = [Light(direction=tuple(cosine * face + along)) for cosine in (1.0, 1e-2, 1e-4)]
        eye = Camera(tuple(middle + 2 * face), tuple(middle), tuple(along), 60.0)
        wanted = scene((mesh,), eye, lights, 0, (32, 32))
        one, two = (render(wanted, shadows=shadows, skips=EXACT, threads=1).picture for shadows in (False, True))
        assert np.array_equal(one, two)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_skips_stay_exact_at_every_scale(scale: float) -> None:
    ground = Sphere((0.0, -1e5, 0.0), 1e5, 0)
    wanted = moved(scene((ground, *TWO_BALLS), EYE, LAMPS), scale)
    one, two = (render(wanted, skips=skips).picture for skips in (EXACT, SceneSkips.none()))
    assert np.array_equal(one, two)


def test_in_eye_space_a_light_fades_as_in_the_world() -> None:
    space = eye_space(moved(STILL_LIFE, 1000.0))
    light, sun = space.lights(moved(STILL_LIFE, 1000.0).lights)
    lamp, same = moved(STILL_LIFE, 1000.0).lights
    d = float(np.linalg.norm(light.position or ()))
    world = float(np.linalg.norm(np.subtract(lamp.position or (), space.origin)))
    assert space.unit * d == pytest.approx(world)
    assert np.dot(light.attenuation, (1, d, d * d)) == pytest.approx(np.dot(lamp.attenuation, (1, world, world**2)))
    assert light.reach == pytest.approx((lamp.reach or 0) / space.unit)
    assert sun == same


def test_a_light_too_far_for_float32_is_named() -> None:
    wanted = replace(STILL_LIFE, lights=(LAMPS[1], Light(position=(1e25, 0.0, 0.0))))
    with pytest.raises(InputError, match="as far away") as refused:
        render(wanted)
    assert refused.value.where == "lights[1].position"


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_the_camera_may_be_near_a_surface_but_not_on_it(scale: float) -> None:
    """Near is what float64 tells from on: one and a half above a ground of radius 10^7, too."""
    ground = Sphere((0.0, -1e7 * scale, 0.0), 1e7 * scale, 0)
    plane = Plane((1e6 * scale, 0.0, 0.0), (0.0, 1.0, 0.0), 0)
    for thing in (ground, plane):
        for height, fine in ((1.5, True), (1e-4, True), (0.0, False)):
            camera = Camera((0.0, height * scale, 0.0), (scale, 0.0, 0.0))
            try:
                check_camera(scene((thing,), camera))
                assert fine
            except InputError:
                assert not fine
