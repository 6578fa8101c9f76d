"""What numbers, colours and directions may be."""

import math

import pytest

from phongbench.errors import InputError
from phongbench.support.values import colour, direction, number


def test_a_colour_may_be_black_or_brighter_than_white_and_not_negative() -> None:
    assert colour([0, 0, 0], "c") == (0, 0, 0)
    assert colour([0, 2.5, 1], "c") == (0, 2.5, 1)
    with pytest.raises(InputError, match="cannot be negative"):
        colour([1, 1, -1e-9], "c")


@pytest.mark.parametrize(("value", "low"), [(0, 0.0), (1e-300, 0.0), (-3.0, -3.0)])
def test_a_number_may_be_its_lowest(value: float, low: float) -> None:
    assert number(value, "x", low) == value


def test_a_number_is_one_from_0_up_where_nothing_else_is_said() -> None:
    assert (number(0, "x"), number(0.5, "x")) == (0.0, 0.5)


@pytest.mark.parametrize("value", [-1e-9, math.nan, math.inf, "1", None, [1]])
def test_what_is_no_number_from_0_up_is_refused(value: object) -> None:
    with pytest.raises(InputError, match=r"not a (finite )?number"):
        number(value, "x")


@pytest.mark.parametrize("scale", [1e-300, 1e-3, 1.0, 1e300])
def test_a_direction_has_length_one_whatever_its_own(scale: float) -> None:
    assert direction([2 * scale, -3 * scale, 6 * scale], "d") == pytest.approx((2 / 7, -3 / 7, 6 / 7), rel=1e-15)


def test_zero_is_no_direction() -> None:
    with pytest.raises(InputError, match="cannot be 0"):
        direction([0, 0.0, -0.0], "d")
