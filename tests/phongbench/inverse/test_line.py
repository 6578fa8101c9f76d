"""Lines across cylinders: both solutions, the priors, heights and their band, and what cannot be known."""

import math

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray

import phongbench as pb
from phongbench.errors import InputError, UnknownNameError
from phongbench.inverse.branches import PRIORS
from phongbench.inverse.line import MARKS, InverseLine, invert_line
from phongbench.inverse.line_heights import START, intervals
from phongbench.inverse.line_model import LineModel

Array = NDArray[np.float64]
COUNT = 200
X = np.linspace(-1.0, 1.0, COUNT)
#: surface -> height, the slope's rise and run, and the first of the priors that are true of it
SURFACES = {
    "circle": (np.sqrt(1 - X**2), -X, np.sqrt(1 - X**2), "convex"),
    "ellipse": (0.5 * np.sqrt(1 - X**2), -0.5 * X, np.sqrt(1 - X**2), "convex"),
    "bowl": (-np.sqrt(1 - X**2), X, np.sqrt(1 - X**2), "concave"),
    "sine": (0.2 * np.sin(1.5 * math.pi * X), 0.3 * math.pi * np.cos(1.5 * math.pi * X), np.ones(COUNT), "continuous"),
}
SLANTED = (0.71, 0.71)


#: surfaces and every prior that is true of them
KNOWN = sorted({(name, prior) for name, surface in SURFACES.items() for prior in (surface[3], "continuous")})


def shaded(name: str, model: LineModel) -> tuple[Array, Array, Array]:
    """Height, normals and intensities of a surface."""
    height, rise, run, _ = SURFACES[name]
    normals = np.stack([-rise, run], axis=1) / np.hypot(rise, run)[:, None]
    return height, normals, model.ambient + model.diffuse * np.maximum(normals @ model.light, 0.0)


def gentle(name: str) -> NDArray[np.bool_]:
    """Where the slope is at most 5."""
    _, rise, run, _ = SURFACES[name]
    return np.asarray(np.abs(rise) <= START * run)


def off(line: InverseLine, height: Array) -> Array:
    """Height minus the true one, both 0 where heights start; NaN where there is none."""
    start = int(np.nanargmin(np.abs(line.height)))
    return np.asarray(line.height - (height - height[start]))


@pytest.mark.parametrize("light", [SLANTED, (0.2, 1.0), (-0.4, 0.9)])
@pytest.mark.parametrize(("name", "prior"), KNOWN)
def test_a_known_surface_comes_back(name: str, prior: str, light: tuple[float, float]) -> None:
    model = LineModel(0.1, 0.7, light)
    height, normals, intensity = shaded(name, model)
    line = invert_line(intensity, model, x=X, prior=prior)
    known = np.isfinite(line.height) & gentle(name)
    assert known.sum() > 0.6 * COUNT
    assert np.abs(off(line, height)[known]).max() <= 1e-3 * np.ptp(height)
    assert np.abs(line.normals - normals)[known].max() < 1e-6
    assert (line.height_low[known] == line.height_high[known]).all()


def test_the_sources_example_is_solved_to_the_last_digits() -> None:
    # L = [0.71, 0.71] as it is given, of length 1.004: the line and the circle meet in two points
    model = LineModel(0.1, 0.7, SLANTED)
    lit = np.linspace(0.01, 0.99, 99)
    line = invert_line(model.ambient + model.diffuse * lit, model, prior="towards-viewer")
    with mpmath.workdps(40):
        for k, intensity in enumerate(line.intensity):
            s = (mpmath.mpf(float(intensity)) - mpmath.mpf(model.ambient)) / mpmath.mpf(model.diffuse)
            length = mpmath.hypot(mpmath.mpf(0.71), mpmath.mpf(0.71))
            turn = mpmath.acos(s / length)
            for sign in (-1, 1):
                angle = mpmath.pi / 4 + sign * turn
                expected = np.array([float(mpmath.sin(angle)), float(mpmath.cos(angle))])
                gaps = [np.abs(branch[k] - expected).max() for branch in (line.normals, line.other)]
                assert min(gaps) < 1e-12
    assert line.facts["light_length"] == math.hypot(0.71, 0.71)
    assert "length 1.00409 and is taken as given" in line.notes[0]
    unit = invert_line(model.ambient + model.diffuse * lit, model.unit(), prior="towards-viewer")
    assert unit.notes == ()
    assert np.abs(unit.angles - line.angles).max() > 0.1


