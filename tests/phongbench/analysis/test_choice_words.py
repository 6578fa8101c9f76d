"""An answer as plain data."""

from typing import Any

import pytest

from phongbench.analysis.choice import Choice
from phongbench.analysis.choice_words import answered, plain
from phongbench.analysis.error_budget import Budget
from phongbench.formulas.formula import Formula

LYON = Formula.parse("lyon:dot:8")
CELL: dict[str, Any] = {"approximation": "lyon", "lambda_form": "dot", "gamma": 8, "beta_policy": "taylor"}
CELL |= {"space": "reflect", "error": 0.01, "bound": 0.02, "coverage": "certified", "error_coverage": "sampled"}
CELL |= {"samples": 100, "ns": 1.0, "ratio": 0.5, "ratio_low": 0.4, "ratio_high": 0.6}


@pytest.mark.parametrize(("alpha", "beta"), [("50", 50 / 8), ("20", 20 / 8), ("20,50", None), ("20..50", None)])
def test_a_slope_has_a_value_at_a_single_exponent(alpha: str, beta: float | None) -> None:
    told = plain(CELL, Budget.of(alpha, 0.1))
    assert (told["name"], told["beta"]) == (str(LYON), beta)


def test_an_error_is_told_in_codes_of_an_8_bit_display_too() -> None:
    assert plain(CELL, Budget.of("50", 0.1))["codes_8bit"] == pytest.approx(2.55)


def test_nothing_chosen_is_an_answer_too() -> None:
    answer = answered(Choice(None, None, resolved=False, nearest_miss=None), Budget.of("50", 0.1))
    assert answer == {"choices": [], "nearest_miss": None, "verdict": "nothing meets the budget"}
