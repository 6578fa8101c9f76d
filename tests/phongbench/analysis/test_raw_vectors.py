"""Recipes for raw N, L and V: which is chosen, what is promised of it, what its steps cost."""

import json
import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from raw_runs import ALPHA, MadeUp

from phongbench.analysis.error_budget import Budget, length_error_of
from phongbench.analysis.promises import bound_at, promise, promise_raw
from phongbench.analysis.raw_vectors import STEPS, steps
from phongbench.analysis.recommend import recommend
from phongbench.cli.main import main
from phongbench.compiler.lowering import FLOAT32
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import Kernel


@pytest.fixture
def run(monkeypatch):
    monkeypatch.setattr("phongbench.results.runs.intact", lambda run: run)
    return MadeUp(
        {
            "phong@reflect/each": (1e-5, 3.0),
            "phong@lengthwise/once": (1e-5, 2.2),
            "lyon:cross:32:minimax@lengthwise/once": (0.0048, 1.4),
            "lyon:cross:8:minimax@lengthwise": (0.0153, 0.8),
            "blinn:minimax@halfway/once": (0.0001, 0.5),
        }
    )


def best(run, error, **more):
    answer = recommend(run, alpha=ALPHA, max_error=error, raw=True, **more)
    return answer, [choice["name"] for choice in answer["choices"]]


def test_the_cheapest_recipe_whose_promise_is_within_the_budget_is_chosen(run):
    answer, names = best(run, 0.005)
    assert names == ["lyon:cross:32:minimax@lengthwise/once", "phong@lengthwise/once"]
    assert answer["choices"][0]["bound"] <= 0.005
    assert answer["usual"]["name"] == "phong@reflect/each"
    assert "within 0.005" in answer["choices"][0]["why"]
    assert best(run, 0.001)[1][0] == "phong@lengthwise/once"


def test_a_recipe_that_only_samples_vouch_for_is_never_chosen(run):
    """Blinn's is the fastest and its samples are tiny, but over all azimuths nothing is proven."""
    assert not any("halfway" in name for name in best(run, 0.5)[1])


def test_lengths_that_stay_are_judged_by_what_is_left_of_them(run):
    assert best(run, 0.1)[1][0] == "lyon:cross:32:minimax@lengthwise/once"  # any length
    answer, names = best(run, 0.1, length_error=0.01)
    assert names[0] == "lyon:cross:8:minimax@lengthwise"
    assert any("leaving lengths is the better answer" in note for note in answer["notes"])


def test_without_rows_or_run_it_says_what_measures_them(run):
    with pytest.raises(InputError, match="no run"):
        recommend(None, alpha=ALPHA, max_error=0.1, raw=True)
    with pytest.raises(InputError, match=r"wrongest lengths measured are 0\.01"):
        best(run, 0.1, length_error=0.2)
    with pytest.raises(InputError, match="float64"):
        best(run, 0.1, precision="float64")


def test_a_mesh_angle_is_the_shortest_normal_on_an_edge(run):
    assert length_error_of(20, None) == pytest.approx(1 - math.cos(math.radians(10)))
    answer = best(run, 0.1, mesh_angle=10)[0]
    assert answer["length_error"] == pytest.approx(1 - math.cos(math.radians(5)))
    assert "10 degrees apart are up to 0.381 % too short" in answer["notes"][0]
    for angle, length in ((-1, None), (180, None), ("nan", None), (10, 0.1)):
        with pytest.raises(InputError):
            length_error_of(angle, length)


def test_steps_are_differences_of_times(run):
    (once,) = [step for step in steps(run.records("timing")) if step["step"] == "one root"]
    assert once["share"] == pytest.approx(0.8)
    assert once["ns"] == pytest.approx(0.4)
    assert once["share_low"] < once["share"] < once["share_high"]
    assert {name for name, *_ in STEPS} >= {"power", "normalise R and V", "one root", "H"}


def test_a_step_without_an_interval_is_left_out(run):
    run.timing.loc[run.timing["normalise"] == "once", "ratio_low"] = math.nan
    assert "one root" not in {step["step"] for step in steps(run.records("timing"))}


def configurations(random, count):
    """N, L and V of lengths from 0.001 to 1000, V near the mirror direction, as (9, count) float32."""
    n, mirror = (v / np.linalg.norm(v, axis=0) for v in random.normal(size=(2, 3, count)))
    mirror *= np.sign((n * mirror).sum(axis=0))
    light = 2 * (n * mirror).sum(axis=0) * n - mirror
    view = mirror + random.normal(size=(3, count)) * random.random(count) * 0.4
    view /= np.linalg.norm(view, axis=0)
    lengths = np.repeat(10.0 ** random.uniform(-3, 3, (3, count)), 3, axis=0)
    return (np.concatenate([n, light, view]) * lengths).astype(np.float32)


