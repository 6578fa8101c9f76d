"""Moments of lobes: closed forms, quadrature and integrals over both angles agree."""

import math
from itertools import product

import mpmath
import numpy as np
import pytest

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.formulas import curves, lobe_laws, lobe_moments
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation, Setting

ALPHAS = (0.5, 1.0, 5.0, 50.0, 1000.0, 1e5)


def setting_of(name: str, alpha: float, gamma: int | None = None, slope: str | None = None) -> Setting:
    spec = REGISTRY[name]
    return Setting(alpha, gamma, slope or spec.slopes[0], spec.spaces[0])


@pytest.mark.parametrize("alpha", ALPHAS)
@pytest.mark.parametrize(
    ("name", "form", "gamma", "slope"),
    [
        ("phong", "none", None, None),
        *(("lyon", form, gamma, slope) for form in ("dot", "difference", "cross") for gamma, slope in
          [(1, "taylor"), (2, "minimax"), (8, "energy"), (64, "taylor")]),
        ("gaussian", "dot", None, "taylor"),
        ("gaussian", "difference", None, "unreal"),
        ("blinn", "none", None, "taylor"),
        ("blinn", "none", None, "minimax"),
    ],
)  # fmt: skip
def test_the_quadrature_gives_the_closed_forms(
    name: str, form: str, gamma: int | None, slope: str | None, alpha: float
) -> None:
    spec, setting = REGISTRY[name], setting_of(name, alpha, gamma, slope)
    found, (energy, momentum) = lobe_moments.moments(spec, form, setting, [0.0]), lobe_laws.of(spec, form, setting)
    if form != "cross":
        assert found.energy[0] == pytest.approx(energy, rel=1e-9)
    assert found.momentum[0] == pytest.approx(momentum, rel=1e-9)
    assert abs(found.sideways[0]) < 1e-12


def test_the_closed_forms_are_those_of_the_notes() -> None:
    assert lobe_laws.phong(9.0) == (2 * math.pi / 10, 2 * math.pi / 11)
    energy, momentum = lobe_laws.lyon(6.25, 8.0)
    assert energy == pytest.approx(2 * math.pi / (6.25 * 9))
    assert momentum == pytest.approx(2 * math.pi * (1 / (6.25 * 9) - 1 / (6.25**2 * 9 * 10)))
    # the slope of the policy `energy` keeps Phong's
    assert lobe_laws.lyon((50 + 1) / (8 + 1), 8.0)[0] == pytest.approx(lobe_laws.phong(50.0)[0])


@pytest.mark.parametrize(("beta", "gamma"), [(0.0, 8), (0.3, 8), (1.0, 4), (1.7, 2), (6.25, 8)])
def test_lyons_closed_forms_are_its_integrals_even_where_the_horizon_cuts_its_foot(beta: float, gamma: int) -> None:
    def integral(value: object) -> float:
        ends = sorted({0.0, min(1.0, max(0.0, 1 - 1 / beta)) if beta else 0.0, 1.0})
        return 2 * math.pi * float(mpmath.quad(value, ends))

    def dot(x: float) -> float:
        return max(0, 1 - beta * (1 - x)) ** gamma

    def cross(x: float) -> float:
        return max(0, 1 - beta * (1 - x * x) / 2) ** gamma

    assert lobe_laws.lyon(beta, gamma) == pytest.approx((integral(dot), integral(lambda x: x * dot(x))), rel=1e-9)
    assert lobe_laws.lyon_cross(beta, gamma)[1] == pytest.approx(integral(lambda x: x * cross(x)), rel=1e-6)


def over_both_angles(spec: Approximation, form: str, setting: Setting, degrees: float, rings: int = 700) -> Array:
    """Energy, momentum and sideways by the midpoint rule over the hemisphere, straight from their definition."""
    i = math.radians(degrees)
    normal, light = np.array([0.0, 0.0, 1.0]), np.array([-math.sin(i), 0.0, math.cos(i)])
    mirrored = 2 * (light @ normal) * normal - light
    across = (normal - math.cos(i) * mirrored) / math.sin(i)
    up, turn = np.meshgrid((np.arange(rings) + 0.5) / rings, math.pi * (np.arange(2 * rings) + 0.5) / rings)
    out = np.sqrt(1 - up * up)
    v = np.stack([out * np.cos(turn), out * np.sin(turn), up]).reshape(3, -1)
    cosine = mirrored @ v
    if setting.space == "half":
        h = v + light[:, None]
        cosine = 2 * (normal @ h / np.linalg.norm(h, axis=0)) ** 2 - 1
    value = curves.curve(spec, form, setting, cosine)
    return np.array([(value * part).sum() for part in (1.0, mirrored @ v, across @ v)]) * 2 * math.pi / v.shape[1]


