"""Every registered approximation passes every shipped check, and errs as much as the notes say."""

import math
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from phongbench.formulas import minimax_fits, slopes
from phongbench.formulas.approximations import gaussian_quadratic
from phongbench.formulas.curves import curve
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY, get
from phongbench.formulas.spec import Approximation, Setting
from phongbench.testing import CHECKS, check_peak


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__.removeprefix("check_"))
@pytest.mark.parametrize("name", REGISTRY)
def test_every_approximation_passes_every_check(name: str, check: Callable[[Approximation], None]) -> None:
    check(REGISTRY[name])


def largest_error(name: str, alpha: float, gamma: int | None = None, slope: str | None = None) -> float:
    """Sup of |exact - approximate| over a dense grid of angles up to 90 degrees, dot form, float64."""
    spec = get(name)
    setting = Setting(alpha, gamma, slope or spec.slopes[0], spec.spaces[0])
    cosine = 1.0 - np.linspace(0.0, min(1.0, 20.0 / alpha), 40_001)
    return float(np.abs(curve(spec, spec.lambda_forms[0], setting, cosine) - cosine**alpha).max())


@pytest.mark.parametrize(("alpha", "gamma", "expected"), [(50, 8, 0.01363), (200, 16, 0.00734), (1000, 8, 0.01603)])
def test_law_5_minimax_slope_gives_the_errors_of_the_notes(alpha: float, gamma: int, expected: float) -> None:
    assert largest_error("lyon", alpha, gamma, "minimax") == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize(("gamma", "expected"), [(4, 0.00605), (8, 0.000863), (16, 0.0001675)])
def test_law_6_lyon_quadratic_is_12_39_and_95_times_better_than_lyon(gamma: int, expected: float) -> None:
    """The notes' .0053, .00077, .00015 belong to a third free coefficient, the constant; it misses the peak."""
    assert largest_error("lyon-quadratic", 200, gamma) == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize(("alpha", "expected"), [(10, 0.0280), (50, 0.00545), (200, 0.00136), (1000, 0.00027)])
def test_law_7_gaussian(alpha: float, expected: float) -> None:
    assert largest_error("gaussian", alpha) == pytest.approx(expected, rel=5e-3)


def test_the_minimax_offset_halves_the_error_of_the_gaussian() -> None:
    assert largest_error("gaussian", 200, slope="minimax") < largest_error("gaussian", 200) / 2


@pytest.mark.parametrize(("alpha", "expected"), [(8, 0.0189), (32, 0.0049), (128, 0.0012)])
def test_the_offset_of_unreal_engine_errs_as_the_notes_say(alpha: float, expected: float) -> None:
    assert largest_error("gaussian", alpha, slope="unreal") == pytest.approx(expected, abs=5e-5)


def test_the_offset_of_unreal_engine_is_that_of_its_factors_of_exp2() -> None:
    """It computes exp2(-s lambda), s = (0.5 q + 0.275) / ln 2, where alpha = (q - 1) / 2 and q = 1 / roughness^2."""
    q = np.array([2.0, 10.0, 300.0])
    shipped = (0.72134752 * q + 0.39674113) * math.log(2)
    ours = [slopes.sharpness("unreal", (one - 1) / 2) for one in q]
    np.testing.assert_allclose(ours, shipped, rtol=1e-8)
    assert "unreal" not in get("lyon").slopes


def test_the_parabola_of_powers_of_two_errs_by_two_thousandths_and_none_errs_less() -> None:
    f = np.linspace(0.0, 1.0, 100_001)

    def error(constant: float, slope: float, curvature: float) -> float:
        return float(np.abs((constant + slope * f + curvature * f**2) / 2**f - 1).max())

    ours = np.array([gaussian_quadratic.CONSTANT, gaussian_quadratic.SLOPE, gaussian_quadratic.CURVATURE])
    assert error(*ours) == pytest.approx(1.725e-3, abs=1e-6)
    rng = np.random.default_rng(1)
    assert all(error(*(ours + step)) > error(*ours) - 1e-9 for step in 1e-4 * rng.normal(size=(100, 3)))


@pytest.mark.parametrize("slope", ["taylor", "unreal"])
def test_the_gaussian_by_a_parabola_is_within_its_error_of_the_gaussian(slope: str) -> None:
    deficit = np.linspace(0.0, 1.0, 10_001)
    for alpha in (1.0, 50.0, 1000.0):
        setting = Setting(alpha, slope=slope)
        values, exact = (curve(get(n), "dot", setting, 1 - deficit) for n in ("gaussian-quadratic", "gaussian"))
        bright = exact > 2.0**-119
        assert np.abs(values[bright] / exact[bright] - 1).max() <= 1.7251e-3
        assert (values[exact < 2.0**-121] == 0).all()


def test_doom_3_is_lyon_with_gamma_2_and_beta_4_on_the_half_vector() -> None:
    setting, cosine = Setting(4.0, space="half"), np.linspace(-1.0, 1.0, 2001)
    ours = Formula.parse("lyon:dot:2:4.0@half")
    lyon = curve(ours.spec(), "dot", ours.setting(4.0), cosine)
    values = curve(get("doom3"), "dot", setting, cosine)
    np.testing.assert_array_equal(values, lyon)
    n_h = np.sqrt((1 + cosine) / 2)
    np.testing.assert_allclose(values, np.maximum(0, (n_h - 0.75) * 4) ** 2, atol=1e-15)


def test_doom_3_is_far_from_the_power_16_that_it_stands_for_and_nearest_to_another() -> None:
    x = np.linspace(0.0, 1.0, 20_001)
    ramp = np.maximum(0, (x - 0.75) * 4) ** 2
    powers = np.linspace(9.0, 12.0, 301)
    errors = np.array([np.abs(x**power - ramp).max() for power in powers])
    assert np.abs(x**16 - ramp).max() == pytest.approx(0.207, abs=1e-3)
    assert powers[errors.argmin()] == pytest.approx(10.56, abs=0.02)
    assert errors.min() == pytest.approx(0.058, abs=5e-4)


