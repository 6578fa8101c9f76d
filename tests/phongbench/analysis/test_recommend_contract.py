"""The budget answer by contract: what is within is so on every conforming device, and says what it rests on."""

from collections.abc import Callable

import pytest

import phongbench as pb
from phongbench.analysis.error_budget import Budget
from phongbench.analysis.promises import bound_at, contract_at, promise, promise_half, promise_raw
from phongbench.analysis.ready_code import ready_code
from phongbench.analysis.recommend import recommend
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.formulas.shader_code.export import Options
from phongbench.results.runs import Run

Stored = Callable[..., Run]


def test_what_is_within_is_so_on_every_device_and_says_where(stored: Stored) -> None:
    run = stored()
    here, everywhere = (recommend(run, alpha=50, max_error=0.05, contract=asked) for asked in (False, True))
    assert (here["contract"], everywhere["contract"]) == (False, True)
    best = everywhere["choices"][0]
    assert best["name"] == here["choices"][0]["name"] == "lyon:dot:8"
    assert best["coverage"] == "contract"
    assert best["max_abs"] <= here["choices"][0]["bound"] <= best["bound"] <= 0.05
    assert "on every device that keeps the accuracies of WGSL and Vulkan, proven" in best["why"]
    assert "phongbench shader" in everywhere["notes"][-1]
    assert "v * inversesqrt(v.v)" in everywhere["notes"][-1]


def test_a_power_that_is_exact_here_is_not_so_on_every_device(stored: Stored) -> None:
    """Its logarithm may err by 2^-21, fifty times: a budget below that is not met by contract."""
    run, budget = stored(), {"alpha": 50, "max_error": 6e-5}
    assert "phong" in {choice["name"] for choice in recommend(run, **budget)["choices"]}
    answer = recommend(run, **budget, contract=True)
    assert "phong" not in {choice["name"] for choice in answer["choices"]}
    assert contract_at(Formula.of("phong"), 50.0) > 6e-5  # type: ignore[operator]


def test_without_a_run_formulas_with_laws_are_judged_by_contract() -> None:
    answer = recommend(None, alpha=50.5, max_error="1/255", contract=True)
    best = answer["choices"][0]
    assert (answer["basis"], best["coverage"], best["error_coverage"]) == ("laws", "contract", "law")
    assert best["bound"] <= 1 / 255
    assert best["samples"] is None
    assert "the laws' bound" in best["why"]


def test_python_asks_the_same_question() -> None:
    table = pb.recommend(alpha=50.5, max_error="1/255", contract=True)
    assert set(table["coverage"]) == {"contract"}


def test_a_range_is_proven_at_some_exponents_and_says_so(stored: Stored) -> None:
    answer = recommend(stored(), alpha="40..50", max_error=0.05, contract=True)
    assert "exponents of the range" in answer["choices"][0]["why"]


@pytest.mark.parametrize("precision", ["float64", "bfloat16", "q1.15"])
def test_a_precision_that_no_standard_speaks_of_is_refused(precision: str) -> None:
    with pytest.raises(InputError, match=f"state no accuracies of {precision}"):
        Budget.of(50, 0.01, precision=precision, contract=True)


@pytest.mark.parametrize("spelling", ["phong", "lyon:dot:32", "lyon:cross:8", "gaussian:dot", "kuijk-blake"])
def test_coverages_are_in_order(spelling: str) -> None:
    """certified <= contract in float32: what runs here is one of the devices, but for the sharpness of both."""
    formula = Formula.parse(spelling)
    here, everywhere = bound_at(formula, 50.0), contract_at(formula, 50.0, limited=False)
    assert here is not None
    assert everywhere is not None
    assert here <= 1.01 * everywhere + 5e-7


@pytest.mark.parametrize("spelling", ["phong@reflect/each", "lyon:dot:32@lengthwise/once", "lyon:cross:8/each"])
def test_raw_vectors_are_bounded_with_their_recipe(spelling: str) -> None:
    """Never better than what is proven of the pair alone; in float16 squares leave the range."""
    formula = Formula.parse(spelling)
    budget = Budget.of(50, 1.0, contract=True)
    kept = promise_raw(formula, budget)
    assert kept.coverage == "contract"
    pair = Formula.parse(spelling.partition("@")[0].partition("/")[0])
    assert 0.5 * promise(pair, budget).bound < kept.bound < 1.0
    assert not promise_raw(formula, Budget.of(50, 1.0, precision="float16", contract=True)).kept


def test_what_nothing_limits_is_not_promised() -> None:
    assert contract_at(Formula.parse("gaussian:tan2"), 50.0, limited=False) is None
    assert contract_at(Formula.parse("phong/fast"), 50.0) is None
    assert not promise(Formula.parse("phong/estimate"), Budget.of(50, 1.0, contract=True)).kept


@pytest.mark.parametrize(
    ("spelling", "precision", "said"),
    [
        ("lyon:tan2:8", "float32", ["divides by the squared cosine", "up to 80 degrees between directions it errs by"]),
        ("blinn@halfway/once", "float32", ["opposite; on coplanar vectors up to 80 degrees of incidence it errs by"]),
        ("phong/each", "float16", ["leave the range of float16"]),
    ],
)
def test_code_without_a_bound_says_why(spelling: str, precision: str, said: list[str]) -> None:
    code = ready_code(Formula.parse(spelling), 50.0, Options(precision=precision))
    assert code.contract is None
    assert "no bound holds on every device" in code.text
    assert all(words in code.text for words in said)


@pytest.mark.parametrize(
    ("spelling", "where"),
    [
        ("phong/once", "on vectors of lengths from 0.001 to 1000, "),
        ("blinn", "on coplanar directions, "),
        ("phong", ""),
    ],
)
def test_code_says_where_its_bound_holds(spelling: str, where: str) -> None:
    code = ready_code(Formula.parse(spelling), 50.0)
    assert f"errs by at most {code.contract:.3g} {where}on devices that are as accurate" in code.text
    assert "no bound holds" not in code.text


def test_of_half_vectors_no_less_than_everything_is_promised_over_all_configurations() -> None:
    kept = promise_half(Formula.parse("lyon:dot:8@half"), Budget.of(50, 1.0, space="half", contract=True))
    assert (kept.coverage, kept.kept) == ("contract", True)
    assert 1.0 < kept.bound < 1.05
    assert not promise_half(Formula.parse("lyon:tan2:8@half"), Budget.of(50, 1.0, space="half", contract=True)).kept