@pytest.mark.parametrize(
    "spelling",
    [
        "phong@reflect/each",
        "phong@lengthwise/once",
        "phong@lengthwise/squared",
        "lyon:cross:32:minimax@lengthwise/once",
    ],
)
def test_no_configuration_breaks_a_promise(spelling):
    """An independent search: random configurations, and the worst of them turned and stretched further."""
    formula, random = Formula.parse(spelling), np.random.default_rng(7)
    bound = promise_raw(formula, Budget.of(ALPHA, 1.0), any_length=True).bound
    raw = {"normalise": formula.normalise, "recipe": formula.recipe}
    kernel = Kernel.of_pairs(formula.spec(), formula.lambda_form, formula.setting(ALPHA), FLOAT32, **raw)
    worst = 0.0
    for _ in range(20):
        nine = configurations(random, 4096)
        n, light, view = (nine[i : i + 3].astype(np.float64) for i in (0, 3, 6))
        mirror = 2 * (n * light).sum(axis=0) * n - (n * n).sum(axis=0) * light
        sizes = np.linalg.norm(mirror, axis=0) * np.linalg.norm(view, axis=0)
        exact = np.maximum((mirror * view).sum(axis=0) / sizes, 0) ** ALPHA
        out = np.empty(4096, np.float32)
        kernel.fill_pairs(np.ascontiguousarray(nine[:3]), np.ascontiguousarray(nine[[6, 7, 8, 3, 4, 5]]), out)
        worst = max(worst, float(np.abs(out - exact).max()))
    assert 0 < worst <= bound


def test_nothing_is_promised_where_squares_leave_the_precision():
    formula = Formula.parse("phong@lengthwise/once")
    for precision in ("float16", "q1.15"):
        assert not promise_raw(formula, Budget.of(ALPHA, 1.0, precision=precision)).kept


def test_a_promise_for_raw_vectors_is_that_of_the_pair_with_room():
    budget = Budget.of(ALPHA, 1.0)
    for spelling in ("lyon:cross:8/once", "lyon:dot:8@reflect/each"):
        raw = Formula.parse(spelling)
        pair = promise(replace(raw, recipe="pair", normalise="none"), budget).bound
        assert pair < bound_at(raw, ALPHA) < pair + 3e-4
    assert bound_at(Formula.parse("blinn@halfway/once"), ALPHA) is None
    assert bound_at(Formula.parse("phong/fast"), ALPHA) is None


@pytest.mark.parametrize(("recipe", "times"), [("reflect", 1), ("lengthwise", 3)])
def test_lengths_that_stay_are_promised_as_those_of_the_r_that_is_made_of_them(recipe, times):
    """2(N.L)N - (N.N)L is as long as N, N and L together; 2(N.L)N - L of an N made unit is as long as L."""
    formula, wrong = Formula.parse(f"lyon:dot:8@{recipe}"), 0.01
    made = Budget.of(ALPHA, 1.0, (1 + wrong) ** times - 1)
    pair = promise(replace(formula, recipe="pair"), made).bound
    assert pair < promise_raw(formula, Budget.of(ALPHA, 1.0, wrong), any_length=False).bound < pair + 3e-4


@pytest.mark.parametrize("share", [1e-9, 0.5, 2.0])
def test_a_bound_that_need_not_be_sharp_is_on_the_same_side_of_the_budget(share):
    formula = Formula.parse("lyon:dot:8@reflect/each")
    sharp = promise_raw(formula, Budget.of(ALPHA, 1.0)).bound
    budget = Budget.of(ALPHA, share * sharp)
    assert (promise_raw(formula, budget, sharp=False).bound <= budget.max_error) == (share > 1)


@pytest.mark.parametrize(
    ("lengths", "said"),
    [(None, "any length from 0.001 to 1000"), (0.01, "lengths up to 1 % wrong"), (0.0, "unit N, L, V")],
)
def test_an_answer_says_for_which_lengths_it_holds(run, lengths, said):
    answer, _ = best(run, 0.1, length_error=lengths)
    assert any(note.endswith(f"for every N, L and V of {said}") for note in answer["notes"])
    assert f"N, L and V of {said}" in answer["choices"][0]["why"]


def test_the_command_tells_the_steps(run, monkeypatch, tmp_path):
    monkeypatch.setattr("phongbench.results.answering.run_for", lambda *_: run)
    shown = CliRunner().invoke(main, ["recommend", "--alpha", "50", "--max-error", "0.005", "--raw"])
    assert shown.exit_code == 0, shown.output
    assert "What each step costs" in shown.output
    assert "phong@reflect/each" in shown.output
    whole = CliRunner().invoke(main, ["recommend", "--alpha", "50", "--max-error", "0.005", "--raw", "--json"])
    answer = json.loads(whole.stdout)
    assert answer["choices"][0]["normalise"] == "once"
    assert answer["choices"][0]["recipe"] == "lengthwise"
    assert pd.DataFrame(answer["steps"])["share"].notna().all()
