"""The budget answer on stored runs of the real engine with made-up times; from the laws: test_law_bounds.py."""

import json
from collections.abc import Callable
from typing import Any

import pandas as pd
import pytest

from phongbench.analysis.error_budget import number
from phongbench.analysis.front import points
from phongbench.analysis.recommend import recommend
from phongbench.errors import InputError, UnknownNameError
from phongbench.results.runs import Run

CODE = 1 / 255
Stored = Callable[..., Run]


def errors(run: Run, choice: dict[str, Any], **where: Any) -> pd.DataFrame:
    """The gated accuracy rows of a choice."""
    rows = run.accuracy
    wanted = {
        "approximation": choice["approximation"],
        "lambda_form": choice["lambda"],
        "space": choice["space"],
        "beta_policy": choice["beta_policy"],
        "precision": choice["precision"],
        "gated": True,
        "truth": "angle",
    }
    for column, value in (wanted | where).items():
        rows = rows[rows[column] == value]
    return rows[rows["gamma"].isna() if choice["gamma"] is None else rows["gamma"] == choice["gamma"]]


def test_the_cheapest_formula_within_the_budget_is_chosen(stored: Stored) -> None:
    run = stored()
    found = recommend(run, alpha=50, max_error="0.05")
    best, following = found["choices"]
    assert (best["name"], best["ratio"]) == ("lyon:dot:8", pytest.approx(0.24))
    assert following["ratio"] >= best["ratio"]
    assert following["max_abs"] <= 0.05
    assert best["beta"] == 50 / 8
    unit = errors(run, best, alpha=50.0)
    unit = unit[unit["stratum"].isin(["highlight", "uniform", "peak"])]
    assert best["max_abs"] == unit["max_abs"].max()
    assert found["nearest_miss"]["name"] == "lyon:dot:4"
    assert found["nearest_miss"]["bound"] > 0.05
    assert (found["basis"], found["run"]) == ("run", run.id)