# not (0.2, 1.0): along the sine's mean normal, it shades the line that is mirrored there alike
@pytest.mark.parametrize("light", [SLANTED, (0.4, 1.0), (-0.4, 0.9)])
@pytest.mark.parametrize(("name", "prior"), KNOWN)
def test_the_truth_lies_in_the_band(name: str, prior: str, light: tuple[float, float]) -> None:
    model = LineModel(0.1, 0.7, light, noise=1 / 255)
    height, _, exact = shaded(name, model)
    shares = []
    for seed in range(20):
        noisy = np.clip(exact + np.random.default_rng(seed).normal(0, model.noise, COUNT), 0, 1)
        line = invert_line(noisy, model, x=X, prior=prior, bridge=True)
        known = np.isfinite(line.height) & gentle(name)
        start = int(np.nanargmin(np.abs(line.height)))
        inside = (line.height_low <= height - height[start]) & (height - height[start] <= line.height_high)
        shares.append(inside[known].mean())
        assert np.nanmedian(line.height_high - line.height_low) < 0.5 * np.ptp(height)
    assert np.mean(shares) >= 0.95


def test_a_smooth_line_is_found_through_noise_that_is_not_told() -> None:
    model = LineModel(0.1, 0.7, (0.2, 1.0))
    _, normals, exact = shaded("sine", model)
    for seed in range(5):
        noisy = np.clip(exact + np.random.default_rng(seed).normal(0, 1 / 255, COUNT), 0, 1)
        line = invert_line(noisy, model, x=X, prior="continuous")
        off_light = np.abs(exact - model.ambient - model.diffuse * model.length) > 0.03
        known = off_light & np.isfinite(line.normals[:, 0])
        assert np.abs(line.normals - normals)[known].max() < 0.2


def test_what_mirrors_at_a_light_beside_the_viewer_is_one_of_two() -> None:
    # a light in the viewer's direction shades the sine and the one that is upside down alike
    model = LineModel(0.1, 0.7, (0.0, 1.0))
    height, _, intensity = shaded("sine", model)
    line = invert_line(intensity, model, x=X, prior="continuous", bridge=True)
    assert min(np.abs(off(line, sign * height)).max() for sign in (1, -1)) < 1e-3 * np.ptp(height)


def test_both_branches_have_the_intensity_and_each_prior_takes_one() -> None:
    model = LineModel(0.05, 0.8, (0.3, 0.9))
    intensity = np.random.default_rng(3).uniform(0.1, 0.8, 50)
    for prior in (*PRIORS, np.full(50, -60.0)):
        line = invert_line(intensity, model, prior=prior)
        for branch in (line.normals, line.other):
            known = np.isfinite(branch[:, 0])
            assert np.abs(model.ambient + model.diffuse * branch[known] @ model.light - intensity[known]).max() < 1e-14
            assert np.abs(np.hypot(*branch[known].T) - 1).max() < 1e-14
    nearest = np.abs(line.angles + 60) <= np.abs(line.others + 60)
    assert nearest.all()
    facing = invert_line(intensity, model, prior="towards-viewer")
    assert (facing.normals[:, 1] >= facing.other[:, 1]).all()


def test_mirrored_lines_have_mirrored_answers() -> None:
    model, mirrored = LineModel(0.1, 0.7, (0.4, 0.8)), LineModel(0.1, 0.7, (-0.4, 0.8))
    _, _, intensity = shaded("circle", model)
    one = invert_line(intensity, model, x=X)
    other = invert_line(intensity[::-1], mirrored, x=-X[::-1], start="right")
    np.testing.assert_allclose(other.angles[::-1], -one.angles, atol=1e-9)
    np.testing.assert_allclose(other.height[::-1], one.height, atol=1e-12)


