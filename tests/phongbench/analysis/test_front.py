"""The front and the budget answer, on runs small enough to check by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from phongbench.analysis.choice import choose
from phongbench.analysis.choices import Choices
from phongbench.analysis.front import COLUMNS, errors_at, framed, front, judged, records, states, worst_of
from phongbench.analysis.kernel_times import multiplications
from phongbench.errors import InputError
from phongbench.results.records import Records
from phongbench.results.schema import CELL, INPUT, RAW

ACCURACY = {
    "lambda_form": "dot",
    "space": "reflect",
    "beta_policy": "taylor",
    "alpha": 50.0,
    "precision": "float32",
    "gated": True,
    "stratum": "highlight",
    "perturbation": "none",
    "length_error": 0.0,
    "truth": "angle",
    **RAW,
}
TIMING = {"lambda_form": "dot", "space": "reflect", "beta_policy": "none", "precision": "float32", "threads": 1} | RAW


def accuracy_rows(*rows: dict[str, Any]) -> pd.DataFrame:
    frame = pd.DataFrame([{**ACCURACY, **row} for row in rows])
    frame["rms"] = frame["max_abs"] / 3.0
    return frame.astype({"gamma": "Int64"})


def timing_rows(*rows: dict[str, Any]) -> pd.DataFrame:
    frame = pd.DataFrame([{**TIMING, "working_set": "l1", "ns_min": row["ratio"] * 2.0, **row} for row in rows])
    frame["ratio_low"] = frame["ratio"] - frame.pop("half")
    frame["ratio_high"] = 2 * frame["ratio"] - frame["ratio_low"]
    return frame.astype({"gamma": "Int64"})


@pytest.fixture
def accuracy() -> pd.DataFrame:
    return accuracy_rows(
        {"approximation": "lyon", "gamma": 4, "max_abs": 0.068},
        {"approximation": "lyon", "gamma": 4, "max_abs": 0.031, "beta_policy": "minimax"},
        {"approximation": "lyon", "gamma": 16, "max_abs": 0.012},
        {"approximation": "lyon", "gamma": 64, "max_abs": 0.0012},
        {"approximation": "gaussian", "gamma": None, "max_abs": 0.0025, "lambda_form": "difference"},
        {"approximation": "schlick", "gamma": None, "max_abs": 0.2, "lambda_form": "none", "beta_policy": "none"},
        {"approximation": "lyon", "gamma": 4, "max_abs": 0.5, "length_error": 0.01, "perturbation": "a"},
        {"approximation": "lyon", "gamma": 4, "max_abs": 1.0, "gated": False, "stratum": "grazing"},
        {"approximation": "untimed", "gamma": None, "max_abs": 0.0},
    )


@pytest.fixture
def timing() -> pd.DataFrame:
    return timing_rows(
        {"approximation": "lyon", "gamma": 4, "ratio": 0.30, "half": 0.01},
        {"approximation": "lyon", "gamma": 16, "ratio": 0.34, "half": 0.01},
        {"approximation": "lyon", "gamma": 64, "ratio": 0.52, "half": 0.04},
        {"approximation": "gaussian", "gamma": None, "ratio": 0.50, "half": 0.04, "lambda_form": "difference"},
        {"approximation": "schlick", "gamma": None, "ratio": 0.40, "half": 0.01, "lambda_form": "none"},
        {"approximation": "copy", "gamma": None, "ratio": 0.1, "half": 0.01, "lambda_form": "none"},
    )


def fronted(accuracy: pd.DataFrame, timing: pd.DataFrame, **asked: Any) -> pd.DataFrame:
    """The front as a table."""
    return framed(front(Records.of(accuracy), Records.of(timing), **asked))


def state_of(cells: pd.DataFrame) -> dict[tuple[str, int, str], str]:
    return {
        (row.approximation, 0 if pd.isna(row.gamma) else int(row.gamma), row.beta_policy): row.state
        for row in cells.itertuples()
    }


def test_a_cell_is_off_only_where_a_rival_is_certainly_faster(accuracy: pd.DataFrame, timing: pd.DataFrame) -> None:
    cells = fronted(accuracy, timing, alpha=50)
    assert list(cells.columns) == COLUMNS
    assert state_of(cells) == {
        ("lyon", 4, "taylor"): "off",  # the same kernel with minimax slope errs less
        ("lyon", 4, "minimax"): "on",
        ("lyon", 16, "taylor"): "on",
        ("schlick", 0, "none"): "off",
        ("gaussian", 0, "taylor"): "unresolved",  # lyon 64 errs less and may be as fast
        ("lyon", 64, "taylor"): "on",  # nothing errs less
    }
    assert list(cells["ratio"]) == sorted(cells["ratio"])
    assert cells.set_index("approximation").loc["gaussian", "ns"] == pytest.approx(1.0)


def test_equal_errors_with_overlapping_times_leave_both_unresolved() -> None:
    assert states([0.1, 0.1], [0.4, 0.45], [0.5, 0.55], [0, 1]) == ["unresolved", "unresolved"]
    assert states([0.1, 0.1], [0.4, 0.6], [0.5, 0.7], [0, 1]) == ["on", "off"]
    assert states([0.0, 0.1], [0.4, 0.4], [0.5, 0.5], [7, 7]) == ["on", "off"]
    assert states([], [], [], []) == []


def test_the_cheapest_cell_within_the_budget_names_its_rival_and_the_miss(
    accuracy: pd.DataFrame, timing: pd.DataFrame
) -> None:
    cells = fronted(accuracy, timing, alpha=50)
    choice = choose(records(cells), 1 / 255)
    assert choice.best is not None
    assert choice.runner_up is not None
    assert choice.nearest_miss is not None
    # their times are tied, and lyon 64 errs less
    assert (choice.best["approximation"], choice.runner_up["approximation"]) == ("lyon", "gaussian")
    assert not choice.resolved
    assert (choice.nearest_miss["approximation"], choice.nearest_miss["gamma"]) == ("lyon", 16)

    wide = choose(records(cells), 0.05)
    assert wide.best is not None
    assert (wide.best["gamma"], wide.best["beta_policy"], wide.resolved) == (4, "minimax", True)

    none = choose(records(cells), 1e-6)
    assert none.best is None
    assert none.nearest_miss is not None
    assert none.nearest_miss["gamma"] == 64


@pytest.mark.parametrize(
    ("asked", "known"),
    [
        ({"alpha": 51}, "50"),
        ({"metric": "ulps"}, "max_abs"),
        ({"stratum": "highlights"}, "grazing"),
        ({"precision": "float8"}, "float32"),
        ({"working_set": "l3"}, "l1"),
    ],
)
def test_unknown_names_list_the_known_ones(
    accuracy: pd.DataFrame, timing: pd.DataFrame, asked: dict[str, Any], known: str
) -> None:
    with pytest.raises(InputError, match=known):
        fronted(accuracy, timing, **{"alpha": 50, **asked})


def test_a_run_without_timing_has_an_empty_front(accuracy: pd.DataFrame, timing: pd.DataFrame) -> None:
    cells = fronted(accuracy, timing.iloc[:0], alpha=50)
    assert cells.empty
    assert choose(records(cells), 0.1).best is None


def test_other_metrics_rank_by_their_own_column(accuracy: pd.DataFrame, timing: pd.DataFrame) -> None:
    cells = fronted(accuracy, timing, alpha=50, metric="rms")
    assert cells["error"].max() == pytest.approx(0.2 / 3)


def test_an_integer_power_is_timed_by_one_that_multiplies_at_least_as_often(timing: pd.DataFrame) -> None:
    alphas = (10.0, 50.0, 64.0, 128.0, 200.0, 10.5)
    powers = {"approximation": "integer-power", "gamma": None, "max_abs": 0.0, "lambda_form": "none"}
    accuracy = accuracy_rows(*({**powers, "alpha": alpha} for alpha in alphas))
    own = {"gamma": None, "lambda_form": "none", "half": 0.01}
    timed = timing_rows(
        {**own, "approximation": "integer-power", "ratio": 0.4},
        {**own, "approximation": "integer-power-64", "ratio": 0.3},
    )
    both = pd.concat([timing, timed], ignore_index=True)
    found = {alpha: fronted(accuracy, both, alpha=alpha)["ratio"].tolist() for alpha in alphas}
    # 10 takes 4 multiplications, 64 takes 6, 50 and 128 take 7, 200 takes 9; a fractional one has none
    assert found == {10.0: [0.3], 50.0: [0.4], 64.0: [0.3], 128.0: [0.4], 200.0: [], 10.5: []}
    assert [multiplications(exponent) for exponent in (1, 2, 3, 10, 64, 50, 1000)] == [0, 1, 2, 4, 6, 7, 14]


def test_an_empty_front_has_the_types_of_a_full_one(accuracy: pd.DataFrame, timing: pd.DataFrame) -> None:
    full, empty = fronted(accuracy, timing, alpha=50), fronted(accuracy, timing.iloc[:0], alpha=50)
    assert empty.dtypes.to_dict() == full.dtypes.to_dict()


def test_fronts_made_together_are_those_made_alone(accuracy: pd.DataFrame, timing: pd.DataFrame) -> None:
    """Errors fall with the exponent at some formulas and rise at others, so that the fronts differ; one is empty."""
    lyon = accuracy["approximation"] == "lyon"
    other = accuracy.assign(alpha=200.0, max_abs=accuracy["max_abs"] * np.where(lyon, 3.0, 0.1))
    untimed = accuracy[accuracy["approximation"] == "untimed"].assign(alpha=10.0)
    swept = pd.concat([accuracy.iloc[::-1], other, untimed], ignore_index=True)
    together = Choices(Records.of(swept), Records.of(timing), Records.none("costs"))
    assert together.alphas == [10.0, 50.0, 200.0]
    fronts = {alpha: framed(together.front(alpha, "float32")) for alpha in together.alphas}
    for alpha, cells in fronts.items():
        alone = swept[swept["alpha"] == alpha].sample(frac=1.0, random_state=3)
        pd.testing.assert_frame_equal(cells, fronted(alone, timing.iloc[::-1], alpha=alpha))
    assert fronts[10.0].empty
    assert state_of(fronts[50.0]) != state_of(fronts[200.0])


def test_what_has_no_error_or_interval_is_no_part_of_a_front_of_times_but_stands_beside_costs(
    accuracy: pd.DataFrame, timing: pd.DataFrame
) -> None:
    accuracy.loc[accuracy["approximation"] == "schlick", "max_abs"] = np.nan
    timing.loc[timing["approximation"] == "gaussian", "ratio_low"] = np.nan
    assert set(fronted(accuracy, timing, alpha=50)["approximation"]) == {"lyon"}
    counted = {"ratio": 0.5, "ratio_low": 0.5, "ratio_high": 0.5, "ns": None}
    found = judged([row | counted for row in errors_at(Records.of(accuracy), alpha=50)])
    assert [row["error"] for row in found if row["approximation"] == "schlick"] == [None]
    assert found[-1]["error"] is None


def test_records_hold_pythons_own_values_and_none_for_what_is_missing() -> None:
    frame = pd.DataFrame(
        {
            "text": pd.Series(["a", None], dtype="str"),
            "whole": pd.Series([1, None], dtype="Int64"),
            "real": [0.5, np.nan],
            "flag": [True, False],
            "kind": pd.Categorical(["b", None]),
            "mixed": pd.Series([np.float64(0.25), np.nan], dtype=object),
        }
    )
    first, second = records(frame)
    assert first == {"text": "a", "whole": 1, "real": 0.5, "flag": True, "kind": "b", "mixed": 0.25}
    assert [type(value) for value in first.values()] == [str, int, float, bool, str, float]
    assert second == dict.fromkeys(first) | {"flag": False}
    assert records(frame.iloc[:0]) == []


def test_of_several_inputs_the_worst_counts_and_a_cell_that_lacks_one_is_left_out() -> None:
    def row(cell: str, given: str, error: float) -> dict[str, object]:
        return {**dict.fromkeys([*CELL, *INPUT], "same"), CELL[0]: cell, INPUT[0]: given, "error": error}

    rows = [row("a", "one", 2.0), row("a", "other", 1.0), row("b", "one", 3.0)]
    assert [(one[CELL[0]], one["error"]) for one in worst_of(rows)] == [("a", 2.0)]
    assert [one["error"] for one in worst_of(one for one in rows if one[INPUT[0]] == "one")] == [2.0, 3.0]
