"""The lambda forms: what they equal on unit vectors, and what they see of lengths and signs."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phongbench.compiler.lowering import FLOAT16, FLOAT32, FLOAT64
from phongbench.formulas import lambda_forms
from phongbench.testing import over

Six = tuple[float, float, float, float, float, float]

angles = st.floats(-math.pi, math.pi)


@st.composite
def pairs(draw: st.DrawFn) -> Six:
    """Two unit vectors."""
    both = []
    for _ in range(2):
        polar, azimuth = draw(angles), draw(angles)
        both += [math.sin(polar) * math.cos(azimuth), math.sin(polar) * math.sin(azimuth), math.cos(polar)]
    return (both[0], both[1], both[2], both[3], both[4], both[5])


@given(pairs())
def test_on_unit_vectors_difference_equals_dot(pair: Six) -> None:
    assert lambda_forms.half_squared_difference(*pair) == pytest.approx(lambda_forms.dot_deficit(*pair), abs=1e-15)


@given(pairs())
def test_on_unit_vectors_cross_is_lambda_minus_half_its_square(pair: Six) -> None:
    deficit = lambda_forms.dot_deficit(*pair)
    assert lambda_forms.half_squared_cross(*pair) == pytest.approx(deficit - deficit**2 / 2, abs=2e-15)


@given(pairs())
def test_dot_and_cross_are_cosine_and_sine(pair: Six) -> None:
    assert lambda_forms.dot(*pair) ** 2 + lambda_forms.squared_cross(*pair) == pytest.approx(1, abs=1e-14)


@given(pairs(), st.floats(0.1, 10), st.floats(0.1, 10))
def test_tan2_does_not_see_lengths(pair: Six, first: float, second: float) -> None:
    if abs(lambda_forms.dot(*pair)) < 1e-3:
        return
    stretched = [first * v for v in pair[:3]] + [second * v for v in pair[3:]]
    assert lambda_forms.half_squared_tangent(*stretched) == pytest.approx(
        lambda_forms.half_squared_tangent(*pair), rel=1e-9, abs=1e-12
    )


@given(pairs())
def test_cross_and_tan2_do_not_see_the_sign(pair: Six) -> None:
    opposite = (*pair[:3], -pair[3], -pair[4], -pair[5])
    assert lambda_forms.half_squared_cross(*opposite) == lambda_forms.half_squared_cross(*pair)
    assert lambda_forms.dot(*opposite) == -lambda_forms.dot(*pair)


@pytest.mark.parametrize("form", lambda_forms.LAMBDA_FORMS)
@given(pair=pairs())
def test_a_form_does_not_care_which_direction_comes_first(form: str, pair: Six) -> None:
    swapped = (*pair[3:], *pair[:3])
    body = lambda_forms.LAMBDA_FORMS[form]
    if form != "tan2" or lambda_forms.dot(*pair):
        assert body(*swapped) == pytest.approx(body(*pair), rel=1e-12, abs=1e-15)


@given(pairs(), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_law_8_lengths_change_each_form_as_derived(pair: Six, e: float, d: float) -> None:
    s, deficit = (1 + e) * (1 + d), lambda_forms.dot_deficit(*pair)
    long = [(1 + e) * v for v in pair[:3]] + [(1 + d) * v for v in pair[3:]]
    assert lambda_forms.dot_deficit(*long) == pytest.approx((1 - s) + s * deficit, abs=1e-14)
    assert lambda_forms.half_squared_difference(*long) == pytest.approx(s * deficit + (e - d) ** 2 / 2, abs=1e-14)
    assert lambda_forms.half_squared_cross(*long) == pytest.approx(
        s**2 * lambda_forms.half_squared_cross(*pair), abs=1e-14
    )


def test_difference_and_cross_keep_relative_accuracy_next_to_the_peak_and_dot_does_not() -> None:
    angle = np.geomspace(1e-3, 1e-1, 200)
    columns = [np.float32(c) for c in (0.0, 0.0, 1.0)] + [np.sin(angle), np.zeros_like(angle), np.cos(angle)]
    given_columns = [np.asarray(c, np.float32).astype(float) for c in columns]
    for form, bound in (("difference", 1e-6), ("cross", 1e-6)):
        exact = lambda_forms.LAMBDA_FORMS[form](*given_columns)
        assert np.abs(over(lambda_forms.LAMBDA_FORMS[form], FLOAT32, *columns) / exact - 1).max() < bound
    assert np.abs(over(lambda_forms.dot_deficit, FLOAT32, *columns) / (1 - np.cos(angle)) - 1).max() > 1e-3


@pytest.mark.parametrize("form", lambda_forms.LAMBDA_FORMS)
def test_a_compiled_form_is_the_plain_one_in_its_precision(form: str) -> None:
    rng = np.random.default_rng(2)
    body, columns = lambda_forms.LAMBDA_FORMS[form], rng.normal(size=(6, 300))
    with mpmath.workdps(50):
        exact = np.array([float(body(*map(mpmath.mpf, row))) for row in columns.T.tolist()])
    assert over(body, FLOAT64, *columns) == pytest.approx(exact, rel=1e-12, abs=1e-14)
    half = columns.astype(np.float16)
    with np.errstate(all="ignore"):
        stepped = np.array([body(*row) for row in half.T])
    assert np.array_equal(over(body, FLOAT16, *half), stepped.astype(np.float32), equal_nan=True)
