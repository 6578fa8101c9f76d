"""One value for a formula, one parser, one printer: what is printed is read back as the same formula."""

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import RECIPES, Formula
from phongbench.formulas.registry import REGISTRY, example
from phongbench.formulas.spec import Approximation


def every_formula(spec: Approximation) -> list[Formula]:
    """All formulas of an approximation, at three gammas."""
    gammas = (1, 8, 256) if spec.uses_gamma else (None,)
    parts = product(spec.lambda_forms, gammas, spec.slopes, spec.spaces)
    return [Formula(spec.name, *of) for of in parts]


@pytest.mark.parametrize("spec", REGISTRY.values(), ids=list(REGISTRY))
def test_what_is_printed_is_read_back(spec: Approximation) -> None:
    spelled = [(formula, str(formula)) for formula in every_formula(spec)]
    assert len({text for _, text in spelled}) == len(spelled)
    assert all(Formula.parse(text) == formula for formula, text in spelled)


@pytest.mark.parametrize(
    ("text", "formula"),
    [
        ("phong", Formula()),
        ("blinn", Formula("blinn", slope="taylor", space="half")),
        ("lyon:dot:32:minimax", Formula("lyon", "dot", 32, "minimax")),
        ("lyon:cross:8", Formula("lyon", "cross", 8, "taylor")),
        ("lyon:cross:8@half", Formula("lyon", "cross", 8, "taylor", "half")),
        ("gaussian:dot", Formula("gaussian", "dot", None, "taylor")),
        ("lyon:dot:8:6.25", Formula("lyon", "dot", 8, 6.25)),
    ],
)
def test_the_spelling_of_the_contract(text: str, formula: Formula) -> None:
    assert Formula.parse(text) == formula
    assert str(formula) == text


@pytest.mark.parametrize(
    ("text", "formula"),
    [
        ("gaussian", "gaussian:dot"),
        ("lyon::8", "lyon:dot:8"),
        ("lyon:dot:8:taylor", "lyon:dot:8"),
        ("lyon:dot:8@pair", "lyon:dot:8"),
        ("phong:none", "phong"),
        ("blinn@half", "blinn"),
    ],
)
def test_what_goes_without_saying_is_not_printed(text: str, formula: str) -> None:
    assert str(Formula.parse(text)) == formula


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("lyon:8", "unknown lambda form of lyon '8'"),
        ("lyon:dot", "lyon needs a gamma"),
        ("lyon:dot:7", "gamma = 7 is not a power of two"),
        ("lyon:dot:512", "gamma = 512 is outside 1 .. 256"),
        ("lyon:dot:eight", "gamma is not a whole number below a million"),
        ("lyon:dot:8:steep", "unknown beta policy of lyon 'steep'"),
        ("lyon:dot:8:taylor:more", "more parts than lyon takes"),
        ("lyon:dot:8:nan", "slope|beta|finite|number"),
        ("gaussian:dot:8", "gaussian has no slope beta"),
        ("lyon:dot:8@sideways", "unknown recipe 'sideways'"),
        ("blinn@pair", "unknown space of blinn 'reflect'"),
        ("lion:dot:8", "unknown approximation 'lion'"),
        ("", "unknown approximation ''"),
    ],
)
def test_what_is_wrong_is_named(text: str, problem: str) -> None:
    with pytest.raises(InputError, match=problem):
        Formula.parse(text)


@given(st.text(alphabet="lyonphdtcrs:@/0123456789.-e ", max_size=24))
def test_any_text_is_a_formula_or_an_error_of_ours(text: str) -> None:
    try:
        formula = Formula.parse(text)
    except InputError:
        return
    assert Formula.parse(str(formula)) == formula


def test_fields_are_named_as_the_caller_calls_them() -> None:
    with pytest.raises(UnknownNameError) as caught:
        Formula.of("lyon", "sideways", 8, where="specular.")
    assert caught.value.where == "specular.lambda"
    with pytest.raises(InputError) as missing:
        Formula.of("lyon", where="specular.")
    assert missing.value.where == "specular.gamma"


@pytest.mark.parametrize("spec", REGISTRY.values(), ids=list(REGISTRY))
def test_a_formula_and_an_exponent_are_a_setting(spec: Approximation) -> None:
    setting = example(spec)
    formula = Formula(spec.name, spec.lambda_forms[0], setting.gamma, setting.slope, setting.space)
    assert formula.setting(setting.alpha) == setting
    assert formula.spec() is spec
    formula.check(setting.alpha)


def test_a_slope_that_is_a_number_is_the_slope() -> None:
    formula = Formula.parse("lyon:dot:8:6.25")
    assert formula.spec().coefficients(formula.setting(50.0))["beta"] == 6.25
    formula.check(50.0)


def test_rows_of_tables_are_formulas() -> None:
    row = {"approximation": "lyon", "lambda_form": "dot", "gamma": 8.0, "beta_policy": "minimax", "space": "half"}
    assert str(Formula.of_row(row)) == "lyon:dot:8:minimax@half"
    timed = {"approximation": "lyon", "lambda_form": "dot", "gamma": 8.0, "beta_policy": "none", "space": "reflect"}
    assert str(Formula.of_row(timed)) == "lyon:dot:8"


def test_of_a_formula_that_nobody_knows_all_that_is_known_is_printed() -> None:
    assert str(Formula("mine", "dot", 8, "minimax", "half")) == "mine:dot:8:minimax@half"
    assert str(Formula("mine")) == "mine"


def test_every_pair_has_one_recipe() -> None:
    assert len(set(RECIPES.values())) == len(RECIPES)