def test_what_is_not_usable_is_marked_and_never_used_unasked() -> None:
    model = LineModel(0.1, 0.7, (0.0, 1.0))
    values = [0.45, 0.6, 0.05, 0.7, 0.81, 0.7, 1.0, 0.6, 0.5, 0.4]
    line = invert_line(values, model)
    assert line.marks.tolist() == ["ok", "ok", "shadow", "ok", "bright", "ok", "saturated", "ok", "ok", "ok"]
    assert set(line.marks) <= set(MARKS)
    assert np.isnan(line.normals[[2, 4, 6]]).all()
    assert np.flatnonzero(np.isfinite(line.height)).tolist() == [7, 8, 9]
    assert "1 shadow, 1 saturated, 1 bright" in line.notes[0]
    bridged = invert_line(values, model, bridge=True)
    assert np.isfinite(bridged.height).all()
    assert bridged.marks.tolist() == line.marks.tolist()
    assert np.isnan(bridged.normals[2]).all()
    assert invert_line([0.0, 0.0], model).notes == ("no sample is usable: there are no heights",)
    assert line.as_dict()["normals"][2] == [None, None]


def test_heights_start_where_they_are_told_to() -> None:
    model = LineModel(0.1, 0.7, (0.2, 1.0))
    _, _, intensity = shaded("circle", model)
    left, right, both = (invert_line(intensity, model, x=X, start=start).height for start in ("left", "right", "both"))
    known = np.isfinite(left)
    assert np.ptp((left - right)[known]) < 1e-12
    ends = np.flatnonzero(known & (np.abs(X) < 0.97))[[0, -1]]
    assert np.abs(both[np.flatnonzero(both == 0.0)]).max() == 0
    assert abs(both[ends[0]] - both[ends[1]]) < 0.05


def test_the_rules_are_exact_for_parabolas_and_for_lines_on_uneven_samples() -> None:
    x = np.cumsum([0.0, 1.0, 2.0, 1.5, 1.0, 2.5, 1.2])
    np.testing.assert_allclose(intervals(x, x**2, "simpson"), np.diff(x**3) / 3, atol=1e-12)
    np.testing.assert_allclose(intervals(x, x, "trapezoid"), np.diff(x**2) / 2, atol=1e-12)
    # the trapezoid's own error, for parabolas
    np.testing.assert_allclose(intervals(x, x**2, "trapezoid") - np.diff(x**3) / 3, np.diff(x) ** 3 / 6, atol=1e-12)


@pytest.mark.parametrize(
    ("changed", "where"),
    [
        ({"intensity": [0.5, 1.5]}, "intensity[1]"),
        ({"intensity": [0.5, math.nan]}, "intensity[1]"),
        ({"intensity": []}, "intensity"),
        ({"intensity": [[0.5]]}, "intensity"),
        ({"intensity": "abc"}, "intensity"),
        ({"x": [0.0, 0.0]}, "x[1]"),
        ({"x": [0.0]}, "x"),
        ({"x": [0.0, 1e-300]}, "x[1]"),
        ({"x": [0.0, 1e300]}, "x[1]"),
        ({"diffuse": 1e-320}, "diffuse"),
        ({"ambient": 1e300}, "ambient"),
        ({"light": (1e-320, 0.0)}, "light"),
        ({"light": (1e300, 0.0)}, "light"),
        ({"prior": [1.0]}, "prior"),
        ({"light": (0.0, 0.0)}, "light"),
        ({"light": (0.5, -0.1)}, "light"),
        ({"light": (1.0, math.inf)}, "light"),
        ({"light": 3}, "light"),
        ({"diffuse": 0.0}, "diffuse"),
        ({"ambient": -1.0}, "ambient"),
        ({"noise": math.nan}, "noise"),
    ],
)
def test_wrong_input_names_its_place(changed: dict[str, object], where: str) -> None:
    given: dict[str, object] = {"intensity": [0.5, 0.6], "ambient": 0.1, "diffuse": 0.7, "light": (0.0, 1.0)}
    given |= {"noise": 0.0, "x": None, "prior": "convex"} | changed
    with pytest.raises(InputError) as problem:
        pb.inverse_line(**given)  # type: ignore[arg-type]
    assert problem.value.where == where


@pytest.mark.parametrize("name", ["prior", "rule", "start"])
def test_unknown_names_list_the_known(name: str) -> None:
    with pytest.raises(UnknownNameError) as problem:
        invert_line([0.5], LineModel(0.1, 0.7, (0.0, 1.0)), **{name: "simson"})  # type: ignore[arg-type]
    assert problem.value.kind == name
