"""Shading against a slow float64 twin, against its laws, and against itself with nothing left out."""

import math
import platform
import re
from dataclasses import fields, replace
from typing import Any

import numba
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32
from phongbench.errors import CancelledError, InputError, UnknownNameError
from phongbench.formulas.formula import MODELS
from phongbench.formulas.lambda_forms import LAMBDA_FORMS
from phongbench.formulas.registry import REGISTRY, example
from phongbench.inputs import mtl_files
from phongbench.shading import tile_loop, tiles
from phongbench.shading.light_loops import KINDS, coordinate_loop, facing_loop
from phongbench.shading.shade import Formula, Light, Material, Skips, Viewer, shade

Array = np.ndarray[Any, Any]
pytestmark = pytest.mark.skipif(jit.DISABLED, reason="thousands of points, in plain Python")

GREY = Material((0.1, 0.2, 0.3), (0.6, 0.5, 0.4), (0.9, 0.8, 0.7), 50.0)
ABOVE = Light(direction=(0, 0, 1))
LAMP = Light(position=(1.0, -2.0, 3.0), attenuation=(0.5, 0.2, 0.1), diffuse=(1, 0.5, 0.25), specular=(0.5, 1, 1))
EYE = Viewer(position=(0.5, 0.5, 6.0))
AFAR = Viewer(direction=(0.3, 0.1, 2.0))
LYON, EXACT_PHONG = Formula.of("lyon", "dot", 8), Formula()