def proven(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows with those of a search, a tenth above the samples, and with certified ones."""
    own = rows[rows["gated"].astype(bool) & (rows["stratum"] == "highlight")]
    searched = own.assign(stratum="vectors", coverage="searched", max_abs=1.1 * own["max_abs"])
    certified = own[own["precision"] == "float32"].assign(
        stratum="cosines",
        coverage="certified",
        precision="exact",
        samples=0,
        max_abs=1.002 * own["model_max"],
        model_max=1.002 * own["model_max"],
    )
    return pd.concat([rows, searched, certified], ignore_index=True)


def test_what_a_search_found_and_what_was_proven_is_told(stored: Stored, small_rows: pd.DataFrame) -> None:
    run = stored(accuracy=proven(small_rows))
    best = recommend(run, alpha=50, max_error=0.05)["choices"][0]
    assert (best["name"], best["coverage"], best["error_coverage"]) == ("lyon:dot:8", "certified", "searched")
    assert best["max_abs"] == errors(run, best, alpha=50.0, stratum="vectors")["max_abs"].item()
    model = errors(run, best, alpha=50.0, stratum="highlight")["model_max"].item()
    assert best["certified"] == 1.002 * model
    assert f"{best['max_abs']:.3g} was the worst that a search found" in best["why"]
    assert f"the formula alone errs by at most {1.002 * model:.3g}, proven" in best["why"]
    # an exponent between two measured ones is vouched for by both, so both bounds are needed
    between = recommend(run, alpha=30, max_error=0.5)["choices"][0]
    assert between["certified"] >= errors(run, between, alpha=50.0, stratum="highlight")["model_max"].item()
    lacking = proven(small_rows).query("not (coverage == 'certified' and alpha == 10)")
    assert (
        recommend(stored("other-run-1", accuracy=lacking), alpha=30, max_error=0.5)["choices"][0]["certified"] is None
    )


def test_the_answer_is_json_with_the_keys_of_the_contract(stored: Stored) -> None:
    found = recommend(stored(), alpha=50, max_error="1/255")
    keys = ["approximation", "lambda", "gamma", "beta", "max_abs", "coverage", "ns", "ratio", "ratio_low", "ratio_high"]
    assert {*keys, "why"} <= found["choices"][0].keys()
    assert json.loads(json.dumps(found, allow_nan=False)) == found


def test_what_is_promised_is_proven_and_what_was_sampled_is_told_beside_it(stored: Stored) -> None:
    answer = recommend(stored(), alpha=50, max_error=0.05)
    best = answer["choices"][0]
    assert (best["coverage"], best["error_coverage"]) == ("certified", "sampled")
    assert f"errs by at most {best['bound']:.3g}" in best["why"]
    assert "at alpha 50, proven; " in best["why"]
    assert "holds in float32 for all pairs of vectors made unit as shaders do" in answer["notes"][-1]
    assert f"{best['max_abs']:.3g} was the largest of 6,000 samples a stratum" in best["why"]
    assert "surely slower" in best["why"]


def test_a_budget_between_samples_and_bound_is_not_known_to_be_met(stored: Stored) -> None:
    run = stored()
    best = recommend(run, alpha=50, max_error=0.05)["choices"][0]
    assert best["max_abs"] < best["bound"] < 1.02 * best["max_abs"]
    tight = recommend(run, alpha=50, max_error=0.5 * (best["max_abs"] + best["bound"]))
    assert best["name"] not in {choice["name"] for choice in tight["choices"]}
    # one of another precision, whose rounding is far larger, is bounded likewise
    half = recommend(run, alpha=50, max_error=0.05, precision="float16")["choices"][0]
    assert half["max_abs"] < half["bound"] <= 0.05


def test_a_range_of_exponents_is_proven_at_some_and_says_so(stored: Stored) -> None:
    best = recommend(stored(), alpha="10..50", max_error=0.2)["choices"][0]
    assert (best["coverage"], best["name"]) == ("searched", "lyon:dot:4")
    assert "exponents of the range, with room for those between" in best["why"]
    each = [recommend(stored(f"other-run-{a}"), alpha=a, max_error=0.2)["choices"][0] for a in (11, 37)]
    assert all(best["bound"] >= one["bound"] for one in each if one["name"] == best["name"])


def test_of_a_formula_that_is_not_here_nothing_is_promised(stored: Stored, small_rows: pd.DataFrame) -> None:
    own = small_rows[small_rows["approximation"] == "lyon"].assign(approximation="rational")
    run = stored(
        accuracy=pd.concat([small_rows, own], ignore_index=True),
        ratio=lambda row: 0.1 if row.approximation == "rational" else 0.5,
    )
    found = recommend(run, alpha=50, max_error=0.05)
    assert "rational" not in {choice["approximation"] for choice in found["choices"]}
    assert any("rational: only sampled" in note for note in found["notes"])
    alone = recommend(stored("other-run-1", accuracy=own), alpha=50, max_error=0.05)
    assert alone["choices"] == []
    assert alone["nearest_miss"]["bound"] is None
    assert "nothing is promised" in alone["nearest_miss"]["why"]


def test_overlapping_intervals_are_not_called_faster(stored: Stored) -> None:
    found = recommend(stored(ratio=lambda row: 0.2), alpha=50, max_error=0.05)
    assert "not settled" in found["choices"][0]["why"]


def test_nothing_within_the_budget_leaves_the_nearest_miss(stored: Stored) -> None:
    found = recommend(stored(), alpha=50, max_error=1e-12)
    assert found["choices"] == []
    assert found["nearest_miss"]["approximation"] == "phong"
    assert "beyond" in found["nearest_miss"]["why"]


def test_the_worst_exponent_of_a_range_counts(stored: Stored) -> None:
    run = stored()
    whole = recommend(run, alpha="10..50", max_error=0.05)["choices"][0]
    each = [recommend(run, alpha=alpha, max_error=0.05)["choices"][0] for alpha in (10, 50)]
    assert whole["max_abs"] == max(c["max_abs"] for c in each if c["name"] == whole["name"])
    assert whole["beta"] is None


def test_neighbours_answer_for_an_exponent_between_and_it_is_said(stored: Stored) -> None:
    run = stored()
    between = recommend(run, alpha=30, max_error=0.05)
    assert between["choices"][0]["max_abs"] == recommend(run, alpha="10,50", max_error=0.05)["choices"][0]["max_abs"]
    assert any("not measured" in note and "10, 50" in note for note in between["notes"])


@pytest.mark.parametrize(
    ("alpha", "said"),
    [
        ("10..50", "is judged by the worst of the 2 exponents measured there"),
        ("20", "alpha 20 was not measured: its neighbours vouch for it, by the worst of alpha 10, 50"),
        ("20,30", "alpha 20 and 30 were not measured: their neighbours vouch for them"),
        ("10,50", None),
    ],
)
def test_which_exponents_vouch_for_those_asked_is_told(stored: Stored, alpha: str, said: str | None) -> None:
    notes = recommend(stored(), alpha=alpha, max_error=0.5)["notes"]
    told = [note for note in notes if "vouch" in note or "judged by the worst" in note]
    assert [(said or "") in note for note in told] == ([True] if said else [])
    assert not [note for note in notes if "the formula is not here" in note]


@pytest.mark.parametrize("alpha", [5, 51, "10..60", "50,1000"])
def test_an_exponent_outside_the_run_is_refused_with_the_command_that_measures_it(stored: Stored, alpha: Any) -> None:
    with pytest.raises(InputError, match="phongbench run --alpha"):
        recommend(stored(), alpha=alpha, max_error=0.05)


def test_wrong_lengths_up_to_the_budgets_count_in_every_direction(stored: Stored) -> None:
    run = stored()
    found = recommend(run, alpha=10, max_error=0.09, length_error=0.009)
    best = found["choices"][0]
    assert "0.01 wrong" in found["notes"][0]
    rows = errors(run, best, alpha=10.0)
    rows = rows[
        (rows["stratum"].isin(["highlight", "uniform", "peak", "lengths"]))
        & (rows["length_error"].abs() <= 0.01)
        & rows["perturbation"].isin(["none", "a", "both", "opposite"])
    ]
    assert set(rows["perturbation"]) == {"none", "a", "both", "opposite"}
    assert best["max_abs"] == rows["max_abs"].max()
    assert best["max_abs"] > recommend(run, alpha=10, max_error=0.09)["choices"][0]["max_abs"]


@pytest.mark.parametrize(("wrong", "judged"), [(0.01, None), (0.00999, 0.01), (0.0101, 0.05), (0.05, None)])
def test_lengths_are_judged_at_the_nearest_size_that_is_not_less_and_that_is_told(
    stored: Stored, wrong: float, judged: float | None
) -> None:
    run = stored()
    found = recommend(run, alpha=10, max_error=0.9, length_error=wrong)
    told = [note for note in found["notes"] if "lengths are judged" in note]
    assert [f"judged at {judged:g} wrong" in note for note in told] == ([] if judged is None else [True])
    best = found["choices"][0]
    rows = errors(run, best, alpha=10.0, stratum="lengths")
    rows = rows[
        (rows["length_error"].abs() <= (judged or wrong)) & rows["perturbation"].isin(["a", "both", "opposite"])
    ]
    assert best["max_abs"] == rows["max_abs"].max()


def test_lengths_that_were_not_measured_are_refused(stored: Stored, small_rows: pd.DataFrame) -> None:
    with pytest.raises(InputError, match=r"0\.1, as at a mesh angle of 51\.7 degrees, not 0\.5"):
        recommend(stored(), alpha=10, max_error=0.1, length_error=0.5)
    unit = stored("20260102-000000-0123abcd", accuracy=small_rows[small_rows["stratum"] != "lengths"])
    with pytest.raises(InputError, match="no vectors of wrong length"):
        recommend(unit, alpha=10, max_error=0.1, length_error=0.01)


def test_cells_with_values_that_are_not_finite_never_qualify(stored: Stored, small_rows: pd.DataFrame) -> None:
    rows = small_rows.copy()
    bad = (rows["approximation"] == "lyon") & (rows["stratum"] == "uniform")
    rows.loc[bad, "nonfinite"] = 1
    found = recommend(stored(accuracy=rows), alpha=50, max_error=0.05)
    assert {c["approximation"] for c in found["choices"]} <= {"gaussian", "phong"}


def test_where_no_formula_was_measured_on_every_input_none_is_named(stored: Stored, small_rows: pd.DataFrame) -> None:
    places = small_rows.groupby(["approximation", "lambda_form", "gamma"], dropna=False).ngroup()
    rows = small_rows[~((places % 2 == 0) & (small_rows["stratum"] == "uniform"))]
    rows = rows[~((places[rows.index] % 2 == 1) & (rows["stratum"] == "highlight"))]
    run = stored(accuracy=rows)
    with pytest.raises(InputError, match="no formula in float32 was timed"):
        recommend(run, alpha=50, max_error=0.05)
    assert recommend(run, alpha=50, max_error=0.05, target="gcn4")["choices"] == []


def test_half_space_formulas_are_chosen_only_when_asked_for(stored: Stored) -> None:
    run = stored(ratio=lambda row: 0.1 if row.space == "half" else 0.5)
    assert {c["space"] for c in recommend(run, alpha=50, max_error=0.2)["choices"]} == {"reflect"}
    half = recommend(run, alpha=50, max_error=1.1, space="half")
    assert {c["space"] for c in half["choices"]} == {"half"}
    assert all(1 < c["bound"] < 1.001 and c["coverage"] == "certified" for c in half["choices"])
    assert any("at every incidence and azimuth" in note for note in half["notes"])


def test_half_space_formulas_are_refused_by_what_they_err_over_all_configurations(
    stored: Stored, small_rows: pd.DataFrame
) -> None:
    half = recommend(stored(), alpha=50, max_error=0.2, space="half")
    miss = half["nearest_miss"]
    assert not half["choices"]
    rows = small_rows[(small_rows["stratum"] == "configurations") & (small_rows["space"] == "half")]
    rows = rows[
        (rows["alpha"] == 50) & (rows["precision"] == "float32") & (rows["approximation"] == miss["approximation"])
    ]
    assert miss["max_abs"] in set(rows["max_abs"])
    assert miss["max_abs"] > 0.3
    assert f"beyond 0.2 by a factor of {miss['max_abs'] / 0.2:.3g} at least" in miss["why"]
    assert f"{miss['max_abs']:.3g} was the largest of" in miss["why"]


def test_a_run_without_configurations_says_that_its_errors_hold_on_coplanar_vectors(
    stored: Stored, small_rows: pd.DataFrame
) -> None:
    old = stored("20260102-000000-0123abcd", accuracy=small_rows[small_rows["stratum"] != "configurations"])
    found = recommend(old, alpha=50, max_error=0.2, space="half")
    assert not found["choices"]  # what is promised is so of every run
    assert any("coplanar" in note for note in found["notes"])
    told = points(old, alpha=50, space="half")
    assert told["stratum"] == "highlight"
    assert any("coplanar" in note for note in told["notes"])
    run = stored()
    new = points(run, alpha=50, space="half")
    assert new["stratum"] == "configurations"
    assert min(one["error"] for one in new["points"]) > 3 * min(one["error"] for one in told["points"])
    assert points(run, alpha=50)["stratum"] == "highlight"


def test_float16_is_ordered_by_the_times_of_float32_and_says_so(stored: Stored) -> None:
    found = recommend(stored(), alpha=10, max_error=0.2, precision="float16")
    assert found["choices"][0]["precision"] == "float16"
    assert any("emulated" in note for note in found["notes"])


def test_integer_powers_serve_listed_whole_exponents_but_no_range(stored: Stored, small_rows: pd.DataFrame) -> None:
    phong = small_rows[small_rows["approximation"] == "phong"]
    rows = pd.concat([small_rows, phong.assign(approximation="integer-power")], ignore_index=True)
    run = stored(accuracy=rows, ratio=lambda row: 0.1 if row.approximation == "integer-power" else 0.9)
    names = [
        recommend(run, alpha=a, max_error=1e-3)["choices"][0]["approximation"] for a in (50, "10,50", "10..50", 30.5)
    ]
    assert names == ["integer-power", "integer-power", "phong", "phong"]


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"max_error": "1/0"}, "not a number"),
        ({"max_error": "much"}, "not a number"),
        ({"max_error": 0}, "above 0"),
        ({"max_error": "nan"}, "not a number"),
        ({"max_error": -1}, "above 0"),
        ({"length_error": -0.1}, "length error"),
        ({"precision": "float8"}, "float16, float32, float64"),
        ({"precision": "float64"}, "run --precision float64"),
        ({"space": "quarter"}, "reflect, half"),
        ({"working_set": "l3"}, "known: l1"),
    ],
)
def test_bad_input_is_refused_with_its_fix(stored: Stored, asked: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        recommend(stored(), **({"alpha": 50, "max_error": 0.05} | asked))


def test_fractions_are_numbers() -> None:
    assert number("1/255", "e") == number(" 1 / 255 ", "e") == CODE
    assert number("1e-3", "e") == number(0.001, "e") == 0.001


def test_unknown_names_list_the_known_ones() -> None:
    with pytest.raises(UnknownNameError, match="float16"):
        recommend(None, alpha=50, max_error=0.01, precision="half")
