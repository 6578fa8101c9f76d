"""Formulas that remove lengths, or make their pair, in shading: the same on unit vectors, their worth on others."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from shading_twin import AFAR, EYE, GREY, LAMP, LYON, Array, cloud, scene, tolerance, twin, wave

from phongbench.compiler import jit
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.inputs.optical_constants import COPPER
from phongbench.shading.shade import Light, Skips, Viewer, shade
from phongbench.shading.specular_term import formula_for

pytestmark = pytest.mark.skipif(jit.DISABLED, reason="thousands of points, in plain Python")

RAW = (
    "phong/each",
    "phong/once",
    "phong/squared",
    "lyon:dot:8/once",
    "lyon:cross:8/once",
    "phong@reflect",
    "phong@lengthwise/once",
    "blinn/once",
    "blinn@halfway/once",
    "blinn@halfway/squared",
)
#: no diffuse light: what is seen is the highlight alone
MIRROR = replace(GREY, ambient=(0, 0, 0), diffuse=(0, 0, 0))


def plain(formula: Formula) -> Formula:
    return replace(formula, recipe="pair", normalise="none")


def lengths(normals: Array, low: float, high: float) -> Array:
    """The same directions, of lengths between these."""
    rng, unit = np.random.default_rng(3), normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(unit * np.geomspace(low, high, len(normals))[rng.permutation(len(normals)), None], normals.dtype)


@pytest.mark.parametrize("spelling", RAW)
def test_unit_vectors_shine_as_by_the_plain_formula(spelling: str) -> None:
    formula, (points, normals) = Formula.parse(spelling), wave(700)
    for viewer in (EYE, AFAR):
        arguments = scene(viewer=viewer)
        found = shade(points, normals, **arguments, specular=formula).colours
        expected = shade(points, normals, **arguments, specular=plain(formula)).colours
        np.testing.assert_allclose(found, expected, atol=tolerance(np.float64, 400), rtol=0)


@pytest.mark.parametrize("spelling", RAW)
def test_normals_of_any_length_shine_as_the_plain_bodies_say(spelling: str) -> None:
    points, normals = cloud(200)
    arguments = scene(specular=Formula.parse(spelling), normalise=False, material=replace(GREY, shininess=20.0))
    normals = lengths(normals, 0.8, 1.25)
    found = shade(points, normals, **arguments).colours
    np.testing.assert_allclose(found, twin(points, normals, **arguments), rtol=1e-10, atol=1e-10)


def test_halfway_alone_leaves_the_half_vector_as_long_as_twice_the_cosine_of_incidence() -> None:
    points, normals = wave(200)
    arguments = scene(specular=Formula.parse("blinn@halfway"))
    found, expected = shade(points, normals, **arguments).colours, twin(points, normals, **arguments)
    assert expected.max() > 1e6
    np.testing.assert_allclose(found, expected, rtol=1e-10)


@pytest.mark.parametrize(("way", "scale"), [("fast", 2e-3), ("estimate", 5e-4)])
def test_a_cheap_root_errs_by_its_own_error_times_the_exponent(way: str, scale: float) -> None:
    points, normals = wave(700, np.float32)
    found = shade(points, normals, **scene(specular=Formula.parse(f"phong/{way}"))).colours
    off = np.abs(found - shade(points, normals, **scene()).colours).max()
    assert 0 < off < 2 * 2 * scale * GREY.shininess  # of two lamps, two vectors each


@pytest.mark.parametrize("spelling", ["phong@lengthwise/once", "lyon:cross:8@lengthwise/once", "blinn/once"])
def test_whole_recipes_see_no_length_of_a_normal(spelling: str) -> None:
    points, normals = wave(1000, np.float32)
    arguments = scene(specular=Formula.parse(spelling), material=MIRROR, normalise=False)
    told = shade(points, normals, **arguments).colours
    found = shade(points, lengths(normals, 1e-3, 1e3), **arguments).colours
    np.testing.assert_allclose(found, told, atol=tolerance(np.float32, 400), rtol=0)
    bare = arguments | {"specular": plain(arguments["specular"])}
    with np.errstate(all="ignore"):
        assert not np.allclose(shade(points, lengths(normals, 0.5, 2), **bare).colours, told, atol=0.05)


def test_once_on_a_given_pair_removes_its_lengths_but_not_where_it_points() -> None:
    """A short normal turns R: only a recipe that knows |N| helps."""
    points, normals = wave(1000)
    short = normals * 0.97
    arguments = scene(material=MIRROR, normalise=False)
    right = shade(points, normals, **arguments).colours
    errors = {
        name: np.abs(shade(points, short, **arguments, specular=Formula.parse(name)).colours - right).max()
        for name in ("phong", "phong/once", "phong@lengthwise/once")
    }
    assert errors["phong@lengthwise/once"] < 1e-12 < errors["phong/once"] < errors["phong"]


@pytest.mark.parametrize("spelling", ["phong/once", "phong@lengthwise/once", "blinn/once", "phong/squared"])
@pytest.mark.parametrize("viewer", [EYE, AFAR], ids=["near", "afar"])
def test_what_is_left_out_changes_no_bit(spelling: str, viewer: Viewer) -> None:
    points, normals = wave(3000, np.float32)
    arguments = scene(specular=Formula.parse(spelling), viewer=viewer, material=replace(GREY, shininess=300.0))
    every = shade(points, normals, **arguments, skips=Skips.none())
    done = shade(points, normals, **arguments, skips=Skips.exact())
    assert done.colours.tobytes() == every.colours.tobytes()
    assert done.ledger.beyond_support > 0 or "blinn" in spelling
    tail = shade(points, normals, **arguments)
    np.testing.assert_allclose(tail.colours, every.colours, atol=1e-6)


def test_the_ledger_tells_which_vectors_were_not_made_unit() -> None:
    points, normals = wave(700, np.float32)

    def left(spelling: str, **changes: Any) -> int:
        return shade(
            points, normals, **scene(specular=Formula.parse(spelling), **changes)
        ).ledger.vectors_not_normalised

    assert left("phong") == left("lyon:dot:8") == left("blinn") == 0
    assert left("phong/once") == left("phong@lengthwise/squared") == len(points)  # V, for both lights
    assert left("phong/once", viewer=AFAR) == 0  # that one is made unit once
    assert left("phong/once", material=replace(GREY, fresnel=COPPER)) == 0  # the reflectance asks for it
    done = shade(points, normals, **scene(specular=Formula.parse("blinn/once"))).ledger
    assert done.vectors_not_normalised == done.pairs - done.lights_behind  # H, wherever it was built


@pytest.mark.parametrize(
    "spelling", ["phong/once", "phong/each", "phong@lengthwise/once", "lyon:dot:8/once", "blinn/once"]
)
def test_lengths_beyond_the_range_of_squares_are_dark_and_no_number_is_none(spelling: str) -> None:
    sizes = [0.0, 1e-45, 1e-30, 1e-15, 1e-9, 1.0, 1e9, 1e15, 1e18]
    points = np.array([[0, 0, 0]] * len(sizes) + [EYE.position, LAMP.position], np.float32)
    normals = np.array([[0, 0, size] for size in sizes] + [[0, 0, 1]] * 2, np.float32)
    arguments = scene(material=MIRROR, specular=Formula.parse(spelling), normalise=False)
    found = shade(points, normals, **arguments).colours
    assert np.isfinite(found).all()
    assert (found >= 0).all()
    assert (found[sizes.index(1.0)] > 0).all()
    assert not found[0].any()
    assert not found[-2].any()


def test_what_does_not_fit_is_refused_with_its_field() -> None:
    points, normals = wave(10)
    with pytest.raises(InputError, match=r"float32, not float64") as problem:
        shade(points, normals, **scene(specular=Formula.parse("phong/fast")))
    assert problem.value.where == "specular"
    with pytest.raises(InputError, match=r"makes R") as problem:
        formula_for(Formula.parse("phong@lengthwise/once"), GREY, "blinn-phong")
    assert problem.value.where == "specular.recipe"
    assert formula_for(Formula.parse("lyon:cross:8/once"), GREY, "blinn-phong").normalise == "once"
    with pytest.raises(InputError) as problem:
        formula_for(replace(LYON, normalise="squared"), GREY)
    assert problem.value.where == "specular.normalise"


def test_a_lamp_far_away_and_one_near_are_the_same_light() -> None:
    """V as long as it is: from a mile away it points as the same direction does."""
    points, normals = wave(300)
    light, formula = Light(direction=(0, 0.3, 1)), Formula.parse("phong/once")
    afar = shade(points, normals, **scene(lights=[light], viewer=Viewer(direction=(0, 0, 1)), specular=formula)).colours
    away = Viewer(position=(0, 0, 1e9))
    found = shade(points, normals, **scene(lights=[light], viewer=away, specular=formula)).colours
    np.testing.assert_allclose(found, afar, atol=1e-6)
