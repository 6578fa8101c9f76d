"""What is promised of raw vectors holds for lengths of the whole domain: searched by code of its own.

`make soak` tries a thousand recipes, some run here: as kernels compute them, and the emitted code on devices that err
as much as standards allow.
"""

import os
from dataclasses import replace

import numpy as np
import pytest
from emulated_devices import Machine as Device
from emulated_devices import Vector
from raw_adversary import ANY, configurations, mirrored, worst

from phongbench.analysis.error_budget import Budget
from phongbench.analysis.promises import EXACT_WAYS, promise_raw
from phongbench.formulas.formula import Formula, takes
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.shader_code.evaluated import highlight

RECIPES = int(os.environ.get("PHONGBENCH_SOAK", "24"))
NAMES = ("phong", "lyon", "gaussian", "lyon-quadratic", "schlick", "table-u", "integer-power")


def drawn(rng: np.random.Generator, *, removes: bool) -> tuple[Formula, float]:
    """A formula from N, L and V, and an exponent that it takes."""
    spec = REGISTRY[str(rng.choice(NAMES))]
    form = str(rng.choice([f for f in spec.lambda_forms if f != "tan2"]))
    way = str(rng.choice([w for w in EXACT_WAYS if takes(spec, form, w)])) if removes else "none"
    recipes = ("pair", "reflect", "lengthwise") if removes else ("reflect", "lengthwise")
    gamma = int(2 ** rng.integers(1, 7)) if spec.uses_gamma else None
    recipe, slope = str(rng.choice(recipes)), str(rng.choice(spec.slopes))
    alpha = float(np.exp(rng.uniform(np.log(5), np.log(1000))))
    whole = float(round(alpha)) if spec.name == "integer-power" else alpha
    return Formula.of(spec.name, form, gamma, slope, recipe=recipe, normalise=way), whole


@pytest.mark.parametrize("seed", range(RECIPES))
def test_no_raw_vectors_break_the_bound_of_a_recipe(seed: int) -> None:
    """Two thirds remove lengths, from 0.001 to 1000; the others take N, L and V that are a little wrong."""
    rng = np.random.default_rng(seed)
    removes = seed % 3 != 0
    formula, alpha = drawn(rng, removes=removes)
    precision = str(rng.choice(["float32", "float32", "float64", "bfloat16"]))
    size = 0.0 if removes else float(10.0 ** rng.uniform(-5, -1.5))
    kept = promise_raw(formula, Budget.of(alpha, 1.0, size, precision), any_length=removes)
    assert kept.kept or formula.approximation == "schlick"  # over-long vectors lead past its pole
    lengths = ANY if removes else (1 - size, 1 + size)
    assert worst(formula, alpha, precision, rng, lengths) <= kept.bound, (str(formula), alpha, precision)


@pytest.mark.parametrize("seed", range(RECIPES))
def test_no_device_breaks_the_bound_of_a_recipe_by_contract(seed: int) -> None:
    rng = np.random.default_rng(seed)
    removes = seed % 3 != 0
    formula, alpha = drawn(rng, removes=removes)
    size = 0.0 if removes else float(10.0 ** rng.uniform(-5, -1.5))
    kept = promise_raw(formula, Budget.of(alpha, 1.0, size, contract=True), any_length=removes)
    assert kept.coverage == "contract"
    low, high = ANY if removes else (1 - size, 1 + size)
    for sign in (0.4, -0.4, None):
        device = Device(
            "float32", lambda x, s=sign: rng.uniform(-1, 1, np.shape(x)) if s is None else np.full(np.shape(x), s)
        )
        vectors = configurations(rng, 1024, alpha)
        held = [device.constant(v * np.exp(rng.uniform(np.log(low), np.log(high), 1024))) for v in vectors]
        n, light, view = held
        r = device.constant(mirrored(n, light))
        given = [r, view] if formula.recipe == "pair" else held
        code = highlight(formula.spec(), formula, formula.setting(alpha), device.words(), limited=bool(seed % 2))
        value = code(*(Vector(*map(device.number, v)) for v in given)).values
        a, b = (v / np.linalg.norm(v, axis=0) for v in (r if formula.recipe == "pair" else mirrored(n, light), view))
        deficit = np.minimum(0.5 * ((a - b) ** 2).sum(axis=0), 1.0)
        with np.errstate(divide="ignore"):
            true = np.exp(alpha * np.log1p(-deficit))
        assert np.abs(value - true).max() <= kept.bound, (str(formula), alpha)


def test_recipes_of_half_vectors_and_tricks_are_not_promised() -> None:
    for spelling in ("blinn@halfway/each", "phong/fast", "phong@reflect"):
        formula = Formula.parse(spelling)
        assert not promise_raw(formula, Budget.of(50.0, 1.0)).kept
        assert not promise_raw(replace(formula), Budget.of(50.0, 1.0, contract=True)).kept
