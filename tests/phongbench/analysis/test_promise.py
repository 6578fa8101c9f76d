"""An answer is a promise: an adversary searches pairs of vectors on which a formula breaks the bound it was chosen by.

The adversary's code is its own (`adversary`). Vectors are normalised as shaders do it, v * (1 / sqrt(v.v)) and
v / sqrt(v.v), with products rounded and fused. `make soak` tries a thousand budgets, a twentieth runs here.
"""

import os
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from adversary import FORMULAS, WAYS, Attack, Machine, raw_pairs, worst

from phongbench.analysis.error_budget import Budget
from phongbench.analysis.promises import promise
from phongbench.analysis.recommend import recommend
from phongbench.compiler import elementary
from phongbench.formulas.citations import Source
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.rounding_law import rounding_bound
from phongbench.formulas.spec import Approximation, Cost
from phongbench.inputs.plan import Plan, preset
from phongbench.results import runs
from phongbench.results.runs import Run
from phongbench.results.schema import ACCURACY, CPU, TIMING

#: pairs for each way to normalise, rounded and fused; four rounds of the search look at so many
PAIRS = 384
BUDGETS = int(os.environ.get("PHONGBENCH_SOAK", "50"))
#: what the command line takes, float32 most often
PRECISIONS = ("float32", "float32", "float32", "float16", "float16", "float64", "bfloat16", "q1.15")
#: exponents of the stored run, between which most questions lie
MEASURED = (5.0, 10.0, 50.0, 200.0, 1000.0, 2000.0)


RUNS = 4


def sampled(formula: Formula, alpha: float) -> float:
    """What few samples of exact arithmetic show of a formula: a lower bound that knows nothing of rounding."""
    attack = Attack(formula, alpha, Machine("float64", fused=False))
    angles = np.linspace(0, np.arccos(np.exp(-8 / attack.exponent)), 33)
    a, b = np.zeros((3, 33)), np.stack([np.cos(angles), np.sin(angles), np.zeros(33)])
    a[0] = 1.0
    return float(attack.errors(a, b).max())


def rows_of(plan: Plan) -> pd.DataFrame:
    """Rows of accuracy of every gated cell, on unit vectors and on wrong lengths."""
    known: dict[tuple[Formula, float], float] = {}
    rows = []
    for cell in plan.cells():
        key = (cell.formula, cell.alpha)
        known[key] = known.get(key, 0.0) or sampled(*key)
        f = cell.formula
        whole = {"approximation": f.approximation, "lambda_form": f.lambda_form, "space": f.space, "gamma": f.gamma}
        whole |= {"beta_policy": f.slope, "alpha": cell.alpha, "precision": cell.precision, "gated": True}
        whole |= {"recipe": f.recipe, "normalise": f.normalise, "device": CPU}
        whole |= {"truth": "angle", "samples": 33, "coverage": "sampled", "max_abs": known[key]}
        rows += [whole | {"stratum": "highlight", "perturbation": "none", "length_error": 0.0}] if cell.gated else []
        rows += [whole | {"stratum": "lengths", "perturbation": "a", "length_error": 0.05}] if cell.gated else []
    frame = pd.DataFrame(rows).reindex(columns=ACCURACY.names)
    counts = ["nonfinite", "above_one", "negative", "excluded"]
    return frame.fillna(dict.fromkeys(counts, 0)).astype(ACCURACY.types)


