"""What shading leaves out: exactly, it changes no bit; bounded, no more than it says."""

import math
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from shading_twin import ABOVE, GREY, LAMP, LYON, Array, cloud, scene, wave

from phongbench.compiler import jit
from phongbench.formulas.formula import MODELS
from phongbench.formulas.registry import REGISTRY
from phongbench.shading.shade import Formula, Light, Material, Skips, Viewer, shade

pytestmark = pytest.mark.skipif(jit.DISABLED, reason="thousands of points, in plain Python")


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
