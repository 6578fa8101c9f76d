"""Highlights whose colour depends on incidence, and lights with an ambient term of their own."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shading_twin import ABOVE, AFAR, EYE, GREY, LAMP, LYON, cloud, scene, tolerance, twin, wave

from phongbench.compiler import jit
from phongbench.errors import InputError
from phongbench.formulas.fresnel.catalogue import KINDS
from phongbench.formulas.fresnel.reflectance import Fresnel
from phongbench.inputs.optical_constants import COPPER, GLASS, in_terms_of
from phongbench.shading.shade import Light, Material, Skips, Viewer, shade

pytestmark = pytest.mark.skipif(jit.DISABLED, reason="thousands of points, in plain Python")

GLOWING = replace(LAMP, ambient=(0.5, 0.25, 0.125))
OF_COPPER = replace(GREY, specular=(1, 1, 1), fresnel=COPPER)


def of_kind(kind: str) -> Fresnel:
    return in_terms_of(GLASS if kind == "dielectric" else COPPER, kind)


# reflectance


@pytest.mark.parametrize("kind", KINDS)
def test_a_highlight_is_multiplied_by_the_reflectance_at_its_incidence(kind: str) -> None:
    points, normals = cloud(300)
    arguments = scene(material=replace(GREY, fresnel=of_kind(kind)))
    found = shade(points, normals, **arguments).colours
    np.testing.assert_allclose(found, twin(points, normals, **arguments), atol=tolerance(np.float64, 50), rtol=0)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("viewer", [EYE, AFAR], ids=["near", "afar"])
@pytest.mark.parametrize(("model", "specular"), [("phong", LYON), ("blinn-phong", LYON)])
def test_wherever_light_and_viewer_are(dtype: Any, viewer: Any, model: str, specular: Any) -> None:
    points, normals = wave(700, dtype)
    arguments = scene(material=OF_COPPER, viewer=viewer, model=model, specular=specular)
    expected = twin(points, normals, **arguments)
    np.testing.assert_allclose(shade(points, normals, **arguments).colours, expected, atol=tolerance(dtype, 50), rtol=0)


def test_a_reflectance_of_one_is_none_at_all() -> None:
    points, normals = wave(1000, np.float32)
    whole = replace(GREY, fresnel=Fresnel("constant", f0=[1, 1, 1]))
    assert shade(points, normals, **scene(material=whole)).colours.tobytes() == (
        shade(points, normals, **scene()).colours.tobytes()
    )


@settings(max_examples=25, deadline=None)
@given(st.floats(0, 89.9), st.sampled_from([COPPER, GLASS]))
def test_at_the_mirror_direction_a_point_shows_the_reflectance_of_its_incidence(degrees: float, fresnel: Any) -> None:
    """N.H is 1 there at every incidence: it is V.H that counts."""
    angle = np.radians(degrees)
    light = Light(direction=(np.sin(angle), 0, np.cos(angle)))
    viewer = Viewer(direction=(-np.sin(angle), 0, np.cos(angle)))
    material = Material(specular=(1, 1, 1), shininess=200.0, fresnel=fresnel)
    at, up = np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]])
    found = shade(at, up, material=material, lights=[light], viewer=viewer).colours
    np.testing.assert_allclose(found, fresnel.at(np.array([np.cos(angle)])), atol=1e-11)


def test_a_viewer_opposite_to_the_light_meets_no_number_that_is_none() -> None:
    """H has no direction there, and at the lamp's and the eye's own place neither L nor V has."""
    points = np.array([[0.0, 0.0, 0.0], LAMP.position, EYE.position], np.float32)
    normals = np.array([[0.0, 0.0, 1.0]] * 3, np.float32)
    flat = Light(direction=(1, 0, 1e-9))
    for viewer in (EYE, Viewer(direction=(-1, 0, -1e-9))):
        found = shade(points, normals, **scene(material=OF_COPPER, lights=(flat, LAMP), viewer=viewer)).colours
        assert np.isfinite(found).all()


@settings(max_examples=25, deadline=None)
@given(st.sampled_from(sorted(KINDS)), st.sampled_from((cloud, wave)))
def test_no_reflectance_brightens_a_highlight(kind: str, make: Any) -> None:
    points, normals = make(400, np.float64)
    plain = shade(points, normals, **scene()).colours
    assert (
        shade(points, normals, **scene(material=replace(GREY, fresnel=of_kind(kind)))).colours <= plain + 1e-14
    ).all()


# ambient of lights


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("model", ["phong", "blinn-phong"])
def test_ambient_light_is_the_sum_over_lights(dtype: Any, model: str) -> None:
    points, normals = cloud(700, dtype)
    bare = replace(GLOWING, attenuation=(2, 0, 0), diffuse=(0, 0, 0), specular=(0, 0, 0))
    arguments = scene(lights=(GLOWING, bare, replace(ABOVE, ambient=(0.1, 0.2, 0.3))), model=model)
    found = shade(points, normals, **arguments)
    np.testing.assert_allclose(found.colours, twin(points, normals, **arguments), atol=tolerance(dtype, 50), rtol=0)
    assert found.ledger.zero_colours == 0


def test_it_reaches_what_faces_away_and_what_lies_in_shadow() -> None:
    points, normals = cloud(700)
    away = -(np.array(LAMP.position) - points)
    dark = np.zeros((1, 700), bool)
    only = scene(lights=(GLOWING,), ambient_light=(0, 0, 0))
    d = np.linalg.norm(away, axis=1)[:, None]
    expected = np.multiply(GREY.ambient, GLOWING.ambient) / (0.5 + 0.2 * d + 0.1 * d * d)
    np.testing.assert_allclose(shade(points, away, **only).colours, expected, rtol=1e-12)
    np.testing.assert_allclose(shade(points, normals, **only, visible=dark).colours, expected, rtol=1e-12)


def test_the_ambient_of_a_light_far_away_is_ambient_light() -> None:
    points, normals = cloud(300)
    far = scene(lights=(replace(ABOVE, ambient=(0.5, 0.25, 1)),), ambient_light=(0, 0, 0))
    near = scene(lights=(ABOVE,), ambient_light=(0.5, 0.25, 1))
    assert shade(points, normals, **far).colours.tobytes() == shade(points, normals, **near).colours.tobytes()


def test_it_ends_where_the_light_does() -> None:
    points = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]])
    up = np.array([[0.0, 0.0, 1.0]] * 2)
    lamp = Light(position=(0, 0, 3), attenuation=(0, 1, 0), reach=2.5, ambient=(1, 1, 1), diffuse=(0, 0, 0))
    found = shade(points, up, **scene(lights=(lamp,), ambient_light=(0, 0, 0), material=Material((1, 1, 1)))).colours
    assert found.tolist() == [[0, 0, 0], [1, 1, 1]]
    at_the_lamp = np.array([[0.0, 0.0, 3.0]])
    assert np.isfinite(shade(at_the_lamp, up[1:], **scene(lights=(lamp,), material=Material((1, 1, 1)))).colours).all()


# what is left out


DTYPES = st.sampled_from((np.float32, np.float64))
SMOOTH = st.sampled_from((None, COPPER, of_kind("schlick"), of_kind("f82")))


@settings(max_examples=30, deadline=None)
@given(SMOOTH, st.integers(0, 5), DTYPES, st.booleans(), st.sampled_from((EYE, AFAR)))
def test_what_is_skipped_exactly_changes_no_bit(fresnel: Any, lamps: int, dtype: Any, bare: bool, viewer: Any) -> None:
    points, normals = wave(1100, dtype)
    black = {"diffuse": (0, 0, 0), "specular": (0, 0, 0)} if bare else {}
    some = [replace(GLOWING, position=(k, -1, 2 - k), **black) for k in range(lamps)]
    arguments = scene(material=replace(GREY, fresnel=fresnel), lights=(*some, ABOVE, LAMP), viewer=viewer)
    full = shade(points, normals, **arguments, skips=Skips.none())
    exact = shade(points, normals, **arguments, skips=Skips.exact())
    assert full.colours.tobytes() == exact.colours.tobytes()
    for name in ("lights_behind", "zero_colours", "beyond_support", "constant_directions"):
        alone = shade(points, normals, **arguments, skips=replace(Skips.none(), **{name: True}))
        assert full.colours.tobytes() == alone.colours.tobytes(), name


@settings(max_examples=20, deadline=None)
@given(st.floats(0.1, 8), st.integers(1, 9))
def test_a_reach_takes_ambient_light_too_and_says_how_much(reach: float, lights: int) -> None:
    points, normals = wave(700)
    lamps = tuple(replace(GLOWING, position=(k, 1.0, 2.0), reach=reach) for k in range(lights))
    full = shade(points, normals, **scene(lights=lamps), skips=replace(Skips(), reach=False)).colours
    cut = shade(points, normals, **scene(lights=lamps)).colours
    c, linear, q = LAMP.attenuation
    pairs = ((GREY.ambient, GLOWING.ambient), (GREY.diffuse, LAMP.diffuse), (GREY.specular, LAMP.specular))
    bound = lights * sum(np.multiply(*pair) for pair in pairs) / (c + linear * reach + q * reach**2)
    assert (full - cut <= bound + 1e-12).all()


def test_an_ambient_term_is_a_colour() -> None:
    with pytest.raises(InputError, match="negative") as refused:
        Light(direction=(0, 0, 1), ambient=(0, -1, 0))
    assert refused.value.where == "ambient"