def times_of(accuracy: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Random times of all kernels, so that the cheapest formulas differ from run to run."""
    kernels = accuracy[["approximation", "lambda_form", "space", "gamma", "recipe", "normalise"]].drop_duplicates()
    rows = pd.concat([kernels.assign(precision=name) for name in ("float32", "float64")], ignore_index=True)
    ratio = rng.uniform(0.1, 1.0, len(rows))
    times = {"ratio": ratio, "ratio_low": 0.99 * ratio, "ratio_high": 1.01 * ratio, "ns_min": ratio, "ns_median": ratio}
    rows = rows.assign(beta_policy="none", working_set="l1", elements=1, threads=1, verdict="unresolved", **times)
    return rows.assign(dot_ratio=1.0, bandwidth_fraction=0.5, rounds=24, contaminated=0)[TIMING.required]


@pytest.fixture(scope="module")
def stored_runs(tmp_path_factory: pytest.TempPathFactory) -> list[Run]:
    """Runs of every formula that ships, with different times; their few samples decide next to nothing."""
    base = replace(preset("quick"), alphas=MEASURED, gammas=(2, 8, 32), slopes=("taylor", "minimax", "energy"))
    base = replace(base, approximations=tuple(FORMULAS))
    plan = replace(base, precisions=tuple(dict.fromkeys(PRECISIONS)), length_spaces=("reflect", "half")).validated()
    accuracy, folder, made = rows_of(plan), tmp_path_factory.mktemp("promise"), []
    for seed in range(RUNS):
        path = folder / f"2026010{seed}-000000-0123abcd"
        path.mkdir()
        tables = {"accuracy": accuracy, "timing": times_of(accuracy, np.random.default_rng(seed))}
        files = {f"{name}.parquet": runs.write_table(path, name, frame) for name, frame in tables.items()}
        about = {"schema": runs.SCHEMA, "run": path.name, "state": "complete", "plan": plan.as_dict(), "seed": 1}
        runs.write_manifest(path, about | {"code": "0", "provenance": {}, "files": files})
        made.append(runs.load(path))
    return made


def question(rng: np.random.Generator, seed: int) -> dict[str, Any]:
    """A random budget; a third asks for a whole exponent, some for several or a range, a fifth allows wrong lengths."""
    alpha = float(np.exp(rng.uniform(np.log(5), np.log(2000))))
    asked: Any = float(round(alpha)) if seed % 3 == 0 else alpha
    if seed % 11 == 0:
        asked = f"{alpha:g},{min(2000.0, 1.7 * alpha):g}"
    elif seed % 13 == 0:
        asked = f"{alpha:g}..{min(2000.0, 2.5 * alpha):g}"
    options = {"alpha": asked, "max_error": float(np.exp(rng.uniform(np.log(2e-5), np.log(0.3))))}
    options["precision"] = str(rng.choice(PRECISIONS))
    options["space"] = "half" if rng.random() < 0.15 else "reflect"
    return options | ({"length_error": float(10.0 ** rng.uniform(-5, -1.5))} if rng.random() < 0.2 else {})


def attacked(answer: dict[str, Any], rng: np.random.Generator) -> None:
    """Every choice of an answer survives the adversary at exponents of the budget."""
    size = answer["length_error"] or 0.0
    budget = Budget.of(answer["alpha"], 1.0)
    low, high = budget.alpha.values[0], budget.alpha.values[-1]
    alphas = {*budget.alpha.values, *(rng.uniform(low, high, 3) if budget.alpha.continuous else ())}
    for choice in answer["choices"]:
        assert choice["bound"] <= answer["max_error"]
        assert choice["coverage"] in ("certified", "searched", "law")
        for alpha in alphas:
            formula = Formula.parse(choice["name"])
            found = worst(formula, float(alpha), answer["precision"], rng, length_error=size, pairs=PAIRS, rounds=4)
            assert found <= choice["bound"], (alpha, answer["precision"], size, choice["name"])


@pytest.mark.parametrize("seed", range(BUDGETS))
def test_no_vectors_break_the_bound_of_an_answer(seed: int, stored_runs: list[Run]) -> None:
    """Every other question goes to the stored run, the others to the laws; what cannot be answered says so."""
    rng = np.random.default_rng(seed)
    options = question(rng, seed)
    stored = seed % 2 == 0
    if not stored:
        options |= {"precision": str(rng.choice(["float32", "float64"])), "space": "reflect"}
    attacked(recommend(stored_runs[seed // 2 % RUNS] if stored else None, **options), rng)


@pytest.mark.parametrize("form", ["dot", "difference", "cross"])
@pytest.mark.parametrize("alpha", [10.0, 200.0, 5000.0])
def test_rounding_stays_within_its_law(form: str, alpha: float) -> None:
    """Against the same formula in float64 on the same vectors, made unit: what is left is rounding alone."""
    formula, rng = Formula.of("lyon", form, 64), np.random.default_rng(7)
    exact, machine = Attack(formula, alpha, Machine("float64", fused=False)), Machine("float32", fused=True)
    attack = Attack(formula, alpha, machine)
    a, b = (machine.unit(v, WAYS[0]) for v in raw_pairs(rng, 4096, alpha, (0.5, 2.0)))
    ua, ub = (v / np.linalg.norm(v, axis=0) for v in (a, b))
    # where two unit vectors nearly agree only their difference is known well in float64
    deficit = 0.5 * ((ua - ub) ** 2).sum(axis=0)
    true = exact.kernel(exact.machine, deficit - 0.5 * deficit**2 if form == "cross" else deficit, **exact.values)
    values = attack.kernel(machine, machine.coordinate(form, a, b), **attack.values)
    away = deficit < 0.99  # at 90 degrees the gate falls either way
    assert np.abs(values - true)[away].max() <= rounding_bound(64, alpha, "float32")


def stairs(cosine_deficit: float, scale: float) -> float:
    """A lobe in four thousand steps: too many for enclosures to follow.

    cosine_deficit  float      lambda
    scale           float > 0  steps per lambda
    returns         float      in [0, 1]

    Formula  max(0, 1 - whole(scale lambda) / 4000)
    Source   OWN
    Domain   none
    """
    return elementary.positive_part(1.0 - float(int(scale * cosine_deficit)) / 4000.0)


STAIRS = Approximation(
    name="stairs",
    title="Stairs",
    kind="alternative",
    formula="max(0, 1 - whole(scale lambda) / 4000)",
    source=Source("OWN", "A test's", 2026),
    kernel=stairs,
    coefficients=lambda s: {"scale": 4000 * s.alpha / 4},
    domain="none",
    cost=Cost("a conversion"),
    lambda_forms=("difference",),
)


def test_what_cannot_be_proven_is_searched_and_widened_or_not_promised() -> None:
    registry, formula = {**REGISTRY, "stairs": STAIRS}, Formula("stairs", "difference")
    budget = Budget.of(10.0, 0.3)
    searched = promise(formula, budget, registry)
    assert (searched.coverage, searched.kept) == ("searched", True)
    deficit = np.linspace(0, 1, 100_001)
    model = np.abs(np.maximum(0, 1 - np.floor(10_000 * deficit) / 4000) - (1 - deficit) ** 10).max()
    assert model <= searched.bound <= 1.02 * model
    assert not promise(formula, budget, registry, search=False).kept
    assert not promise(Formula("elsewhere", "dot"), budget, registry).kept


def test_a_choice_is_told_with_the_bound_that_it_was_chosen_by(stored_runs: list[Run]) -> None:
    """A sharp bound may give up where many intervals are alike; the one that decided is then the smaller."""
    answer = recommend(stored_runs[1], alpha=392.0, max_error=7.8469e-05)
    assert answer["choices"]
    assert all(choice["bound"] <= 7.8469e-05 for choice in answer["choices"])
