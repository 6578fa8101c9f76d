"""The fast exact values against fifty digits."""

import mpmath
import numpy as np
import pytest

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT64
from phongbench.formulas.exact import phong_of_cosine, phong_of_deficit, product, truth_kernel
from phongbench.inputs.pairs import pairs
from phongbench.inputs.strata import STRATA


@jit.driver
def call(kernel, deficit, cosine, alpha, angle, given):
    kernel(deficit, cosine, alpha, angle, given)


def fast(deficit, cosine, alpha, half=False):
    angle, given = np.empty_like(deficit), np.empty_like(deficit)
    call(truth_kernel(half), deficit, cosine, np.array([alpha]), angle, given)
    return angle, given


@pytest.mark.parametrize("alpha", [0.01, 1.0, 10.0, 50.0, 200.0, 1000.0, 1e5])
def test_the_fast_truth_is_exact_to_a_few_units_in_the_last_place(alpha):
    reach = min(2.0, 30 / alpha)
    deficit = np.concatenate([np.linspace(0, reach, 300), np.logspace(-18, 0, 100) * min(1, reach), [1.0, 1.5, 2.0]])
    angle, given = fast(deficit, 1 - deficit, alpha)
    with mpmath.workdps(50):
        for d, x, found, other in zip(deficit, 1 - deficit, angle, given, strict=True):
            assert abs(found - mpmath.power(max(0, 1 - mpmath.mpf(d)), alpha)) < 4e-16
            assert abs(other - (mpmath.power(mpmath.mpf(x), alpha) if x > 0 else 0)) < 4e-16


@pytest.mark.parametrize("half", [False, True])
def test_fast_and_slow_truth_agree_on_vectors(half, exact_angle):
    a, b = pairs(STRATA[1], FLOAT64, seed=9, start=0, count=50, scale=1 / 50, half_space=half)
    for scale in (1.0, 1.02):
        x = (scale * a * b).sum(axis=0)
        deficit = ((a - b) ** 2).sum(axis=0) / 2
        angle, given = fast(deficit, x, 50.0, half)
        for i in range(50):
            # the test's own rounding of a.b, raised to the 50th (100th) power, is the tolerance
            with mpmath.workdps(50):
                exact = product([mpmath.mpf(float(c)) for c in scale * a[:, i]], b[:, i].tolist())
                wanted = phong_of_cosine(exact, 50.0, half)
            assert abs(angle[i] - exact_angle(scale * a[:, i], b[:, i], 50.0, half)) < 2e-14
            assert abs(given[i] - wanted) < 5e-14 * max(1, wanted)


def test_in_half_space_nothing_shines_behind_the_normal(exact_angle):
    """N.H = -1 is twice 180 degrees, which is none: the doubled angle would come round to the peak again."""
    deficit = np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    angle, given = fast(deficit, 1 - deficit, 10.0, half=True)
    assert angle[0] == given[0] == 1
    assert (angle[1:] == 0).all()
    assert (given[1:] == 0).all()
    down, up = np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 1.0])
    assert exact_angle(down, up, 10.0, half_space=True) == 0


def test_the_body_is_the_definition():
    with mpmath.workdps(40):
        assert abs(phong_of_deficit(0.2, 10.0) - 0.8**10) < 1e-15


def test_an_undefined_angle_is_nan(exact_angle):
    zero, up = np.zeros(3), np.array([0.0, 0.0, 1.0])
    assert mpmath.isnan(exact_angle(zero, up, 10.0))
    assert mpmath.isnan(exact_angle(np.array([np.inf, 0, 0]), up, 10.0))
    assert phong_of_cosine(product(zero, up), 10.0, half_space=False) == 0
