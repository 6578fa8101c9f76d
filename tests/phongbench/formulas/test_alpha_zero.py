"""Alpha 0: Phong is 1 wherever a.b > 0 and 0 elsewhere; a formula gives just that, or says why it does not."""

import math
from dataclasses import replace
from itertools import product

import mpmath
import numpy as np
import pytest

from phongbench.compiler.precisions import PRECISIONS, Array
from phongbench.errors import InputError
from phongbench.formulas.curves import lobe
from phongbench.formulas.exact import of_deficits
from phongbench.formulas.kernel import Kernel, limit
from phongbench.formulas.lambda_forms import deficit_of_angle
from phongbench.formulas.registry import REGISTRY, describe, takes_zero
from phongbench.formulas.spec import Approximation, Setting
from phongbench.inputs.plan import preset

CASES = [(name, slope, space) for name, spec in REGISTRY.items() for slope, space in product(spec.slopes, spec.spaces)]
TAKEN = {"phong", "lyon", "gaussian", "gaussian-quadratic", "blinn", "table-x", "bit-trick", "schlick"}
#: away from the first step of a table over the cosine
COSINES = np.linspace(0.01, 1.0, 100)


def setting_of(name: str, slope: str, space: str, alpha: float = 0.0) -> Setting:
    return Setting(alpha, 8 if REGISTRY[name].uses_gamma else None, slope, space)


def refused(spec: Approximation, setting: Setting) -> str:
    """Why it is refused; "" if it is not."""
    try:
        spec.check(setting)
    except InputError as problem:
        return problem.what
    return ""


def values(spec: Approximation, setting: Setting, cosine: Array, precision: str = "float64", form: str = "") -> Array:
    held = PRECISIONS[precision]
    form = form or spec.lambda_forms[0]
    coordinate = cosine if form == "none" else deficit_of_angle(form, cosine)
    with np.errstate(all="ignore"):
        return Kernel.of(spec, setting, held).values(held.rounded(coordinate), held.rounded(cosine))


def test_these_take_alpha_0_and_every_entry_says_so() -> None:
    assert {name for name, spec in REGISTRY.items() if takes_zero(spec)} == TAKEN
    assert {name for name, spec in REGISTRY.items() if describe(spec)["takes_alpha_0"]} == TAKEN


@pytest.mark.parametrize(("name", "slope", "space"), CASES)
def test_it_is_the_constant_of_phong_or_refused_with_the_reason(name: str, slope: str, space: str) -> None:
    spec, setting = REGISTRY[name], setting_of(name, slope, space)
    reason = refused(spec, setting)
    if reason:
        assert "alpha = 0" in reason
        return
    for precision, form in product(PRECISIONS, spec.lambda_forms):
        lit = values(spec, setting, COSINES, precision, form)
        np.testing.assert_allclose(lit, spec.peak, atol=2 * PRECISIONS[precision].eps, err_msg=f"{precision} {form}")
        behind = values(spec, setting, np.array([0.0, -1e-3, -0.5, -1.0, math.nan]), precision, form)
        assert (behind == 0).all(), (precision, form, behind)


@pytest.mark.parametrize(("name", "slope", "space"), CASES)
def test_what_is_taken_is_the_limit_of_small_exponents_and_what_is_refused_has_another(
    name: str, slope: str, space: str
) -> None:
    spec, tiny = REGISTRY[name], setting_of(name, slope, space, 1e-9)
    reason = refused(spec, setting_of(name, slope, space))
    if "outside" in reason or "fitted from" in reason:
        return  # nor does it take small exponents
    near = values(spec, tiny, COSINES)
    if not reason:
        np.testing.assert_allclose(near, spec.peak, atol=1e-6)
    else:
        assert np.abs(near - spec.peak).max() > 0.1


def test_the_truth_is_the_constant_too() -> None:
    np.testing.assert_array_equal(of_deficits(np.array([0.0, 0.5, 1.0 - 1e-12, 1.0, 1.5]), 0.0), [1, 1, 1, 0, 0])
    value, exact = lobe(REGISTRY["phong"], "none", Setting(0.0), np.array([0.0, 45.0, 89.999]))
    assert value.tolist() == exact.tolist() == [1, 1, 1]


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_nothing_in_front_is_skipped(precision: str) -> None:
    assert limit(REGISTRY["phong"], Setting(0.0), PRECISIONS[precision]) == 0
    assert limit(REGISTRY["lyon"], Setting(0.0, 8, "taylor"), PRECISIONS[precision]) == math.inf


def test_a_study_refuses_it_because_there_is_nothing_to_approximate() -> None:
    with pytest.raises(InputError, match=r"alpha = 0 is not in") as problem:
        replace(preset("quick"), alphas=(0.0, 10.0)).validated()
    assert "Phong is 1" in str(problem.value.fix)


def test_the_plain_bodies_agree_on_many_digits() -> None:
    for name in TAKEN:
        spec, setting = REGISTRY[name], setting_of(name, REGISTRY[name].slopes[0], REGISTRY[name].spaces[0])
        value = spec.bound(setting)(mpmath.mpf(0.25) if spec.coordinate == "cosine" else mpmath.mpf(0.75))
        assert float(value) == pytest.approx(spec.peak, abs=1e-12)
