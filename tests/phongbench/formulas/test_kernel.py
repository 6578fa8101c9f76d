"""A kernel is its loop with all that it takes: both shapes give what the plain body gives."""

import numpy as np
import pytest

from phongbench.compiler.lowering import FLOAT32, FLOAT64
from phongbench.formulas import lambda_forms
from phongbench.formulas.kernel import Kernel
from phongbench.formulas.registry import REGISTRY, example
from phongbench.formulas.spec import Approximation


@pytest.mark.parametrize("spec", REGISTRY.values(), ids=list(REGISTRY))
def test_both_shapes_give_the_plain_bodys_values(spec: Approximation) -> None:
    setting, form = example(spec), spec.lambda_forms[0]
    angle = np.linspace(0.0, 1.5, 33)
    a = np.repeat([[0.6], [0.0], [0.8]], angle.size, axis=1)
    b = np.array([[0.6], [0.0], [0.8]]) * np.cos(angle) + np.array([[0.8], [0.0], [-0.6]]) * np.sin(angle)
    cosine = lambda_forms.dot(*a, *b)
    coordinate = cosine if form == "none" else lambda_forms.LAMBDA_FORMS[form](*a, *b)
    plain = np.array([float(spec.bound(setting)(float(x))) for x in coordinate])
    values = Kernel.of(spec, setting, FLOAT64).values(np.ascontiguousarray(coordinate), np.ascontiguousarray(cosine))
    out = np.empty(angle.size)
    Kernel.of_pairs(spec, form, setting, FLOAT64).fill_pairs(a, np.ascontiguousarray(b), out)
    assert np.allclose(values, plain, rtol=1e-9, atol=1e-9)
    assert np.allclose(out, plain, rtol=1e-9, atol=1e-9)


def test_it_is_dark_where_the_gate_is_not_positive() -> None:
    spec = REGISTRY["lyon"]
    kernel = Kernel.of(spec, example(spec), FLOAT32)
    peak, gate = np.zeros(4, np.float32), np.array([1.0, 0.0, -1.0, np.nan], np.float32)
    assert kernel.values(peak, gate).tolist() == [1.0, 0.0, 0.0, 0.0]


def test_one_loop_serves_every_exponent() -> None:
    spec = REGISTRY["lyon"]
    one, other = (Kernel.of(spec, s, FLOAT32) for s in (example(spec), example(spec)))
    assert one.address == other.address
