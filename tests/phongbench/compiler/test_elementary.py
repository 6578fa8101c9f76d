"""Powers keep the accuracy that their module promises, and stop where they say."""

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phongbench.compiler import elementary
from phongbench.compiler.lowering import FLOAT16, FLOAT32, FLOAT64, PRECISIONS, Precision
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Setting
from phongbench.testing import compiled, over

ALPHAS = (1e-3, 0.5, 1.0, 2.2, 10.0, 50.0, 200.0, 1000.0, 1e4, 1e5)
#: dense where highlights live, next to 1, and spread below
NEAR_ONE = np.concatenate([1 - np.geomspace(1e-9, 0.3, 6000), np.linspace(1e-6, 1, 6001), np.geomspace(1e-30, 1, 500)])


# a primitive is lowered where a body calls it


def power(x: float, y: float) -> float:
    return elementary.power(x, y)


def exp2(t: float) -> float:
    return elementary.exp2(t)


def exponential(x: float) -> float:
    return elementary.exponential(x)


def arc_cosine(x: float) -> float:
    return elementary.arc_cosine(x)


def linear_log2(x: float) -> float:
    return elementary.linear_log2(x)


def linear_exp2(t: float) -> float:
    return elementary.linear_exp2(t)


def square_root(x: float) -> float:
    return elementary.square_root(x)


@pytest.mark.parametrize("alpha", ALPHAS)
@pytest.mark.parametrize(("precision", "bound"), [(FLOAT32, 1e-6), (FLOAT64, 1e-13)], ids=["float32", "float64"])
def test_power_is_within_its_bound_of_the_library_power(precision: Precision, bound: float, alpha: float) -> None:
    x = NEAR_ONE.astype(precision.dtype)
    y = float(precision.constant(alpha))
    assert np.abs(over(power, precision, x, y) - x.astype(float) ** y).max() <= bound


@pytest.mark.parametrize("alpha", ALPHAS)
def test_power_in_float64_is_within_its_bound_of_fifty_digits(alpha: float) -> None:
    x = NEAR_ONE[::40]
    with mpmath.workdps(50):
        exact = np.array([float(elementary.power(mpmath.mpf(v), mpmath.mpf(alpha))) for v in x])
    assert np.abs(over(power, FLOAT64, x, alpha) - exact).max() <= 1e-13


@pytest.mark.parametrize("precision", PRECISIONS.values(), ids=PRECISIONS)
def test_power_of_anything_but_a_positive_number_is_zero(precision: Precision) -> None:
    x = np.array([0.0, -0.0, -1.0, -0.5, math.nan, -math.inf])
    assert not over(power, precision, x, 10.0).any()
    assert not over(power, precision, x, 0.0).any()
    assert elementary.power(math.nan, 2.0) == elementary.power(0.0, 0.0) == 0.0


@pytest.mark.parametrize(("precision", "bound"), [(FLOAT32, 3e-7), (FLOAT64, 1e-15)], ids=["float32", "float64"])
def test_exp2_has_a_small_relative_error(precision: Precision, bound: float) -> None:
    t = np.linspace(-120, 120, 20_001).astype(precision.dtype)
    exact = np.exp2(t.astype(float))
    assert np.abs(over(exp2, precision, t) / exact - 1).max() <= bound


def test_exponential_of_minus_infinity_is_zero_in_every_precision() -> None:
    for precision in PRECISIONS.values():
        assert over(exponential, precision, [-math.inf, -1e4])[0] == 0


@pytest.mark.parametrize("n", range(9))
@pytest.mark.parametrize("precision", [FLOAT32, FLOAT64], ids=["float32", "float64"])
def test_squared_is_zero_exactly_where_the_power_falls_below_2_to_the_minus_120(precision: Precision, n: int) -> None:
    edge = 2.0 ** (-120 / 2**n)
    x = np.array([0.0, edge * (1 - 1e-6), edge * (1 + 1e-6), 1.0])
    found = over(elementary.squared, precision, x, n=n)
    assert (found == 0).tolist() == [True, True, False, False]
    assert np.abs(found - x ** (2.0**n)).max() < 1e-36 + 2.0**n * 4 * float(np.finfo(precision.dtype).eps)


@given(x=st.fractions(0, 1, max_denominator=50), n=st.integers(0, 6))
def test_squared_is_the_power_of_two_to_the_n(x: Fraction, n: int) -> None:
    expected = x ** (2**n)
    assert elementary.squared(x, n) in (expected, 0)
    assert abs(elementary.squared(x, n) - expected) <= 2.0**-120


@given(x=st.fractions(-2, 2, max_denominator=20), exponent=st.integers(1, 300))
def test_whole_power_is_the_power_in_exact_arithmetic(x: Fraction, exponent: int) -> None:
    assert elementary.whole_power(x, exponent) == x**exponent


