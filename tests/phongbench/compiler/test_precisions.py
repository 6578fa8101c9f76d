"""Working precisions: every operation of an emulated one gives the bits that a unit of it would give.

float16 is held against NumPy's; bfloat16 and fixed point, which NumPy lacks, against whole numbers and tables.
"""

import re
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phongbench.compiler import elementary, jit
from phongbench.compiler.lowering import lower
from phongbench.compiler.precisions import BFLOAT16, FLOAT16, FLOAT32, FLOAT64, FixedPoint, in_order, precision_named
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.registry import REGISTRY
from phongbench.testing import over

Q8, Q15 = precision_named("q0.8"), precision_named("q1.15")
LISTED = (FLOAT16, BFLOAT16, Q8, Q15, precision_named("q7.1"))
EMULATED = (*LISTED, precision_named("q3.21"))


def add(a, b):
    return a + b


def subtract(a, b):
    return a - b


def multiply(a, b):
    return a * b


def divide(a, b):
    return a / b


OPERATIONS = (add, subtract, multiply, divide)


def operands(precision, count=64):
    """Every number of a 16-bit format beside sampled ones: the corners of the format, and random bits."""
    rng = np.random.default_rng(7)
    edges = [0.0, -0.0, 1.0, -1.0, precision.smallest, -precision.smallest, precision.tiny, precision.largest]
    edges += [-precision.largest, 1 + precision.eps, 1 - precision.eps / 2, 3.0, 1 / 3, np.inf, -np.inf, np.nan]
    words = np.arange(1 << 16, dtype=np.uint16)
    every = words.view(np.float16) if precision is FLOAT16 else (words.astype(np.uint32) << 16).view(np.float32)
    drawn = np.concatenate([precision.rounded(edges), every[rng.integers(0, 1 << 16, count - len(edges))]])
    a, b = np.meshgrid(every.astype(np.float32), drawn.astype(np.float32))
    return a.ravel(), b.ravel()


def same_bits(found, expected):
    return (found.view(np.uint32) == expected.view(np.uint32)) | (np.isnan(found) & np.isnan(expected))


@pytest.mark.skipif(jit.DISABLED, reason="millions of operations")
@pytest.mark.parametrize("body", OPERATIONS, ids=lambda b: b.__name__)
def test_float16_is_numpys_for_every_number_and_sampled_others(body):
    a, b = operands(FLOAT16)
    with np.errstate(all="ignore"):
        expected = body(a.astype(np.float16), b.astype(np.float16)).astype(np.float32)
    assert same_bits(over(body, FLOAT16, a, b), expected).all()


def nearest_brain_float(exact, rest):
    """By search in the list of all bfloat16 numbers: the one nearest to exact + rest, where |rest| is next to nothing.

    Ties go to the even bits; beyond the last number and half a step lies infinity.
    """
    words = np.arange(0x7F80, dtype=np.uint32) << 16
    numbers = np.append(words.view(np.float32).astype(np.float64), 2.0**128)
    middles = (numbers[1:] + numbers[:-1]) / 2
    size, toward = np.abs(exact), np.where(exact < 0, -rest, rest)
    left, right = np.searchsorted(middles, size, "left"), np.searchsorted(middles, size, "right")
    tie = np.where(toward > 0, right, np.where(toward < 0, left, left + left % 2))
    index = np.where(left == right, left, tie)
    value = np.where(index == len(numbers) - 1, np.inf, numbers[np.minimum(index, len(numbers) - 1)])
    value = np.where(np.isnan(exact), np.nan, np.copysign(value, exact))
    return value.astype(np.float32)


@pytest.mark.skipif(jit.DISABLED, reason="millions of operations")
@pytest.mark.parametrize("body", OPERATIONS, ids=lambda b: b.__name__)
def test_bfloat16_is_the_nearest_of_all_its_numbers(body):
    a, b = operands(BFLOAT16)
    with np.errstate(all="ignore"):
        x, y = a.astype(np.float64), b.astype(np.float64)
        exact = body(x, y)
        if body is multiply:
            rest = np.zeros_like(exact)
        elif body is divide:  # a quotient on a middle has 9 digits, so its product with b is exact
            rest = np.sign((x - exact * y) / y)
        else:  # Knuth's two-sum: what the addition in float64 left out
            y = y if body is add else -y
            part = exact - x
            rest = (x - (exact - part)) + (y - part)
        expected = nearest_brain_float(exact, np.where(np.isfinite(exact), rest, 0.0))
    assert same_bits(over(body, BFLOAT16, a, b), expected).all()


