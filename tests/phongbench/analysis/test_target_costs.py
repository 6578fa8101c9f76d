"""Answers for the chip that a formula ships to: errors of a run, or of the laws, with costs that a compiler counted."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from click.testing import CliRunner

from phongbench.analysis.front import points
from phongbench.analysis.recommend import elsewhere, recommend
from phongbench.cli.main import main
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import Formula
from phongbench.inputs.plan import Plan
from phongbench.results.runs import Run
from phongbench.targets.chips import TARGETS
from phongbench.targets.costs import shipped

Stored = Callable[..., Run]
QUESTION: dict[str, Any] = {"alpha": 50, "max_error": "1/100"}


@pytest.fixture(scope="module")
def rows(small_plan: Plan, swept: Callable[[Plan], pd.DataFrame]) -> pd.DataFrame:
    """Rows of the formulas that compete for a hundredth at alpha 50."""
    more = {"gammas": (8, 16), "slopes": ("taylor", "minimax"), "precisions": ("float32",), "strata": ("highlight",)}
    return swept(replace(small_plan, alphas=(50.0,), **more).validated())


@pytest.fixture
def run(stored: Stored, rows: pd.DataFrame) -> Run:
    """A run that was not timed: a target's costs need no times."""
    return stored(accuracy=rows, timed=False)


def test_where_exponentials_are_cheap_the_gaussian_is_chosen_and_elsewhere_squarings(run: Run) -> None:
    assert recommend(run, **QUESTION, target="rdna2")["choices"][0]["approximation"] == "gaussian"
    assert recommend(run, **QUESTION, target="gcn4")["choices"][0]["name"] == "lyon:dot:16:minimax"


@pytest.mark.parametrize("target", TARGETS)
def test_a_choice_is_within_the_budget_and_nothing_cheaper_is(run: Run, target: str) -> None:
    answer = recommend(run, **QUESTION, target=target)
    best, table = answer["choices"][0], shipped(target)
    assert answer["target"] == best["target"] == target
    assert (best["unit"], best["cost_kind"]) == (table.target.unit, "compiled")
    assert best["bound"] <= 0.01
    cost = table.known_of(Formula.parse(best["name"]), 50.0)
    assert cost is not None
    assert (best["cost"], best["ratio"]) == (cost.cost, table.ratio(cost))
    assert best["ratio_low"] == best["ratio"] == best["ratio_high"]
    front = points(run, alpha=50, target=target)["points"]
    assert min(p["cost"] for p in front if p["error"] <= 0.009) >= best["cost"]
    assert f"on {target}" in best["why"]


@pytest.mark.parametrize("target", TARGETS)
def test_on_a_front_nothing_is_unresolved_and_nothing_on_it_is_beaten(run: Run, target: str) -> None:
    shown = points(run, alpha=50, target=target)["points"]
    assert {p["state"] for p in shown} == {"on", "off"}
    for one in shown:
        rivals = [p for p in shown if p is not one and p["error"] <= one["error"] and p["cost"] <= one["cost"]]
        beaten = any((p["error"], p["cost"]) != (one["error"], one["cost"]) for p in rivals)
        assert (one["state"] == "off") == beaten


def test_a_shader_short_of_special_units_gets_squarings(run: Run) -> None:
    answer = recommend(run, **QUESTION, target="rdna2", short_of="special")
    best, following = answer["choices"]
    assert best["cost"] == 0
    assert best["bound_by"] == "special"
    chain = {one["name"]: shipped("rdna2").known_of(Formula.parse(one["name"]), 50.0) for one in (best, following)}
    assert chain[best["name"]].cost <= chain[following["name"]].cost


def test_without_a_run_the_laws_and_the_compiler_answer() -> None:
    answer = recommend(None, **QUESTION, target="rdna2")
    assert answer["basis"] == "laws"
    assert answer["choices"][0]["name"] == "gaussian:dot"
    assert answer["choices"][0]["cost_kind"] == "compiled"
    assert recommend(None, **QUESTION)["choices"][0]["cost_kind"] == "counted"


def test_other_targets_are_told_where_they_answer_otherwise(run: Run) -> None:
    here = recommend(run, **QUESTION, target="gcn4")
    others = {one["target"]: one["name"] for one in elsewhere(run, here, **QUESTION)}
    assert "gcn4" not in others
    assert others["rdna2"].startswith("gaussian")


def test_an_own_formula_is_left_out_and_told(run: Run, rows: pd.DataFrame, stored: Stored) -> None:
    own = rows[rows["approximation"] == "gaussian"].assign(approximation="mine", max_abs=0.0)
    mixed = stored("20260101-000000-0123abce", accuracy=pd.concat([rows, own], ignore_index=True), timed=False)
    answer = recommend(mixed, **QUESTION, target="rdna2")
    assert answer["choices"] == recommend(run, **QUESTION, target="rdna2")["choices"]
    assert any("mine" in note for note in answer["notes"])


def test_wrong_questions_are_refused(run: Run) -> None:
    for ask in (lambda **q: recommend(run, **QUESTION, **q), lambda **q: points(run, alpha=50, **q)):
        with pytest.raises(UnknownNameError, match="cpu, gcn4"):
            ask(target="rdna9")
        with pytest.raises(UnknownNameError, match="issue, special"):
            ask(target="rdna2", short_of="memory")
        with pytest.raises(InputError, match="only a compiled target"):
            ask(short_of="special")
    with pytest.raises(InputError, match="float32"):
        recommend(None, alpha=50, max_error=0.1, precision="float64", target="rdna2")


def test_the_command_takes_several_targets(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    ask = ["recommend", "--alpha", "50", "--max-error", "1/100", "--run", run.id]
    text = CliRunner().invoke(main, [*ask, "--target", "rdna2,gcn4"])
    assert text.exit_code == 0
    assert "4 cycles" in text.output
    both = json.loads(CliRunner().invoke(main, [*ask, "--target", "rdna2,gcn4", "--json"]).output)["targets"]
    assert both["gcn4"] == json.loads(CliRunner().invoke(main, [*ask, "--target", "gcn4", "--json"]).output)
    assert CliRunner().invoke(main, [*ask, "--target", ","]).exit_code == 2
    assert CliRunner().invoke(main, ["front", run.id, "--alpha", "50", "--target", "gcn4"]).exit_code == 0
