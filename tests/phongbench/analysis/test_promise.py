"""An answer is a promise: an adversary searches pairs of vectors on which a formula breaks the bound it was chosen by.

Vectors are float32, normalised as shaders do it: v * (1 / sqrt(v.v)). `make soak` tries a thousand budgets.
"""

import os

import numpy as np
import pytest

from phongbench.analysis.law_bounds import rounding_bound
from phongbench.analysis.recommend import recommend
from phongbench.formulas import kernel
from phongbench.formulas.formula import Formula

BUDGETS = int(os.environ.get("PHONGBENCH_SOAK", "50"))
#: of whole exponents each has a kernel of its own, so that there are few
WHOLE = (8.0, 50.0, 64.0, 128.0, 500.0, 1000.0)
PAIRS, BEST, ROUNDS = 4096, 128, 4


def normalised(vectors):
    """(3, n) float32 vectors scaled to unit length in float32."""
    x, y, z = vectors
    return vectors * (np.float32(1) / np.sqrt(x * x + y * y + z * z))


def exact(a, b, alpha):
    """Phong of the true angle between float32 vectors, in float64."""
    a, b = (v / np.linalg.norm(v, axis=0) for v in (a.astype(np.float64), b.astype(np.float64)))
    deficit = 0.5 * ((a - b) ** 2).sum(axis=0)
    with np.errstate(divide="ignore"):
        return np.exp(alpha * np.log1p(-np.minimum(deficit, 1.0)))


def first_pairs(rng, alpha):
    """Pairs all over the lobe, a third of them so near its peak that rounding decides."""
    a = rng.normal(size=(3, PAIRS))
    side = np.cross(a, rng.normal(size=(3, PAIRS)), axis=0)
    a, side = a / np.linalg.norm(a, axis=0), side / np.linalg.norm(side, axis=0)
    deficit = rng.uniform(0, 12, PAIRS) / alpha
    deficit[::3] = 10.0 ** rng.uniform(-9, -4, len(deficit[::3])) / alpha
    angle = 2 * np.arcsin(np.sqrt(np.minimum(deficit / 2, 0.5)))
    lengths = rng.uniform(0.5, 2.0, (2, PAIRS))
    return (lengths[0] * a).astype(np.float32), (lengths[1] * (np.cos(angle) * a + np.sin(angle) * side)).astype(
        np.float32
    )


def worst(formula, alpha, rng):
    """The largest error that the search finds: random pairs, then neighbours of the worst."""
    a, b = first_pairs(rng, alpha)
    spec, setting, largest = formula.spec(), formula.setting(alpha), 0.0
    for _ in range(ROUNDS):
        ua, ub = normalised(a), normalised(b)
        values = kernel.highlights(spec, formula.lambda_form, setting, ua, ub)
        errors = np.abs(values - exact(ua, ub, alpha))
        largest = max(largest, float(errors.max()))
        chosen = np.repeat(np.argsort(errors)[-BEST:], PAIRS // BEST)
        steps = rng.integers(-4, 5, (2, 3, PAIRS)).astype(np.float32) * np.float32(2.0**-23)
        a, b = (v[:, chosen] * (1 + step) for v, step in zip((a, b), steps, strict=True))
    return largest


@pytest.mark.parametrize("seed", range(BUDGETS))
def test_no_vectors_break_the_bound_of_a_law_answer(seed: int) -> None:
    rng = np.random.default_rng(seed)
    alpha = float(rng.choice(WHOLE)) if seed % 3 == 0 else float(np.exp(rng.uniform(np.log(5), np.log(2000))))
    budget = float(np.exp(rng.uniform(np.log(2e-4), np.log(0.2))))
    answer = recommend(None, alpha=alpha, max_error=budget)
    for choice in answer["choices"]:
        assert choice["bound"] <= budget
        assert worst(Formula.parse(choice["name"]), alpha, rng) <= choice["bound"], (alpha, budget, choice["name"])


@pytest.mark.parametrize("form", ["dot", "difference", "cross"])
@pytest.mark.parametrize("alpha", [10.0, 200.0, 5000.0])
def test_rounding_stays_within_its_law(form: str, alpha: float) -> None:
    """Against the same formula in float64 on the same vectors, made unit: what is left is rounding alone."""
    formula, rng = Formula.of("lyon", form, 64), np.random.default_rng(7)
    a, b = (normalised(v) for v in first_pairs(rng, alpha))
    ua, ub = (v / np.linalg.norm(v, axis=0) for v in (a.astype(np.float64), b.astype(np.float64)))
    deficit = 0.5 * ((ua - ub) ** 2).sum(axis=0)
    coordinate = deficit - 0.5 * deficit**2 if form == "cross" else deficit
    true = kernel.evaluate(formula.spec(), formula.setting(alpha), coordinate, 1 - deficit)
    values = kernel.highlights(formula.spec(), form, formula.setting(alpha), a, b)
    away = deficit < 0.99  # at 90 degrees the gate falls either way
    assert np.abs(values - true)[away].max() <= rounding_bound(64, alpha, "float32")
