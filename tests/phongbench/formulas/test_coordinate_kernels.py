"""Compiled loops: they compute what the scalar bodies say, gate where they are told, and compile nothing twice."""

import numpy as np
import pytest

from phongbench.compiler import intrinsics, jit
from phongbench.compiler.lowering import FLOAT32, FLOAT64
from phongbench.errors import InputError
from phongbench.formulas import coordinate_kernels, lambda_forms
from phongbench.formulas.curves import curve
from phongbench.formulas.kernel import evaluate, known_values, table_row
from phongbench.formulas.lambda_forms import deficit_of_angle
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation, Cost, Setting

LYON = REGISTRY["lyon"]
SETTING = Setting(50.0, 8, "taylor")


@jit.driver
def fill(address, a, b, out):
    coordinate_kernels.coordinates_at(address, a)(a, b, out)


def test_a_coordinate_block_holds_every_form_the_cosine_and_the_open_gate():
    rng = np.random.default_rng(3)
    a, b = rng.normal(size=(2, 3, 50))
    out = np.empty((coordinate_kernels.COORDINATE_ROWS, 50))
    fill(jit.address(coordinate_kernels.coordinates_kernel(FLOAT64)), a, b, out)
    for form, row in coordinate_kernels.FORM_ROW.items():
        assert np.allclose(out[row], lambda_forms.LAMBDA_FORMS[form](*a, *b), rtol=1e-13)
    assert np.allclose(out[coordinate_kernels.COSINE_ROW], (a * b).sum(axis=0), rtol=1e-13)
    assert (out[coordinate_kernels.OPEN_ROW] == 1).all()


def test_evaluate_equals_the_scalar_body():
    deficit = np.linspace(0, 0.5, 101)
    body = LYON.bound(SETTING)
    assert np.allclose(evaluate(LYON, SETTING, deficit), [body(float(d)) for d in deficit], rtol=1e-13)


def test_the_gate_closes_where_the_cosine_is_not_positive():
    values = evaluate(LYON, SETTING, np.zeros(4), np.array([1.0, 0.0, -1.0, np.nan]))
    assert values.tolist() == [1.0, 0.0, 0.0, 0.0]


def test_evaluate_refuses_what_the_formula_does_not_take():
    with pytest.raises(InputError, match="not a power of two"):
        evaluate(LYON, Setting(50.0, 6, "taylor"), np.zeros(1))


@pytest.mark.parametrize("form", lambda_forms.LAMBDA_FORMS)
def test_forms_of_an_angle_are_those_of_unit_vectors(form):
    cosine = np.linspace(0.1, 1, 20)
    sine = np.sqrt(1 - cosine**2)
    zero, one = np.zeros(20), np.ones(20)
    on_vectors = lambda_forms.LAMBDA_FORMS[form](zero, zero, one, sine, zero, cosine)
    assert np.allclose(deficit_of_angle(form, cosine), on_vectors, atol=1e-14)


def test_a_curve_of_phong_is_the_power_of_the_cosine():
    cosine = np.linspace(-1, 1, 41)
    assert np.allclose(
        curve(REGISTRY["phong"], "none", Setting(20.0), cosine), np.maximum(cosine, 0) ** 20.0, atol=1e-15
    )


def test_a_curve_in_half_space_stands_at_half_the_angle():
    cosine = np.cos(np.radians([0.0, 10.0, 40.0]))
    found = curve(REGISTRY["blinn"], "none", Setting(16.0, None, "taylor", "half"), cosine)
    assert np.allclose(found, np.cos(np.radians([0.0, 5.0, 20.0])) ** 64, rtol=1e-12)


def test_one_kernel_serves_every_alpha_and_slope():
    first = coordinate_kernels.values_kernel(LYON, FLOAT32, known_values(LYON, SETTING))
    other = Setting(1000.0, 8, "minimax", "half")
    assert coordinate_kernels.values_kernel(LYON, FLOAT32, known_values(LYON, other)) is first


def test_a_table_that_is_too_long_is_refused():
    long = Approximation(
        name="long",
        title="Long",
        kind="approximation",
        formula="a table",
        source=LYON.source,
        kernel=REGISTRY["table-x"].kernel,
        coefficients=lambda s: {},
        domain="",
        cost=Cost(""),
        lambda_forms=("none",),
        table=lambda s: np.zeros(intrinsics.MAX_TABLE + 1),
    )
    with pytest.raises(InputError, match="1025 entries"):
        table_row(long, SETTING, FLOAT32)
