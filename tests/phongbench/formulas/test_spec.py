"""SPEC: what an approximation says of itself is checked when it is made, and settings when they are used."""

from dataclasses import replace
from typing import Any

import pytest

from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.registry import get
from phongbench.formulas.spec import Approximation, Setting


@pytest.mark.parametrize(("gamma", "n"), [(1, 0), (2, 1), (8, 3), (256, 8)])
def test_n_is_the_number_of_squarings(gamma: int, n: int) -> None:
    assert Setting(10.0, gamma).n == n


def test_a_setting_without_gamma_has_no_squarings() -> None:
    with pytest.raises(InputError, match="needs a gamma"):
        _ = Setting(10.0).n


def test_half_space_asks_for_four_times_the_exponent() -> None:
    assert Setting(10.0).exponent == 10
    assert Setting(10.0, space="half").exponent == 40


@pytest.mark.parametrize(
    ("name", "setting", "message"),
    [
        ("phong", Setting(5e-4), "alpha = 0.0005 is outside 0.001 .. 100000"),
        ("kuijk-blake", Setting(0.0), "alpha = 0.0 is outside 1 .. 64"),
        ("doom3", Setting(0.0, space="half"), "does not take alpha = 0: its lobe is the same"),
        ("phong", Setting(-1.0), "alpha = -1.0 is outside"),
        ("phong", Setting(float("nan")), "alpha = nan is outside"),
        ("phong", Setting(float("inf")), "alpha = inf is outside"),
        ("lyon", Setting(10.0, slope="taylor"), "needs a gamma"),
        ("lyon", Setting(10.0, 6, "taylor"), "gamma = 6 is not a power of two"),
        ("lyon", Setting(10.0, 512, "taylor"), "gamma = 512 is outside 1 .. 256"),
        ("lyon", Setting(10.0, 8, "steep"), r"(?s)unknown beta policy 'steep'.*known: taylor, minimax, energy"),
        ("lyon", Setting(10.0, 8, "taylor", "whole"), r"(?s)unknown space 'whole'.*known: reflect, half"),
        ("gaussian", Setting(10.0, None, "taylor", "half"), "unknown space 'half'"),
        ("integer-power", Setting(10.5), "does not take alpha = 10.5"),
        ("kuijk-blake", Setting(65.0), "alpha = 65.0 is outside 1 .. 64"),
        ("lyon-quadratic", Setting(0.5, 8), "does not take alpha = 0.5"),
    ],
)
def test_a_setting_that_makes_no_sense_is_refused_with_value_and_range(
    name: str, setting: Setting, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        get(name).check(setting)


def first_argument_is_wrong(angle: float) -> float:
    return angle


def too_many(cosine_deficit: float, a: float, b: float, c: float, d: float, e: float) -> float:
    return cosine_deficit * a * b * c * d * e


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"kernel": first_argument_is_wrong}, "must take cosine or cosine_deficit first"),
        ({"kernel": too_many}, "at most 4 coefficients"),
        ({"lambda_forms": ("none",)}, "a kernel of the cosine has lambda_forms"),
        ({"lambda_forms": ("sideways",)}, "unknown lambda form 'sideways'"),
    ],
)
def test_an_impossible_specification_is_refused_when_it_is_made(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        replace(get("lyon"), **changes)


def test_coefficients_are_told_from_what_is_known_and_from_tables() -> None:
    assert (get("lyon").scalars, get("lyon").knowns) == (("beta",), ("n",))
    assert (get("table-u").scalars, get("table-u").knowns) == (("scale", "bend"), ())
    assert (get("integer-power").scalars, get("integer-power").knowns) == ((), ("exponent",))


def test_a_bound_body_is_a_function_of_its_coordinate() -> None:
    assert get("lyon").bound(Setting(16.0, 8, "taylor"))(0.25) == 0.5**8
    assert get("phong").bound(Setting(3.0))(0.5) == 0.125


def test_get_names_the_nearest_known_approximation() -> None:
    with pytest.raises(UnknownNameError, match=r"(?s)unknown approximation 'lion'.*did you mean 'lyon'.*known: phong"):
        get("lion")


def test_every_coordinate_is_one_of_two() -> None:
    def coordinate(spec: Approximation) -> str:
        return spec.coordinate

    assert coordinate(get("phong")) == "cosine"
    assert coordinate(get("lyon")) == "cosine_deficit"
