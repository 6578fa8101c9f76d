"""The highlight against the angle, by real vectors."""

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from phongbench.compiler.precisions import FLOAT16, FLOAT32, FLOAT64
from phongbench.formulas import error_laws
from phongbench.formulas.curves import curve, cutoff_degrees, lobe
from phongbench.formulas.registry import REGISTRY, get
from phongbench.formulas.spec import Setting

DEGREES = 90 * np.linspace(0, 1, 301) ** 2
SPACES = [
    (spec.name, form, space)
    for spec in REGISTRY.values()
    for form, space in itertools.product(spec.lambda_forms, spec.spaces)
]


def setting_of(name: str, space: str = "reflect", alpha: float = 64.0, gamma: int = 8) -> Setting:
    spec = get(name)
    return Setting(alpha, gamma if spec.uses_gamma else None, spec.slopes[0], space)


@pytest.mark.parametrize(("name", "form", "space"), SPACES)
def test_unit_vectors_in_double_precision_give_the_curve_of_the_angle(name: str, form: str, space: str) -> None:
    spec, setting = get(name), setting_of(name, space)
    value, exact = lobe(spec, form, setting, DEGREES)
    phong = get("phong")
    cosine = np.cos(np.radians(DEGREES))
    # at 90 degrees a rounding decides on which side of the gate a pair lies
    inner = DEGREES < 89.999
    assert np.abs(value - curve(spec, form, setting, cosine))[inner].max() < 1e-11
    assert np.abs(exact - curve(phong, "none", Setting(setting.alpha), cosine)).max() < 1e-11


@pytest.mark.parametrize("space", ["reflect", "half"])
def test_exact_is_of_the_true_angle_whatever_the_lengths(space: str, exact_angle: Callable[..., Any]) -> None:
    setting = setting_of("lyon", space, alpha=20.0)
    degrees = np.array([0.0, 3.0, 20.0, 50.0])
    _, exact = lobe(get("lyon"), "cross", setting, degrees, perturbation="opposite", length_error=0.3)
    for angle, found in zip(degrees, exact, strict=True):
        own = math.radians(angle / (2 if space == "half" else 1))
        pair = np.array([0.0, 0.0, 1.3]), 0.7 * np.array([math.sin(own), 0.0, math.cos(own)])
        assert found == pytest.approx(float(exact_angle(*pair, 20.0, space == "half")), abs=1e-12)


@pytest.mark.parametrize("form", ["dot", "difference", "cross", "tan2"])
def test_lengths_change_a_form_as_its_vectors_say(form: str) -> None:
    setting, one, other = setting_of("lyon"), 1.01, 1.01
    value, _ = lobe(get("lyon"), form, setting, DEGREES, perturbation="both", length_error=0.01)
    x = np.cos(np.radians(DEGREES))
    dot, cross = one * other * x, (one * other) ** 2 * (1 - x * x)
    deficits = {
        "dot": 1 - dot,
        "difference": (one**2 + other**2) / 2 - dot,
        "cross": cross / 2,
        "tan2": (1 - x * x) / (2 * x * x),
    }
    wanted = np.maximum(0, 1 - setting.alpha / 8 * deficits[form]) ** 8
    assert value == pytest.approx(wanted, abs=1e-9)


def test_the_form_that_divides_the_lengths_out_does_not_see_them() -> None:
    setting = setting_of("lyon")
    right, _ = lobe(get("lyon"), "tan2", setting, DEGREES)
    wrong, _ = lobe(get("lyon"), "tan2", setting, DEGREES, perturbation="a", length_error=0.2)
    assert wrong == pytest.approx(right, abs=1e-12)


def test_a_coarser_precision_errs_more_and_no_more_than_it_may() -> None:
    setting = setting_of("lyon")
    error = {}
    for precision in (FLOAT64, FLOAT32, FLOAT16):
        value, exact = lobe(get("lyon"), "dot", setting, DEGREES, precision=precision)
        unit, true = lobe(get("lyon"), "dot", setting, DEGREES)
        error[precision.name] = np.abs((value - exact) - (unit - true)).max()
        assert np.array_equal(precision.rounded(value), value.astype(precision.carrier)), "a value it cannot hold"
    assert error["float64"] == 0
    # 1 - a.b near 0 is off by about an epsilon, times alpha
    assert FLOAT32.eps / 8 < error["float32"] < 4 * setting.alpha * FLOAT32.eps
    assert FLOAT16.eps / 8 < error["float16"] < 4 * setting.alpha * FLOAT16.eps


@pytest.mark.parametrize("space", ["reflect", "half"])
@pytest.mark.parametrize("form", ["dot", "difference", "cross", "tan2"])
def test_beyond_the_cutoff_it_is_dark_and_before_it_is_not(form: str, space: str) -> None:
    spec, setting = get("lyon"), setting_of("lyon", space, alpha=40.0, gamma=4)
    edge = cutoff_degrees(spec, form, setting)
    assert edge is not None
    value, _ = lobe(spec, form, setting, np.array([edge - 0.5, edge + 1e-6]))
    assert value[0] > 0
    assert value[1] == 0


def test_a_lobe_that_reaches_the_horizon_has_no_cutoff() -> None:
    assert cutoff_degrees(get("lyon"), "cross", setting_of("lyon", alpha=8.0, gamma=8)) is None
    assert cutoff_degrees(get("gaussian"), "dot", setting_of("gaussian")) is None


def test_lyons_largest_error_is_the_laws() -> None:
    for form in ("dot", "cross"):
        value, exact = lobe(get("lyon"), form, setting_of("lyon", alpha=200.0), 40 * np.linspace(0, 1, 4001))
        assert np.abs(value - exact).max() == pytest.approx(
            abs(float(error_laws.lyon_taylor(form, 200.0, 8))), rel=0.01
        )