def cloud(count: int, dtype: Any = np.float64, seed: int = 1, spread: float = 1.0) -> tuple[Array, Array]:
    """Points near the origin, normals around +z, of lengths near 1; a small spread makes coherent blocks."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    normals = rng.normal(size=(count, 3)) * spread + (0, 0, 1)
    return points.astype(dtype), normals.astype(dtype)


def wave(count: int, dtype: Any = np.float64) -> tuple[Array, Array]:
    """Points along a path around the unit sphere: neighbours have nearly the same normal, as in an image."""
    t = np.linspace(0, 1, count)
    z, angle = np.cos(np.pi * t), 9 * np.pi * t
    n = np.stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z], axis=1)
    return n.astype(dtype), n.astype(dtype)


def unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v))


def twin(
    points: Array,
    normals: Array,
    *,
    material: Material,
    lights: Any,
    viewer: Viewer,
    ambient_light: Any = (0, 0, 0),
    model: str = "phong",
    specular: Formula = EXACT_PHONG,
    normalise: bool = True,
    visible: Any = None,
) -> Array:
    """The reflection model as it is written in books: one point after the other, one light after the other."""
    spec, form, setting = specular.spec(), specular.lambda_form, specular.setting(material.shininess)
    space = "half" if model == "blinn-phong" else specular.space
    body = spec.bound(setting)
    colours = np.empty((len(points), 3))
    for i, (p, n) in enumerate(zip(points.astype(float), normals.astype(float), strict=True)):
        N = unit(n) if normalise else n
        V = np.array(viewer.direction) if viewer.position is None else unit(np.array(viewer.position) - p)
        total = np.multiply(material.ambient, ambient_light)
        for k, light in enumerate(lights):
            if visible is not None and not visible[k][i]:
                continue
            L, att = np.array(light.direction or (0, 0, 0)), 1.0
            if light.position is not None:
                d = float(np.linalg.norm(np.array(light.position) - p))
                c, linear, q = light.attenuation
                L, att = (np.array(light.position) - p) / d, 1 / (c + linear * d + q * d * d)
            if N @ L <= 0:
                continue
            total = total + att * (N @ L) * np.multiply(material.diffuse, light.diffuse)
            a, b = (2 * (N @ L) * N - L, V) if space == "reflect" else (N, unit(L + V))
            if a @ b > 0:
                x = float(a @ b) if form == "none" else float(LAMBDA_FORMS[form](*a, *b))
                total = total + att * float(body(x)) * np.multiply(material.specular, light.specular)
        colours[i] = total
    return colours


def scene(**changes: Any) -> dict[str, Any]:
    return {"material": GREY, "lights": (ABOVE, LAMP), "viewer": EYE, "ambient_light": (1, 1, 1), **changes}


def tolerance(dtype: Any, sharpness: float) -> float:
    """Rounding of the directions, which the exponent multiplies, and of the fast power."""
    return float(np.finfo(dtype).eps) * (64 + 16 * sharpness)


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


# skipping


@st.composite
def scenes(draw: st.DrawFn) -> dict[str, Any]:
    """Scenes with lights of all kinds, some of them black, behind or far away."""
    black_or = st.sampled_from(((0.0, 0.0, 0.0), (1.0, 0.0, 0.5), (1.0, 1.0, 1.0)))
    place = st.tuples(*[st.sampled_from((-3.0, -0.5, 0.25, 4.0))] * 3)
    lights = [
        Light(
            **(
                {"direction": draw(place)}
                if draw(st.booleans())
                else {
                    "position": draw(place),
                    "attenuation": draw(st.sampled_from(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.5, 0.2, 0.1)))),
                }
            ),
            diffuse=draw(black_or),
            specular=draw(black_or),
        )
        for _ in range(draw(st.integers(0, 6)))
    ]
    place_or_far = {"position": draw(place)} if draw(st.booleans()) else {"direction": draw(place)}
    name = draw(st.sampled_from(("phong", "lyon", "gaussian", "lyon-quadratic", "table-x", "schlick", "kuijk-blake")))
    gamma = 8 if REGISTRY[name].uses_gamma else None
    form = draw(st.sampled_from(REGISTRY[name].lambda_forms))
    return {
        "material": Material((0.1,) * 3, draw(black_or), draw(black_or), draw(st.sampled_from((1.0, 10.0, 60.0)))),
        "lights": lights,
        "viewer": Viewer(**place_or_far),
        "ambient_light": draw(black_or),
        "model": draw(st.sampled_from(MODELS)),
        "specular": Formula.of(name, form, gamma),
        "normalise": draw(st.booleans()),
    }


SURFACES = st.tuples(
    st.sampled_from((cloud, wave)), st.sampled_from((1, 70, 600, 1100)), st.sampled_from((np.float32, np.float64))
)
EXACT = [f.name for f in fields(Skips) if f.type is bool and f.name not in ("reach", "dark_tail")]


def assert_same_bits(found: Array, wanted: Array, what: str = "") -> None:
    """Every bit equal; a failure tells the first colour that differs, since a diff of bytes takes minutes."""
    bits = np.uint32 if wanted.dtype == np.float32 else np.uint64
    differing = np.flatnonzero((found.view(bits) != wanted.view(bits)).any(axis=1))
    if len(differing):
        first = differing[0]
        pytest.fail(f"{what}: {len(differing)} colours differ, first {first}: {found[first]} is not {wanted[first]}")


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(scenes(), SURFACES)
def test_what_is_skipped_exactly_changes_no_bit(arguments: dict[str, Any], surface: Any) -> None:
    make, count, dtype = surface
    points, normals = make(count, dtype)
    full = shade(points, normals, **arguments, skips=Skips.none())
    assert not any(v for k, v in full.ledger.as_dict().items() if k != "pairs")
    everything = shade(points, normals, **arguments, skips=Skips.exact())
    assert_same_bits(everything.colours, full.colours)
    for name in EXACT:
        found = shade(points, normals, **arguments, skips=replace(Skips.none(), **{name: True}))
        assert_same_bits(found.colours, full.colours, name)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(scenes(), SURFACES, st.sampled_from((1e-6, 1e-3, 0.05)))
def test_the_dark_tail_costs_what_it_says(arguments: dict[str, Any], surface: Any, tail: float) -> None:
    make, count, dtype = surface
    points, normals = make(count, dtype)
    arguments = {**arguments, "specular": Formula(), "normalise": True}
    full = shade(points, normals, **arguments, skips=Skips.none()).colours.astype(float)
    cut = shade(points, normals, **arguments, skips=replace(Skips(), tail=tail)).colours.astype(float)
    bound = np.zeros((len(points), 3))
    for light in arguments["lights"]:
        fading = np.ones(len(points))
        if light.position is not None:
            c, linear, q = light.attenuation
            d = np.linalg.norm(points - np.array(light.position), axis=1)
            fading = 1 / (c + linear * d + q * d * d)
        bound += np.outer(fading, tail * np.multiply(arguments["material"].specular, light.specular))
    room = 8 * float(np.finfo(dtype).eps) * (1 + full)
    assert (full - cut <= bound * (1 + 1e-3) + room).all()
    assert (cut <= full + room).all()


def test_a_tail_is_cut_point_by_point_wherever_blocks_begin() -> None:
    points, normals = cloud(600)
    cut = replace(Skips(), tail=0.01)
    whole = shade(points, normals, **scene(), skips=cut).colours
    assert shade(points[37:], normals[37:], **scene(), skips=cut).colours.tobytes() == whole[37:].tobytes()


@settings(max_examples=30, deadline=None)
@given(st.floats(0.1, 8), st.sampled_from((cloud, wave)), st.integers(1, 9))
def test_a_reach_costs_what_it_says(reach: float, make: Any, lights: int) -> None:
    points, normals = make(700, np.float64)
    lamps = tuple(replace(LAMP, position=(k, 1.0, 2.0), reach=reach) for k in range(lights))
    full = shade(points, normals, **scene(lights=lamps), skips=replace(Skips(), reach=False)).colours
    cut = shade(points, normals, **scene(lights=lamps)).colours
    c, linear, q = LAMP.attenuation
    terms = np.multiply(GREY.diffuse, LAMP.diffuse) + np.multiply(GREY.specular, LAMP.specular)
    bound = lights * terms / (c + linear * reach + q * reach**2)
    assert (full - cut <= bound + 1e-12).all()
    inside = [np.linalg.norm(points - np.array(x.position), axis=1) <= reach for x in lamps]
    everywhere = np.all(inside, axis=0)
    np.testing.assert_allclose(cut[everywhere], full[everywhere], rtol=1e-12)
    nowhere = ~np.any(inside, axis=0)
    assert (cut[nowhere] == np.array(GREY.ambient)).all()


def test_the_ledger_says_what_was_left_out() -> None:
    points, normals = wave(20_000, np.float32)
    black = Light(direction=(1, 0, 0), diffuse=(0, 0, 0), specular=(0, 0, 0))
    matt = Light(direction=(0, 1, 0), specular=(0, 0, 0))
    far = Light(position=(0, 0, 500), reach=10)
    found = shade(points, normals, **scene(lights=(black, matt, far, ABOVE, LAMP), specular=LYON)).ledger
    assert found.pairs == 100_000
    assert found.zero_colours == 20_000
    assert found.out_of_reach == 20_000
    assert found.constant_directions == 60_000
    assert 20_000 < found.lights_behind < 40_000
    assert 0 < found.vectors_not_built <= 20_000
    assert found.beyond_support > 5_000
    assert found.dark_tail == 0
    exact = shade(points, normals, **scene()).ledger
    assert exact.dark_tail > 5_000
    assert exact.beyond_support == 0
    assert set(found.as_dict()) == {f.name for f in fields(found)}
    assert (found + exact).pairs == found.pairs + exact.pairs


def test_boxes_leave_out_whole_tiles_that_no_light_can_reach() -> None:
    points, normals = wave(4096, np.float32)
    lights = tuple(Light(direction=(math.cos(k), math.sin(k), 3.0)) for k in range(8))
    found = shade(points, normals, **scene(lights=lights))
    few = [shade(points, normals, **scene(lights=(light,))).ledger.lights_behind for light in lights]
    assert found.ledger.lights_behind == sum(few) > 0


# wrong input


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e30])
@pytest.mark.parametrize("name", ["points", "normals"])
@pytest.mark.parametrize("index", [0, 63, 700, 1299])
def test_the_first_point_that_cannot_be_shaded_is_named(bad: float, name: str, index: int) -> None:
    points, normals = cloud(1300, np.float32)
    {"points": points, "normals": normals}[name][index:, 1] = bad
    for threads in (1, 2):
        with pytest.raises(InputError, match=r"not finite|squares") as caught:
            shade(points, normals, **scene(), threads=threads)
        assert caught.value.where == f"{name}[{index}]"


def test_a_normal_without_length_is_refused_unless_taken_as_it_is() -> None:
    points, normals = cloud(1300)
    normals[[600, 900]] = 0
    with pytest.raises(InputError, match="without length") as caught:
        shade(np.ascontiguousarray(points.T), np.ascontiguousarray(normals.T), **scene(), columns=True)
    assert caught.value.where == "normals[600]"
    dark = shade(points, normals, **scene(), normalise=False).colours[600]
    np.testing.assert_array_equal(dark, GREY.ambient)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (Light, "direction"),
        (lambda: Light(direction=(0, 0, 1), position=(0, 0, 1)), "direction"),
        (lambda: Light(direction=(0, 0, 0)), "direction"),
        (lambda: Light(direction=(0, math.nan, 1)), "direction"),
        (lambda: Light(direction=(0, 1)), "direction"),
        (lambda: Light(position=(0, math.inf, 1)), "position"),
        (lambda: Light(position=(0, 0, 1), attenuation=(0, 0, 0)), "attenuation"),
        (lambda: Light(position=(0, 0, 1), attenuation=(1, -1, 0)), "attenuation"),
        (lambda: Light(direction=(0, 0, 1), attenuation=(1, 1, 0)), "attenuation"),
        (lambda: Light(direction=(0, 0, 1), reach=3), "reach"),
        (lambda: Light(position=(0, 0, 1), reach=-3), "reach"),
        (lambda: Light(direction=(0, 0, 1), diffuse=(1, 1, -1)), "diffuse"),
        (lambda: Light(direction=(0, 0, 1), specular="red"), "specular"),
        (Viewer, "direction"),
        (lambda: Material(shininess=math.inf), "shininess"),
        (lambda: Material(ambient=(1, 1)), "ambient"),
        (lambda: Skips(tail=2), "tail"),
    ],
)
def test_a_light_viewer_or_material_that_cannot_be_names_its_field(make: Any, field: str) -> None:
    with pytest.raises(InputError) as caught:
        make()
    assert caught.value.where == field


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"model": "gouraud"}, "model"),
        ({"specular": Formula("lyonn")}, "specular.approximation"),
        ({"specular": Formula("lyon", "dott", 8)}, "specular.lambda"),
        ({"specular": Formula("lyon", "dot")}, "specular.gamma"),
        ({"specular": Formula("lyon", "dot", 9)}, "specular.gamma"),
        ({"specular": Formula("lyon", "dot", 8, "steep")}, "specular.beta"),
        ({"specular": Formula(slope=3.0)}, "specular.beta"),
        ({"specular": Formula.of("blinn"), "model": "blinn-phong"}, "specular.approximation"),
        ({"specular": Formula("lyon", "dot", 8, "taylor", "eye")}, "specular.space"),
        ({"material": replace(GREY, shininess=0.0)}, "material.shininess"),
        ({"ambient_light": (1, 1, -1)}, "ambient_light"),
        ({"lights": (ABOVE, Light(position=(1e200, 0, 0)))}, "lights[1].position"),
        ({"visible": np.ones((1, 10), bool)}, "visible"),
        ({"visible": np.ones((2, 10))}, "visible"),
        ({"threads": 0}, "threads"),
        ({"out": np.empty((9, 3))}, "out"),
    ],
)
def test_wrong_arguments_are_named(changes: dict[str, Any], where: str) -> None:
    points, normals = cloud(10)
    with pytest.raises(InputError) as caught:
        shade(points, normals, **scene(**changes))
    assert caught.value.where == where
    if "lyonn" in str(caught.value):
        assert isinstance(caught.value, UnknownNameError)


@pytest.mark.parametrize(
    ("points", "normals", "where"),
    [
        (np.zeros((4, 3), int), np.ones((4, 3)), "points"),
        (np.zeros((4, 3), ">f8"), np.ones((4, 3)), "points"),
        (np.zeros((3, 4)), np.ones((3, 4)), "points"),
        (np.zeros((4, 3)), np.ones((5, 3)), "normals"),
        (np.zeros((4, 3)), np.ones((4, 3), np.float32), "normals"),
    ],
)
def test_arrays_of_another_type_or_shape_are_refused(points: Array, normals: Array, where: str) -> None:
    with pytest.raises(InputError) as caught:
        shade(points, normals, **scene())
    assert caught.value.where == where


def test_without_a_highlight_any_shininess_will_do() -> None:
    points, normals = cloud(10)
    shade(points, normals, **scene(material=Material((0, 0, 0), (1, 1, 1), (0, 0, 0), 0.0)))
    matt = mtl_files.Material("matt", shininess=0.0, specular=(1.0, 1.0, 1.0))
    assert Material.of(matt).specular == (0, 0, 0)
    gold = next(m for m in mtl_files.OPENGL if m.name == "gold")
    assert Material.of(gold) == Material(gold.ambient, gold.diffuse, gold.specular, gold.shininess)


def test_work_that_nobody_wants_any_more_ends() -> None:
    points, normals = cloud(100_000, np.float32)
    asked: list[int] = []

    def gone() -> bool:
        asked.append(1)
        return len(asked) > 2

    for threads in (1, 2):
        asked.clear()
        with pytest.raises(CancelledError):
            shade(points, normals, **scene(lights=(ABOVE,) * 40), cancelled=gone, threads=threads)
        assert 3 <= len(asked) <= 4


# what the loops are made of

x86_only = pytest.mark.skipif(platform.machine().lower() not in ("x86_64", "amd64"), reason="reads x86 instructions")


def packed(assembly: str, type_: str, most: int = 12) -> None:
    """Products and sums of whole vectors; of single values none."""
    assert re.search(rf"\bv(fn?m(add|sub)\d+|mul){type_}\s.*[yz]mm", assembly)
    # what is the same for all points is computed once, and the search for the first bad point need not be fast
    single = [line for line in assembly.splitlines() if re.search(r"\bv(fn?m(add|sub)\d+|div|sqrt)s[sd]\b", line)]
    assert len(single) <= most, single


@x86_only
@pytest.mark.parametrize("kind", KINDS)
def test_the_loops_over_lights_compute_on_whole_vectors(kind: str) -> None:
    for shadowed in (False, True):
        llvm, assembly = jit.code(facing_loop(kind, shadowed, FLOAT32), fused=False)
        packed(assembly, "ps")
        assert not re.search(r"\bdouble\b", llvm)


@x86_only
@pytest.mark.parametrize("space", ["reflect", "half"])
@pytest.mark.parametrize("form", ["none", *LAMBDA_FORMS])
def test_the_loops_over_coordinates_compute_on_whole_vectors(space: str, form: str) -> None:
    for light, viewer in ((False, False), (True, True)):
        llvm, assembly = jit.code(coordinate_loop(space, form, light, viewer, False, FLOAT32), fused=False)
        packed(assembly, "ps")
        assert not re.search(r"\bdouble\b", llvm)


@x86_only
@pytest.mark.parametrize(("dtype", "suffix"), [(np.float32, "ps"), (np.float64, "pd")])
def test_what_is_loaded_added_and_stored_is_whole_vectors_too(dtype: Any, suffix: str) -> None:
    shade(*cloud(10, dtype), **scene())
    loop, wanted = tile_loop.shade_tiles, numba.from_dtype(np.dtype(dtype))
    given = next(s for s in loop.signatures if f"array({wanted}," in str(s[0]))
    again = numba.njit(nogil=True, error_model="numpy", fastmath=jit.FORMULA_FLAGS)(loop.py_func)
    again.compile(given)
    llvm, assembly = again.inspect_llvm(given), again.inspect_asm(given)
    packed(assembly, suffix, most=40)
    assert re.search(rf"\bvsqrt{suffix}\s.*[yz]mm", assembly)
    assert re.search(r"\bvp?(erm|unpck|shuf)\w*\s.*[yz]mm", assembly)  # rows of three are sorted into components
    assert suffix == "pd" or not re.search(r"\bdouble\b", llvm)


def test_a_tile_in_float32_leaves_room_in_the_smallest_second_caches() -> None:
    assert tiles.SCRATCH * FLOAT32.carrier.itemsize <= 64 << 10
    assert tiles.TILE % tiles.BLOCK == 0