def test_schlicks_formula_is_known_by_the_names_that_shader_libraries_give_it() -> None:
    x, b = np.linspace(0.0, 1.0, 101), 32.0
    values = curve(get("schlick"), "none", Setting(b), x)
    np.testing.assert_allclose(values, x / ((1 - b) * x + b), rtol=1e-12)
    assert "powFast" in get("schlick").also[0].text


def test_schlick_tends_to_the_error_of_its_limit() -> None:
    assert largest_error("schlick", 1e5) == pytest.approx(0.2036, abs=1e-4)


@pytest.mark.parametrize(("alpha", "ratio"), [(1, 6.38), (2, 4.91), (4, 4.39), (8, 4.18), (16, 4.086), (64, 4.021)])
def test_the_minimax_ratio_of_blinn_is_that_of_the_notes(alpha: float, ratio: float) -> None:
    assert minimax_fits.half_angle_ratio(alpha) == pytest.approx(ratio, abs=0.006)


@pytest.mark.parametrize("alpha", [1.0, 5.0, 50.0])
def test_among_blinns_policies_minimax_errs_least(alpha: float) -> None:
    errors = {slope: largest_error("blinn", alpha, slope=slope) for slope in get("blinn").slopes}
    assert min(errors, key=errors.__getitem__) == "minimax"


def test_integer_power_is_exact_up_to_rounding() -> None:
    assert largest_error("integer-power", 1000) < 1e-13


@pytest.mark.parametrize("alpha", [20.0, 50.0, 200.0])
def test_table_x_errs_by_the_sagitta_of_its_steepest_step(alpha: float) -> None:
    assert largest_error("table-x", alpha) == pytest.approx(alpha * (alpha - 1) / (8 * 255**2), rel=0.4)


@pytest.mark.parametrize("alpha", [14.0, 20.0, 64.0, 1000.0, 1e5])
def test_table_u_holds_a_thousandth_with_one_table_for_every_alpha(alpha: float) -> None:
    assert largest_error("table-u", alpha) < 0.0011
    table = get("table-u").table
    assert table is not None
    assert np.array_equal(table(Setting(alpha)), table(Setting(1.0)))


@pytest.mark.parametrize(
    ("alpha", "bound"), [(1, 0.053), (2, 0.042), (3, 0.027), (10, 0.021), (32, 0.019), (64, 0.016)]
)
def test_kuijk_and_blake_is_within_a_few_percent_up_to_64(alpha: float, bound: float) -> None:
    assert largest_error("kuijk-blake", alpha) < bound


def test_the_bit_trick_is_as_bad_as_it_says() -> None:
    assert largest_error("bit-trick", 1000) == pytest.approx(0.128, abs=0.002)


@pytest.mark.parametrize("gamma", [1, 2, 4, 8, 16, 64])
@pytest.mark.parametrize("alpha", [1.0, 5.0, 20.0, 200.0])
def test_no_neighbour_of_the_fitted_parabola_is_better(alpha: float, gamma: int) -> None:
    deficit = np.linspace(0.0, min(1.0, 18.0 / alpha), 600)

    def error(beta: float, curvature: float) -> float:
        v = np.minimum(beta * deficit, minimax_fits.turn(curvature))
        base = np.maximum(1 - v * (1 - curvature * v), 0)
        return float(np.abs((1 - deficit) ** alpha - base**gamma).max())

    beta, curvature = minimax_fits.parabola(alpha, gamma)
    here = error(beta, curvature)
    directions = np.array([(math.cos(t), math.sin(t)) for t in np.linspace(0, 2 * math.pi, 73)])
    for size in (1e-4, 1e-2):
        around = [error(beta * (1 + size * x), curvature + size * max(abs(curvature), 0.01) * y) for x, y in directions]
        assert min(around) >= here * (1 - 1e-5) - 1e-12


@given(alpha=st.floats(1.0, 1e5), n=st.integers(0, 8))
@settings(max_examples=40, deadline=None)
def test_every_fit_is_finite_falls_from_the_peak_and_beats_lyon(alpha: float, n: int) -> None:
    beta, curvature = minimax_fits.parabola(alpha, 2**n)
    assert math.isfinite(curvature)
    assert beta > 0
    assert largest_error("lyon-quadratic", alpha, 2**n) <= largest_error("lyon", alpha, 2**n, "minimax") + 1e-9


def test_a_check_says_what_it_found_and_where() -> None:
    wrong = replace(get("lyon"), peak=0.5)
    with pytest.raises(AssertionError, match=r"lyon: 1.0 at the peak in float\d\d \(Setting\(alpha=1.0"):
        check_peak(wrong)


@pytest.mark.parametrize("name", REGISTRY)
def test_the_plain_bodies_say_the_same_without_numba(name: str, without_numba: set[str]) -> None:
    assert name in without_numba


@pytest.fixture(scope="module")
def without_numba() -> set[str]:
    """Names that pass the checks of values in a process where numba compiles nothing."""
    program = (
        "from phongbench import testing\n"
        "from phongbench.compiler import jit\n"
        "from phongbench.formulas.registry import REGISTRY\n"
        "assert jit.DISABLED\n"
        "testing.COSINES = testing.COSINES[::6]\n"
        "for spec in REGISTRY.values():\n"
        "    for check in testing.CHECKS: check(spec)\n"
        "    print(spec.name)\n"
    )
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program], env=environment, check=True, capture_output=True, text=True
    )
    return set(done.stdout.split())
