"""The budget answer from the laws alone, where there is no run."""

import json
from typing import Any

import numpy as np
import pytest

from phongbench.analysis.recommend import recommend
from phongbench.errors import InputError
from phongbench.formulas.rounding_law import rounding_bound

CODE = 1 / 255


def dense(form: str, alpha: float, gamma: float, e: float = 0.0, d: float = 0.0) -> float:
    """Largest error of Lyon's formula on a dense float64 grid, lengths 1 + e and 1 + d."""
    u = np.concatenate([np.linspace(0, 12, 20001), np.linspace(12, alpha, 2001)])
    deficit = np.minimum(u / alpha, 1.0)
    s = (1 + e) * (1 + d)
    forms = {
        "dot": 1 - s * (1 - deficit),
        "difference": s * deficit + 0.5 * (e - d) ** 2,
        "cross": s * s * (deficit - 0.5 * deficit**2),
    }
    value = np.maximum(0.0, 1.0 - alpha / gamma * forms[form]) ** gamma
    return float(np.abs(value - (1 - deficit) ** alpha).max())


def test_the_laws_speak_from_an_exponent_of_five_on() -> None:
    assert recommend(None, alpha=5, max_error=0.1)["choices"]
    with pytest.raises(InputError, match="alpha >= 5"):
        recommend(None, alpha=4.99, max_error=0.1)


@pytest.mark.parametrize("alpha", [10.0, 50.0, 200.0, 1000.0])
@pytest.mark.parametrize("length", [0.0, 1e-4, 1e-3])
def test_a_law_answer_bounds_the_formula_it_names(alpha: float, length: float) -> None:
    for budget in (0.05, 0.02, CODE):
        found = recommend(None, alpha=alpha, max_error=budget, length_error=length)
        for told in [*found["choices"], *filter(None, [found["nearest_miss"]])]:
            if told["approximation"] == "lyon":
                pairs = [(0.0, 0.0), (length, 0.0), (-length, 0.0), (length, length), (length, -length)]
                true = max(dense(told["lambda"], alpha, told["gamma"], e, d) for e, d in pairs)
                assert told["max_abs"] >= true
                if not length:  # the largest model error and the largest change by lengths lie apart
                    assert told["max_abs"] <= 1.1 * true + rounding_bound(told["gamma"], alpha, "float32")


def test_the_laws_say_that_they_answer_and_name_no_time() -> None:
    found = recommend(None, alpha=50.5, max_error="1/255")
    assert (found["basis"], found["run"]) == ("laws", None)
    assert "from the laws alone" in found["notes"][0]
    best = found["choices"][0]
    assert best["gamma"] == 32
    assert best["coverage"] == "law"
    assert {best[name] for name in ("ns", "ratio", "ratio_low", "ratio_high")} == {None}
    assert json.loads(json.dumps(found, allow_nan=False)) == found


def test_only_exact_powers_meet_a_budget_beyond_every_law() -> None:
    assert recommend(None, alpha=10, max_error=1e-4)["choices"][0]["approximation"] == "integer-power"
    assert recommend(None, alpha="10..12", max_error=1e-4)["choices"][0]["approximation"] == "phong"


@pytest.mark.parametrize("asked", [{"alpha": 2}, {"precision": "float16"}, {"space": "half"}])
def test_what_no_law_speaks_of_is_refused_with_the_command_that_measures_it(asked: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="phongbench run"):
        recommend(None, **({"alpha": 50, "max_error": 0.01} | asked))


def test_the_laws_do_not_reach_large_length_errors() -> None:
    found = recommend(None, alpha=50, max_error=0.5, length_error=0.1)
    assert any("left out" in note for note in found["notes"])
    assert not found["choices"]