@pytest.mark.parametrize("degrees", [20.0, 60.0, 85.0])
@pytest.mark.parametrize(
    ("name", "form", "gamma", "space"),
    [("phong", "none", None, "reflect"), ("lyon", "cross", 8, "reflect"), ("blinn", "none", None, "half"),
     ("lyon", "dot", 8, "half"), ("doom3", "dot", None, "half")],
)  # fmt: skip
def test_where_the_horizon_cuts_the_lobe_an_integral_over_both_angles_gives_the_same(
    name: str, form: str, gamma: int | None, space: str, degrees: float
) -> None:
    for alpha in (1.0, 20.0):
        spec, setting = REGISTRY[name], Setting(alpha, gamma, REGISTRY[name].slopes[0], space)
        found = lobe_moments.moments(spec, form, setting, [degrees])
        ours = np.array([found.energy[0], found.momentum[0], found.sideways[0]])
        # a cut at 90 degrees that shows, as of Lyon at alpha 1, makes the midpoint rule coarse
        tolerance = 3e-4 if (name, alpha) == ("lyon", 1.0) else 3e-6
        np.testing.assert_allclose(ours, over_both_angles(spec, form, setting, degrees), atol=tolerance)


def test_at_grazing_incidence_half_of_a_lobe_around_the_mirrored_direction_is_above_the_horizon() -> None:
    spec, setting = REGISTRY["phong"], Setting(20.0)
    found = lobe_moments.moments(spec, "none", setting, [0.0, 90.0])
    assert found.energy[1] == pytest.approx(found.energy[0] / 2, rel=1e-9)
    assert found.momentum[1] == pytest.approx(found.momentum[0] / 2, rel=1e-9)
    assert found.sideways[1] > 0


@pytest.mark.parametrize("name", REGISTRY)
def test_no_lobe_sends_more_along_the_mirrored_direction_than_it_has(name: str) -> None:
    spec, setting = REGISTRY[name], setting_of(name, 20.0, 8 if REGISTRY[name].uses_gamma else None)
    found = lobe_moments.moments(spec, spec.lambda_forms[0], setting, [0.0, 45.0, 80.0])
    assert (np.hypot(found.momentum, found.sideways) <= found.energy * (1 + 1e-12)).all()
    assert (np.diff(found.energy) <= 1e-12).all()  # the horizon only takes away


@pytest.mark.parametrize("alpha", [1.0, 5.0, 50.0, 1e5])
def test_half_widths_are_those_of_their_closed_forms(alpha: float) -> None:
    phong = lobe_moments.exact(alpha, (0.0,)).half_width
    assert phong == pytest.approx(math.degrees(math.acos(0.5 ** (1 / alpha))), rel=1e-5)
    blinn = lobe_moments.moments(REGISTRY["blinn"], "none", setting_of("blinn", alpha), [0.0]).half_width
    assert blinn == pytest.approx(2 * math.degrees(math.acos(0.5 ** (1 / (4 * alpha)))), rel=1e-5)
    lyon = lobe_moments.moments(REGISTRY["lyon"], "dot", setting_of("lyon", alpha, 8), [0.0]).half_width
    deficit = 8 / alpha * (1 - 0.5 ** (1 / 8))
    assert lyon == pytest.approx(math.degrees(math.acos(1 - deficit)), rel=1e-5)


def test_a_lobe_that_never_falls_to_half_has_no_half_width() -> None:
    assert math.isnan(lobe_moments.moments(REGISTRY["lyon"], "dot", setting_of("lyon", 0.5, 8), [0.0]).half_width)


def test_at_alpha_0_a_lobe_is_the_half_space() -> None:
    found = lobe_moments.moments(REGISTRY["phong"], "none", Setting(0.0), [0.0, 60.0])
    np.testing.assert_allclose(found.energy, [2 * math.pi, 2 * math.pi * 2 / 3])
    np.testing.assert_allclose(found.momentum[0], math.pi)
    assert math.isnan(found.half_width)
    for name, slope in product(("gaussian", "lyon"), ("taylor",)):
        setting = setting_of(name, 0.0, 8, slope)
        assert lobe_laws.of(REGISTRY[name], "dot", setting) == lobe_laws.phong(0.0)


@pytest.mark.parametrize("degrees", [-1.0, 90.1, math.nan, math.inf])
def test_an_incidence_behind_the_surface_is_refused(degrees: float) -> None:
    with pytest.raises(InputError, match=r"outside 0 \.\. 90") as problem:
        lobe_moments.moments(REGISTRY["phong"], "none", Setting(5.0), [degrees])
    assert problem.value.where == "incidence"


def test_no_incidence_gives_no_rows() -> None:
    assert lobe_moments.moments(REGISTRY["phong"], "none", Setting(5.0), []).energy.shape == (0,)
