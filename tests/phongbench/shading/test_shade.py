"""Shading against a slow float64 twin and against its laws, whatever the layout, type and threads."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shading_twin import ABOVE, AFAR, EYE, GREY, LAMP, LYON, Array, cloud, scene, tolerance, twin, unit, wave

from phongbench.compiler import jit
from phongbench.formulas.formula import MODELS
from phongbench.formulas.registry import REGISTRY, example
from phongbench.shading.shade import Formula, Light, Material, Skips, Viewer, shade

pytestmark = pytest.mark.skipif(jit.DISABLED, reason="thousands of points, in plain Python")


# the twin


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("viewer", [EYE, AFAR], ids=["near", "afar"])
@pytest.mark.parametrize("lights", [(ABOVE,), (LAMP,), (LAMP, ABOVE, replace(LAMP, attenuation=(2, 0, 0)))], ids=len)
def test_shading_is_the_model_of_the_books(dtype: Any, model: str, viewer: Viewer, lights: Any) -> None:
    points, normals = cloud(300, dtype)
    for specular in (Formula(), LYON, Formula.of("lyon", "cross", 4, "minimax")):
        arguments = scene(lights=lights, viewer=viewer, model=model, specular=specular)
        found = shade(points, normals, **arguments)
        assert found.colours.dtype == dtype
        np.testing.assert_allclose(found.colours, twin(points, normals, **arguments), atol=tolerance(dtype, 50), rtol=0)


@pytest.mark.parametrize("name", REGISTRY)
def test_every_registered_formula_may_stand_for_the_specular_term(name: str) -> None:
    spec = REGISTRY[name]
    setting = example(spec)
    points, normals = cloud(200)
    for form in spec.lambda_forms:
        for slope in spec.slopes:
            specular = Formula.of(name, form, setting.gamma, slope)
            arguments = scene(specular=specular, material=replace(GREY, shininess=setting.alpha))
            np.testing.assert_allclose(
                shade(points, normals, **arguments).colours, twin(points, normals, **arguments), atol=1e-9, rtol=0
            )


def test_a_users_formula_and_a_slope_of_its_own_may_too() -> None:
    own = replace(REGISTRY["lyon"], name="own")
    points, normals = cloud(100)
    by_policy = shade(points, normals, **scene(specular=LYON))
    by_number = shade(points, normals, **scene(specular=replace(LYON, slope=50 / 8)))
    theirs = shade(
        points, normals, **scene(specular=replace(LYON, approximation="own")), registry={**REGISTRY, "own": own}
    )
    assert by_policy.colours.tobytes() == by_number.colours.tobytes() == theirs.colours.tobytes()


def test_normals_are_used_as_they_are_if_asked() -> None:
    points, normals = cloud(200)
    arguments = scene(normalise=False, material=replace(GREY, shininess=3.0))
    found = shade(points, normals, **arguments).colours
    np.testing.assert_allclose(found, twin(points, normals, **arguments), rtol=1e-11)
    assert np.abs(found - shade(points, normals, **{**arguments, "normalise": True}).colours).max() > 0.1


def test_a_light_that_a_point_does_not_see_is_left_out() -> None:
    points, normals = cloud(700)
    visible = np.random.default_rng(3).random((2, 700)) < 0.5
    visible[:, 64:192] = False
    found = shade(points, normals, **scene(visible=visible))
    np.testing.assert_allclose(
        found.colours, twin(points, normals, **scene(visible=visible)), atol=tolerance(np.float64, 50)
    )
    assert found.ledger.in_shadow == 2 * 128
    full = shade(points, normals, **scene(visible=visible), skips=Skips.none())
    exact = shade(points, normals, **scene(visible=visible), skips=Skips.exact())
    assert full.colours.tobytes() == exact.colours.tobytes()


# laws


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(0, 4), min_size=3, max_size=3), st.lists(st.floats(0, 4), min_size=3, max_size=3))
def test_colours_are_linear_in_the_colours_of_a_light(diffuse: list[float], highlight: list[float]) -> None:
    points, normals = cloud(128)

    def by(d: Any, s: Any) -> Array:
        lights = (replace(LAMP, diffuse=tuple(d), specular=tuple(s)),)
        return shade(points, normals, **scene(lights=lights, ambient_light=(0, 0, 0))).colours

    expected = np.multiply(by((1, 1, 1), (0, 0, 0)), diffuse) + np.multiply(by((0, 0, 0), (1, 1, 1)), highlight)
    np.testing.assert_allclose(by(diffuse, highlight), expected, rtol=1e-12, atol=1e-300)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.sampled_from((ABOVE, LAMP, Light(direction=(1, 2, -3)), Light(position=(-4, 1, 0)))), max_size=7))
def test_lights_add_up(lights: list[Light]) -> None:
    points, normals = cloud(200)
    together = shade(points, normals, **scene(lights=lights, ambient_light=(0, 0, 0))).colours
    one_by_one = [shade(points, normals, **scene(lights=(x,), ambient_light=(0, 0, 0))).colours for x in lights]
    np.testing.assert_allclose(together, sum(one_by_one, np.zeros_like(points)), rtol=1e-12)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_turning_everything_changes_nothing(seed: int) -> None:
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    points, normals = cloud(150, seed=seed)

    def turned(thing: Any) -> Any:
        given = {name: getattr(thing, name) for name in ("direction", "position")}
        return replace(thing, **{k: None if v is None else tuple(turn @ v) for k, v in given.items()})

    for viewer in (EYE, AFAR):
        plain = shade(points, normals, **scene(viewer=viewer))
        moved = shade(
            points @ turn.T, normals @ turn.T, **scene(viewer=turned(viewer), lights=(turned(ABOVE), turned(LAMP)))
        )
        np.testing.assert_allclose(moved.colours, plain.colours, atol=1e-11)


def test_with_every_light_behind_only_the_ambient_term_is_left() -> None:
    points, normals = cloud(1000, spread=0.1)
    found = shade(points, normals, **scene(lights=(Light(direction=(0, 0, -1)), Light(position=(0, 0, -90)))))
    assert (found.colours == np.array(GREY.ambient)).all()
    assert found.ledger.lights_behind == found.ledger.pairs == 2000


def test_no_light_and_no_point_are_fine() -> None:
    points, normals = cloud(10)
    assert (shade(points, normals, **scene(lights=())).colours == np.array(GREY.ambient)).all()
    assert shade(points[:0], normals[:0], **scene()).colours.shape == (0, 3)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_at_the_mirror_direction_the_highlight_is_full(model: str, dtype: Any) -> None:
    rng = np.random.default_rng(5)
    black = replace(GREY, ambient=(0, 0, 0), diffuse=(0, 0, 0), shininess=200.0)
    for _ in range(20):
        n, light = unit(rng.normal(size=3)), unit(rng.normal(size=3))
        light = light * np.sign(n @ light)
        mirrored = Viewer(direction=tuple(2 * (n @ light) * n - light))
        found = shade(
            np.zeros((1, 3), dtype),
            n[None].astype(dtype),
            material=black,
            lights=(Light(direction=tuple(light)),),
            viewer=mirrored,
            model=model,
        )
        np.testing.assert_allclose(found.colours[0], black.specular, rtol=200 * 8 * float(np.finfo(dtype).eps))


def test_blinn_phong_raises_the_cosine_of_the_halfway_vector_to_the_shininess_itself() -> None:
    half = math.radians(20)
    viewer = Viewer(direction=(math.sin(2 * half), 0, math.cos(2 * half)))
    black = replace(GREY, ambient=(0, 0, 0), diffuse=(0, 0, 0))
    found = shade(
        np.zeros((1, 3)), np.array([[0.0, 0, 1]]), material=black, lights=(ABOVE,), viewer=viewer, model="blinn-phong"
    )
    np.testing.assert_allclose(found.colours[0], np.multiply(black.specular, math.cos(half) ** 50), rtol=1e-12)


def test_blinn_as_an_approximation_of_phong_takes_four_times_the_exponent() -> None:
    points, normals = cloud(100)
    approximated = shade(points, normals, **scene(specular=Formula.of("blinn")))
    sharper = scene(model="blinn-phong", material=replace(GREY, shininess=200.0))
    np.testing.assert_allclose(approximated.colours, shade(points, normals, **sharper).colours, atol=1e-13)


def test_brightness_falls_with_distance_as_attenuation_says() -> None:
    heights = np.array([0.5, 1.0, 3.0, 10.0])
    points = np.stack([0 * heights, 0 * heights, -heights], axis=1)
    normals = np.tile([0.0, 0, 1], (4, 1))
    lamp = Light(position=(0, 0, 0), attenuation=(0.3, 0.2, 0.1), specular=(0, 0, 0))
    found = shade(points, normals, **scene(lights=(lamp,), ambient_light=(0, 0, 0))).colours[:, 0]
    np.testing.assert_allclose(found, 0.6 / (0.3 + 0.2 * heights + 0.1 * heights**2), rtol=1e-12)


def test_at_a_lights_or_viewers_own_place_its_term_is_dark() -> None:
    point, normal = np.array([LAMP.position, EYE.position], float), np.tile([0.0, 0, 1], (2, 1))
    for model in MODELS:
        at_lamp, at_eye = shade(point, normal, **scene(lights=(LAMP,), model=model)).colours
        np.testing.assert_array_equal(at_lamp, GREY.ambient)
        without = scene(lights=(replace(LAMP, specular=(0, 0, 0)),), model=model)
        np.testing.assert_array_equal(at_eye, shade(point, normal, **without).colours[1])


def test_a_light_without_constant_term_is_bright_nearby_and_not_infinite() -> None:
    lamp = Light(position=(0, 0, 1e-15), attenuation=(0, 0, 1e-3))
    found = shade(
        np.zeros((1, 3), np.float32), np.array([[0, 0, 1]], np.float32), **scene(lights=(lamp,), material=Material())
    )
    assert np.isfinite(found.colours).all()


# layouts, types, threads


@pytest.mark.parametrize("count", [1, 63, 64, 65, 511, 512, 513, 1500])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_neither_layout_nor_place_nor_threads_change_a_bit(count: int, dtype: Any) -> None:
    points, normals = cloud(count, dtype)
    whole = shade(points, normals, **scene(specular=LYON))
    transposed = np.ascontiguousarray(points.T), np.ascontiguousarray(normals.T)
    columns = shade(*transposed, **scene(specular=LYON), columns=True)
    assert columns.colours.T.tobytes() == whole.colours.tobytes()
    assert columns.ledger == whole.ledger
    last = shade(points[-1:], normals[-1:], **scene(specular=LYON))
    assert last.colours.tobytes() == whole.colours[-1:].tobytes()


def test_threads_change_neither_colours_nor_ledger() -> None:
    points, normals = wave(300_000, np.float32)
    lights = (ABOVE, LAMP) * 8
    one, two = (shade(points, normals, **scene(lights=lights), threads=threads) for threads in (1, 3))
    assert one.colours.tobytes() == two.colours.tobytes()
    assert one.ledger == two.ledger


def test_read_only_arrays_are_taken_as_they_are_and_nothing_is_compiled_again() -> None:
    points, normals = cloud(100, np.float32)
    out = np.empty_like(points)
    first = shade(points, normals, **scene(), out=out)
    assert first.colours is out
    for array in (points, normals):
        array.flags.writeable = False
    with jit.compilations() as compiled:
        assert shade(points, normals, **scene()).colours.tobytes() == out.tobytes()
        shade(np.asfortranarray(points), normals[:, ::-1], **scene())
        unaligned = np.frombuffer(b"-" + points.tobytes(), np.float32, offset=1).reshape(-1, 3)
        assert not unaligned.flags.aligned
        assert shade(unaligned, normals, **scene()).colours.tobytes() == out.tobytes()
    assert compiled == []
