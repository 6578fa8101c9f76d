"""What a run says to ship: groups of exponents, ties, no gain, and runs without times."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pandas as pd
import pytest

from phongbench.analysis.choices import Choices
from phongbench.analysis.recommend import recommend
from phongbench.analysis.verdict import verdict
from phongbench.results.runs import Run

RUN = "20260101-000000-0123abcd"
Stored = Callable[..., Run]


def test_every_exponent_is_in_one_group_and_has_the_answer_of_recommend(stored: Stored) -> None:
    run = stored(RUN)
    found = verdict(Choices.of(run), 0.02)
    alphas = [alpha for group in found["groups"] for alpha in group["alphas"]]
    assert alphas == sorted(run.plan.alphas)
    for group in found["groups"]:
        for alpha in group["alphas"]:
            best = recommend(run, alpha=alpha, max_error=0.02)["choices"][0]
            assert (best["name"], best["ratio"]) == (group["name"], group["ratio"])
            assert best["bound"] <= group["bound"] <= 0.02
    neighbours = pairwise((group["name"], group["tied"]) for group in found["groups"])
    assert all(one != other for one, other in neighbours)
    assert found["timed"]
    assert all(group["gain"] for group in found["groups"])


def barely(row: Any) -> float:
    """Times whose intervals of 1 % reach that of exact Phong."""
    return 1.0 if row.approximation == "phong" else 0.995


def test_a_formula_that_is_not_surely_faster_is_no_gain_over_exact_phong(stored: Stored) -> None:
    run = stored(RUN, ratio=barely)
    (*_, last) = verdict(Choices.of(run), 0.02)["groups"]
    assert (last["gain"], last["exact"]) == (False, True)
    answer = recommend(run, alpha=50, max_error=0.02)
    assert answer["verdict"] == "no measurable gain: ship exact Phong"


def test_where_exact_phong_does_not_fit_it_is_not_what_to_ship(stored: Stored, small_rows: pd.DataFrame) -> None:
    """In float16 the dot product's rounding alone breaks a budget that the difference form keeps."""
    run = stored(RUN, ratio=barely)
    answer = recommend(run, alpha=50, max_error=0.03, precision="float16")
    assert answer["choices"]
    assert answer["verdict"].endswith("exact Phong is not within the budget")


def test_of_tied_times_the_more_accurate_formula_is_named_and_the_other_beside_it(stored: Stored) -> None:
    def ratio(row: Any) -> float:
        return 0.3 if (row.approximation, row.gamma) == ("lyon", 4) else 0.302 if row.approximation == "lyon" else 0.9

    run = stored(RUN, ratio=ratio)
    answer = recommend(run, alpha=10, max_error=0.2)
    best, other = answer["choices"]
    assert best["ratio"] > other["ratio"]
    assert best["max_abs"] < other["max_abs"]
    assert best["ratio"] <= other["ratio_high"]
    assert answer["verdict"] == f"{best['name']} and {other['name']} are tied in time: the first errs less"
    (group,) = [one for one in verdict(Choices.of(run), 0.2)["groups"] if 10.0 in one["alphas"]]
    assert (group["name"], group["tied"]) == (best["name"], other["name"])


def test_without_times_the_least_sampled_errors_are_told(stored: Stored, small_rows: pd.DataFrame) -> None:
    found = verdict(Choices.of(stored(RUN, timed=False)))
    assert not found["timed"]
    rows = small_rows[(small_rows["stratum"] == "highlight") & small_rows["gated"] & (small_rows["alpha"] == 50.0)]
    rows = rows[(rows["precision"] == "float32") & (rows["approximation"] != "phong") & (rows["space"] == "reflect")]
    rows = rows[(rows["truth"] == "angle") & (rows["length_error"] == 0) & (rows["recipe"] == "pair")]
    assert found["groups"][-1]["bound"] == rows["max_abs"].min()
    assert found["groups"][-1]["ratio"] is None


@pytest.mark.parametrize("precision", ["float32", "float16"])
def test_it_is_told_for_the_precision_of_the_run(stored: Stored, small_rows: pd.DataFrame, precision: str) -> None:
    rows = small_rows[small_rows["precision"].isin([precision, "exact"])]
    found = verdict(Choices.of(stored(RUN, accuracy=rows)), 0.1)
    assert (found["precision"], found["timed_precision"], found["timed"]) == (precision, "float32", True)


@pytest.mark.parametrize("inputs", ["vectors", "cosine"])
def test_who_holds_a_cosine_alone_is_given_formulas_of_it(stored: Stored, inputs: str) -> None:
    answer = recommend(stored(RUN), alpha=50, max_error=0.05, precision="float16", inputs=inputs)
    named = [*answer["choices"], *filter(None, [answer["nearest_miss"]])]
    assert all(choice["lambda"] in ("dot", "none") for choice in named) == (inputs == "cosine")
    # half a step below 1 times the slope of the lobe: 50 / 4096, of 255
    assert any("3.1 8-bit codes" in note for note in answer["notes"]) == (inputs == "cosine")