@pytest.mark.skipif(jit.DISABLED, reason="millions of operations")
@pytest.mark.parametrize(
    "precision", [Q8, Q15, precision_named("q2.6"), precision_named("q3.21")], ids=lambda p: p.name
)
@pytest.mark.parametrize("body", OPERATIONS, ids=lambda b: b.__name__)
def test_fixed_point_is_whole_numbers_rounded_and_saturated(body, precision):
    assert isinstance(precision, FixedPoint)
    unit, end = 1 << precision.fraction, 1 << (precision.whole + precision.fraction)
    rng = np.random.default_rng(8)
    a, b = rng.integers(-end, end, (2, 1 << 20))
    corners = np.array([-end, end - 1, 0, 1, -1, min(unit, end - 1), 3, -end // 3])
    left, right = np.meshgrid(corners, corners)
    a, b = np.concatenate([a, left.ravel()]), np.concatenate([b, right.ravel()])
    if body is multiply:
        top, bottom = a * b, np.full_like(a, unit)
    elif body is divide:
        top, bottom = a * unit * np.sign(b), np.abs(b)
    else:
        top, bottom = body(a, b), np.ones_like(a)
    whole, rest = np.divmod(top, np.maximum(bottom, 1))
    up = (2 * rest > bottom) | ((2 * rest == bottom) & (whole % 2 == 1))
    expected = np.clip(whole + up, -end, end - 1)
    if body is divide:  # a / 0 saturates, 0 / 0 is 0
        expected = np.where(b == 0, np.clip(np.sign(a) * 2 * end, -end, end - 1), expected)
    found = over(body, precision, a / unit, b / unit)
    assert np.array_equal(found * unit, expected)


@pytest.mark.parametrize("precision", EMULATED, ids=lambda p: p.name)
def test_arrays_are_rounded_as_compiled_code_rounds(precision):
    rng = np.random.default_rng(9)
    x = np.concatenate([rng.normal(size=2000) * 10.0 ** rng.integers(-9, 9, 2000), [0.0, np.inf, -np.inf, np.nan]])
    x = x.astype(precision.carrier)
    function, more = precision.rounding
    with np.errstate(over="ignore"):
        plain = [function(v, *more) for v in x]
    assert np.array_equal(precision.rounded(x), plain, equal_nan=True)


def test_bfloat16_is_rounded_from_float64_in_one_step():
    """By way of float32 this would be a tie, and go to the even neighbour below."""
    just_above = 1 + 2.0**-8 + 2.0**-40
    assert BFLOAT16.constant(just_above) == np.float32(1 + 2.0**-7)
    assert BFLOAT16.rounded(np.float32(just_above)) == 1


def root(x):
    return elementary.square_root(x)


@pytest.mark.skipif(jit.DISABLED, reason="compiles a kernel of one argument")
def test_a_root_in_float16_is_numpys_for_every_number():
    every = np.arange(1 << 16, dtype=np.uint16).view(np.float16)
    with np.errstate(all="ignore"):
        expected = np.sqrt(every).astype(np.float32)
    assert same_bits(over(root, FLOAT16, every), expected).all()


@pytest.mark.parametrize("precision", LISTED, ids=lambda p: p.name)
def test_representables_are_all_numbers_in_between(precision):
    low, high = max(-1.0, -precision.largest), min(1.0, precision.largest)
    numbers = precision.representables(low, high)
    assert numbers.dtype == precision.carrier
    assert (np.diff(numbers) > 0).all()
    assert numbers[0] == low
    assert numbers[-1] == high
    assert np.array_equal(precision.rounded(numbers), numbers)
    middles = (numbers[1:].astype(np.float64) + numbers[:-1]) / 2  # nothing lies between two neighbours
    assert np.isin(precision.rounded(middles), numbers).all()
    assert not np.signbit(numbers[numbers == 0]).any()


def test_how_many_numbers_a_format_has():
    assert len(FLOAT16.representables(0.5, 1.0)) == 1025
    assert len(BFLOAT16.representables(0.5, 1.0)) == 129
    assert len(Q8.representables(-9, 9)) == 512
    assert len(Q15.representables(0, 1)) == 32769
    assert len(FLOAT16.representables(-np.inf, np.inf)) == 2 * (31 * 1024 + 1) - 1  # infinities and one zero


@pytest.mark.parametrize("precision", [FLOAT32, FLOAT64, precision_named("q1.16")], ids=lambda p: p.name)
def test_wide_formats_are_not_listed(precision):
    with pytest.raises(InputError, match="too many numbers"):
        precision.representables(0.0, 1.0)


@given(whole=st.integers(0, 7), fraction=st.integers(1, 24), x=st.floats(-300, 300))
def test_fixed_point_rounds_to_the_nearest_step_in_range(whole, fraction, x):
    if not 2 <= whole + fraction <= 24:
        return
    precision = precision_named(f"q{whole}.{fraction}")
    step, top = Fraction(1, 2**fraction), Fraction(2**whole)
    near = round(Fraction(x) / step) * step  # Python rounds ties to even
    assert Fraction(float(precision.rounded(x))) == min(max(near, -top), top - step)
    assert (precision.eps, precision.largest) == (float(step), float(top - step))


def test_a_coefficient_of_fixed_point_keeps_its_digits_at_any_size():
    """Hardware gives a coefficient a shift of its own."""
    assert Q8.constant(6.25) == 6.25
    assert Q8.constant(1.0) == 1.0
    assert Q8.rounded(1.0) == 1 - 2.0**-8
    thirds = [float(Q15.constant(2.0**k / 3)) * 3 / 2.0**k for k in (-40, 0, 9)]
    assert len(set(thirds)) == 1
    assert 0 < abs(thirds[0] - 1) < 2.0**-16


def slope(x, beta):
    return -(1.0 - beta * x)


def test_only_results_saturate():
    """6.25 * 0.5 is beyond q0.8: the product saturates just below 1, and 1 - product is one step."""
    lowered = lower(slope, Q8)
    assert lowered(np.float64(0.5), Q8.constant(6.25)) == -Q8.eps
    assert lowered(np.float64(0.125), Q8.constant(6.25)) == -(1 - 0.78125)


def test_a_negative_coefficient_is_not_limited():
    """exp(-50 lambda) needs the factor -50 in a format that ends at 2; the product -50/64 is in range again."""
    value = lower(REGISTRY["gaussian"].kernel, Q15)(np.float64(1 / 64), Q15.constant(50.0))
    assert value == pytest.approx(np.exp(-50 / 64), abs=Q15.eps)


def chosen(x):
    return 1.0 if x > 0.5 else x


def test_what_is_chosen_fits_into_fixed_point():
    assert over(chosen, Q8, [0.75, 0.25]).tolist() == [Q8.largest, 0.25]


def test_names_are_parsed_and_ordered():
    assert precision_named("q1.15") is Q15
    assert in_order(["float32", "q1.15", "bfloat16", "q0.8", "float32"]) == ("q0.8", "q1.15", "bfloat16", "float32")


@pytest.mark.parametrize("name", ["q8.8", "q0.25", "q1.24", "q3.0", "q0.1", "q99.9999"])
def test_a_width_out_of_range_is_refused_with_the_range(name):
    with pytest.raises(InputError, match="out of range") as refusal:
        precision_named(name)
    assert name in refusal.value.what
    assert "q1.15" in (refusal.value.fix or "")


@pytest.mark.parametrize("name", ["float8", "q1", "q1.15.2", "Q1.15", "q-1.3", ""])
def test_an_unknown_precision_lists_the_known_ones(name):
    with pytest.raises(UnknownNameError, match=re.escape("qI.F")):
        precision_named(name)