@given(exponent=st.integers(1, 4096))
def test_whole_power_takes_a_squaring_a_bit_and_a_product_a_set_bit(exponent: int) -> None:
    class Counted(int):
        products = 0

        def __mul__(self, other: int) -> "Counted":
            Counted.products += 1
            return Counted(1)

    elementary.whole_power(Counted(1), exponent)
    assert Counted.products == exponent.bit_length() - 1 + exponent.bit_count() - 1


@pytest.mark.parametrize(("precision", "bound"), [(FLOAT32, 3e-7), (FLOAT64, 5e-15)], ids=["float32", "float64"])
def test_arc_cosine_is_within_its_bound(precision: Precision, bound: float) -> None:
    near = np.geomspace(1e-12, 1, 400)
    x = np.concatenate([np.linspace(-1, 1, 801), 1 - near, near - 1]).astype(precision.dtype)
    with mpmath.workdps(40):
        exact = [elementary.arc_cosine(mpmath.mpf(float(v))) for v in x]
        errors = [
            abs(float(mpmath.mpf(float(f)) - e)) for f, e in zip(over(arc_cosine, precision, x), exact, strict=True)
        ]
    assert max(errors) <= bound


def test_arc_cosine_takes_the_nearest_end_outside_and_pi_for_nan() -> None:
    x, expected = [1.0, 1.5, math.inf, -1.0, -7.0, math.nan], [0, 0, 0, math.pi, math.pi, math.pi]
    for precision in PRECISIONS.values():
        assert over(arc_cosine, precision, x) == pytest.approx(expected, abs=1e-3)
    assert [float(elementary.arc_cosine(v)) for v in x] == pytest.approx(expected)


@pytest.mark.parametrize("precision", [FLOAT32, FLOAT64], ids=["float32", "float64"])
def test_the_linear_logarithm_is_exact_at_powers_of_two_and_straight_between(precision: Precision) -> None:
    x = np.array([0.25, 0.3125, 0.375, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0])
    expected = [-2.0, -1.75, -1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5]
    assert over(linear_log2, precision, x).tolist() == expected
    assert over(linear_exp2, precision, expected).tolist() == x.tolist()
    assert [elementary.linear_log2(v) for v in x.tolist()] == expected
    assert [elementary.linear_exp2(v) for v in expected] == x.tolist()


def test_the_linear_exponential_is_zero_where_it_would_be_subnormal_and_finite_where_huge() -> None:
    assert over(linear_exp2, FLOAT32, [-127.0, -1e30, -math.inf]).tolist() == [0, 0, 0]
    assert np.isfinite(over(linear_exp2, FLOAT32, [1e30, math.inf, math.nan])).all()


def test_square_root_is_correctly_rounded() -> None:
    x = np.random.default_rng(1).random(10_000)
    assert np.array_equal(over(square_root, FLOAT64, x), np.sqrt(x))
    single, half = x.astype(np.float32), x.astype(np.float16)
    assert np.array_equal(over(square_root, FLOAT32, single), np.sqrt(single))
    assert np.array_equal(over(square_root, FLOAT16, half), np.sqrt(half).astype(np.float32))


def test_interpolation_meets_the_entries_and_stays_inside_the_table() -> None:
    table = np.array([1.0, 4.0, 2.0, 0.0])
    assert [elementary.interpolated(table, p) for p in (0.0, 1.0, 2.0, 3.0)] == table.tolist()
    assert elementary.interpolated(table, 1.5) == 3.0
    assert [elementary.interpolated(table, p) for p in (-1.0, 99.0, math.inf, math.nan)] == [1.0, 0.0, 0.0, 1.0]


def test_nan_becomes_zero_or_the_low_end() -> None:
    assert elementary.positive_part(math.nan) == 0
    assert elementary.clamped(math.nan, 2.0, 3.0) == 2
    assert [elementary.clamped(x, 2.0, 3.0) for x in (1.0, 2.5, 4.0)] == [2, 2.5, 3]


@pytest.mark.parametrize("alpha", [1.0, 50.0, 1000.0, 1e5])
def test_the_float32_power_is_within_its_bound_for_every_cosine_from_a_half_to_one(alpha: float) -> None:
    """All 8,388,609 float32 numbers of [0.5, 1]."""
    first, last = (int(np.float32(x).view(np.int32)) for x in (0.5, 1.0))
    every = np.arange(first, last + 1, dtype=np.int32).view(np.float32)
    found = compiled(REGISTRY["phong"], Setting(alpha), FLOAT32, every)
    assert len(every) == 8_388_609
    assert np.abs(found - every.astype(np.float64) ** alpha).max() <= 1e-6
