"""Answers for the chip that a formula ships to: errors of a run, or of the laws, with costs that a compiler counted."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from click.testing import CliRunner

from phongbench.accuracy.enclosures.bounds import NotEnclosedError
from phongbench.analysis import promises
from phongbench.analysis.by_target import alike, answers
from phongbench.analysis.choices import Choices
from phongbench.analysis.front import points
from phongbench.analysis.recommend import recommend
from phongbench.analysis.target_costs import Price, checked, prices, table_of
from phongbench.cli import answer_tables
from phongbench.cli.main import main
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import Formula
from phongbench.inputs.plan import Plan
from phongbench.results.records import Records
from phongbench.results.runs import Run
from phongbench.results.schema import TABLES
from phongbench.targets.chips import TARGETS
from phongbench.targets.costs import shipped
from phongbench.targets.target import UNITS

Stored = Callable[..., Run]
#: a target of each compiler
FAMILIES = ("gcn4", "rdna2", "sm89", "cortex-m7")
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
    assert recommend(run, **QUESTION, target="sm89")["choices"][0]["approximation"] == "gaussian"
    assert recommend(run, **QUESTION, target="gcn4")["choices"][0]["name"] == "lyon:dot:16:minimax"
    assert recommend(run, **QUESTION, target="cortex-m7")["choices"][0]["approximation"] == "lyon"


@pytest.mark.parametrize("target", FAMILIES)
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


@pytest.mark.parametrize("target", FAMILIES)
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
    here = recommend(run, **QUESTION, target="gcn4", others=True)
    others = {one["target"]: one["name"] for one in here["elsewhere"]}
    assert "gcn4" not in others
    assert others["rdna2"].startswith("gaussian")


@pytest.mark.parametrize("target", FAMILIES)
def test_what_is_told_of_another_target_is_its_own_answer(run: Run, target: str) -> None:
    here = recommend(run, **QUESTION, target="gcn4", others=True)
    own = recommend(run, **QUESTION, target=target)["choices"][0]
    told = {one["target"]: one for one in here["elsewhere"]}
    assert (target in told) == (own["name"] != here["choices"][0]["name"])
    assert all(value == own[key] for key, value in told.get(target, {}).items())


def test_an_own_formula_is_left_out_and_told(run: Run, rows: pd.DataFrame, stored: Stored) -> None:
    own = rows[rows["approximation"] == "gaussian"].assign(approximation="mine", max_abs=0.0)
    mixed = stored("20260101-000000-0123abce", accuracy=pd.concat([rows, own], ignore_index=True), timed=False)
    answer = recommend(mixed, **QUESTION, target="rdna2")
    assert answer["choices"] == recommend(run, **QUESTION, target="rdna2")["choices"]
    assert any("mine" in note for note in answer["notes"])


def test_wrong_questions_are_refused(run: Run) -> None:
    for ask in (lambda **q: recommend(run, **QUESTION, **q), lambda **q: points(run, alpha=50, **q)):
        with pytest.raises(UnknownNameError, match="cpu, gpu, gcn4"):
            ask(target="rdna9")
        with pytest.raises(UnknownNameError, match="issue, special"):
            ask(target="rdna2", short_of="memory")
        with pytest.raises(InputError, match="only a compiled target"):
            ask(short_of="special")
        with pytest.raises(InputError, match="nothing of a special unit on zen4"):
            ask(target="zen4", short_of="special")
    with pytest.raises(InputError, match="no costs of rdna2 in float64 ship"):
        recommend(None, alpha=50, max_error=0.1, precision="float64", target="rdna2")


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("target", TARGETS)
def test_a_unit_that_a_target_has_compares_every_cost_and_another_is_refused(target: str, unit: str) -> None:
    table = shipped(target)
    if table.baseline.short_of(unit):
        assert checked(target, unit) == target
        assert all(math.isfinite(table.ratio(cost, unit)) for _, cost in table.rows.values())
    else:
        with pytest.raises(InputError, match=target):
            checked(target, unit)


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


def test_answers_beside_one_another_are_those_of_recommend(run: Run) -> None:
    found = answers(Choices.of(run), list(TARGETS), [50.0], 0.01)
    assert [answer.target for answer in found] == list(TARGETS)
    for answer in found:
        best = recommend(run, **QUESTION, target=answer.target)["choices"][0]
        told = answer.as_dict()
        assert {key: told[key] for key in told if key != "alpha"} == {key: best[key] for key in told if key != "alpha"}
    groups = alike(found)
    assert sorted(name for group in groups for name in group) == sorted(TARGETS)
    for group in groups:
        assert len({(answer.formula, round(answer.row["ratio"], 3)) for answer in found if answer.target in group}) == 1


def test_nothing_within_a_budget_is_said_for_each_target(run: Run) -> None:
    assert all(
        a.row is None and a.as_dict()["name"] is None for a in answers(Choices.of(run), ["rdna2"], [50.0], 1e-12)
    )


def test_own_formulas_have_the_price_that_was_compiled_with_their_run(stored: Stored, rows: pd.DataFrame) -> None:
    own = rows[rows["approximation"] == "gaussian"].assign(approximation="own")
    run = stored(accuracy=pd.concat([rows, own], ignore_index=True), timed=False)
    assert "own" not in {p["approximation"] for p in points(run, alpha=50, target="rdna2")["points"]}
    named = {"approximation": "own", "lambda_form": "dot", "space": "reflect", "beta_policy": "minimax", "gamma": None}
    named |= {"recipe": "pair", "normalise": "none", "precision": "float32", "alpha": 50.0, "context": 0, "reads": 0}
    cost = {"cost": 1.5, "ratio": 0.25, "ratio_low": 0.25, "ratio_high": 0.25, "bound_by": "special"}
    costs = TABLES["costs"].frame([{"target": "rdna2", "cost_kind": "compiled", **named, **cost}])
    run.__dict__["_records"] = {"costs": Records.of(costs)}
    mine = [p for p in points(run, alpha=50, target="rdna2")["points"] if p["approximation"] == "own"]
    assert [(p["name"], p["cost"], p["ratio"], p["bound_by"]) for p in mine] == [
        ("own:dot:minimax", 1.5, 0.25, "special")
    ]
    assert not [p for p in points(run, alpha=50, target="gcn4")["points"] if p["approximation"] == "own"]


def test_the_command_shows_what_to_ship_where(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(run.path.parent.parent)
    document = json.loads(CliRunner().invoke(main, ["show", "latest", "--target", "rdna2,gcn4", "--json"]).output)
    assert [(a["alpha"], a["target"]) for a in document["answers"]] == [(50.0, "rdna2"), (50.0, "gcn4")]
    assert {"name", "cost", "unit", "cost_kind", "bound_by", "normalise", "recipe"} <= set(document["answers"][0])
    plain = CliRunner().invoke(main, ["show", "latest", "--target", "rdna2"])
    assert document["answers"][0]["name"] in plain.output
    assert "answers" not in json.loads(CliRunner().invoke(main, ["show", "latest", "--json"]).output)
    for name, told in (("geforce", "gcn4"), ("cpu", "no timing rows")):
        refused = CliRunner().invoke(main, ["show", "latest", "--target", name])
        assert refused.exit_code == 2
        assert told in refused.output


def test_targets_that_answer_alike_share_a_line() -> None:
    same = {"name": "phong", "cost": 6.0, "unit": "cycles", "ratio": 1.0, "max_abs": 1e-6}
    others = [same | {"target": "rdna2"}, same | {"target": "gcn4", "cost": 24.0}, same | {"target": "rdna3"}]
    lines = answer_tables._elsewhere(others)
    assert [line.split(":")[0] for line in lines] == ["on rdna2, rdna3", "on gcn4"]


def test_a_measured_price_holds_at_exponents_whose_code_is_the_same_but_for_numbers() -> None:
    """Of exact Phong the exponent is one; whole powers are other multiplications each."""
    nothing, price = table_of("gpu"), Price(2.0, 2.0, 0.5, 0.4, 0.6, None, 50.0)
    for name, kept in (("phong", price), ("integer-power", None)):
        formula = Formula.parse(name)
        assert prices([formula], (50.0,), nothing, own={formula: price}) == [price]
        assert prices([formula], (20.0, 50.0), nothing, own={formula: price}) == [kept]


def test_for_other_targets_nothing_is_searched(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """A search takes a second, and there are many targets: what cannot be proven is not their answer."""
    searched: list[str] = []

    def unproven(*_: object) -> float:
        raise NotEnclosedError

    def search(case: Any) -> float:
        searched.append(str(case.formula))
        return 1.0

    monkeypatch.setattr(promises, "_proven", unproven)
    monkeypatch.setattr(promises, "_searched", search)
    recommend(run, **QUESTION, target="gcn4")
    alone = len(searched)
    assert recommend(run, **QUESTION, target="gcn4", others=True)["elsewhere"] == []
    assert 0 < alone == len(searched) - alone
