"""The tables and the words of the report, on runs small enough to check by hand."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from phongbench.analysis.rows import Rows, nearest
from phongbench.results.schema import RAW
from phongbench_reports import text
from phongbench_reports.page import provenance, unmeasured
from phongbench_reports.reproduce import reproduce
from phongbench_reports.table import Absent, Table
from phongbench_reports.tables.verdict import census, verdict, worst

#: a formula that fits a code at the wide lobe only, one that fits at both, and what it is called
COARSE = {"approximation": "lyon", "lambda_form": "dot", "gamma": 8, "beta_policy": "minimax"}
FINE = COARSE | {"gamma": 32}
PHONG = {"approximation": "phong"}
CELL = {"space": "reflect", "beta_policy": "none", "lambda_form": "none", "gamma": None, "precision": "float32"}
ROW = {
    **CELL,
    "alpha": 50.0,
    "gated": True,
    "stratum": "highlight",
    "perturbation": "none",
    "length_error": 0.0,
    "truth": "angle",
    "samples": 1000,
    "coverage": "sampled",
    "nonfinite": 0,
    "above_one": 0,
    "negative": 0,
}


def tiny(path: Path, made_up: Callable[..., Any]) -> Any:
    """Two formulas and exact Phong at two exponents; the coarse one fits a code only at the wide lobe."""
    accuracy = pd.DataFrame(
        [
            {**ROW, **formula, "alpha": alpha, "max_abs": error, "codes_8bit": 255 * error}
            for formula, alpha, error in [
                (PHONG, 10.0, 1e-7),
                (PHONG, 50.0, 1e-7),
                (COARSE, 10.0, 0.003),
                (COARSE, 50.0, 0.0135),
                (FINE, 10.0, 0.0005),
                (FINE, 50.0, 0.001),
            ]
        ]
    ).astype({"gamma": "Int64"})
    times = [
        (PHONG, (1.0, 1.0, 1.0)),
        (COARSE, (0.2, 0.19, 0.21)),
        (FINE, (0.4, 0.38, 0.42)),
        ({"approximation": "aa-twin"}, (1.0, 0.99, 1.01)),
    ]
    timing = pd.DataFrame(
        [
            {
                **CELL,
                **formula,
                "beta_policy": "none",
                "working_set": "l1",
                "threads": 1,
                "ns_min": 2 * ratio,
                "ns_median": 2 * ratio,
                "ratio": ratio,
                "ratio_low": low,
                "ratio_high": high,
                "verdict": "unresolved",
                "rounds": 24,
                "dot_ratio": 3.0,
                "bandwidth_fraction": 0.1,
            }
            for formula, (ratio, low, high) in times
        ]
    ).astype({"gamma": "Int64"})
    made = made_up(path, alphas=(50.0,), gammas=(8,), precisions=("float32",))
    return type(made)(path, made.manifest, accuracy.assign(**RAW), timing.assign(**RAW), made.worst.iloc[:0])


def test_the_verdict_names_the_cheapest_formula_within_the_budget(made_up: Callable[..., Any], tmp_path: Path) -> None:
    table = verdict(Rows(tiny(tmp_path, made_up)), "float32", 1 / 255, "1/255")
    assert isinstance(table, Table)
    coarse, fine = "lyon:dot:8:minimax", "lyon:dot:32:minimax"
    assert [(row[:2], row[3:5]) for row in table.rows] == [
        (("10", coarse), ("0.400", "5 ×")),
        (("50", fine), ("0.800", "2.50 ×")),
    ]
    assert table.rows[0][5:] == ("4.76 to 5.26", "phong (slower)")
    assert table.rows[1][6] == "phong (slower)"
    assert (
        f"faster than exact Phong at 2 of 2 exponents; the largest gain is 5 times, {coarse} at α = 10"
        in table.takeaway.replace("\u00a0", " ")
    )
    assert table.data["gamma"].tolist() == [8, 32]


def test_the_verdict_decides_by_the_bound_and_not_by_samples(made_up: Callable[..., Any], tmp_path: Path) -> None:
    study = Rows(tiny(tmp_path, made_up))
    table = verdict(study, "float32", 1 / 255, "1/255")
    assert isinstance(table, Table)
    rows = text.records(table.data)
    assert all(row["error"] < row["bound"] <= 1 / 255 for row in rows)
    assert [row[2] for row in table.rows] == [text.number(255 * row["bound"]) for row in rows]
    # 0.0135 was sampled at alpha 50, where the formula may err by more: between the two it is not within
    between = verdict(study, "float32", 0.01355, "0.01355")
    assert isinstance(between, Table)
    assert between.rows[1][1] == "lyon:dot:32:minimax"


def test_a_budget_that_nothing_meets_shows_the_nearest_miss(made_up: Callable[..., Any], tmp_path: Path) -> None:
    run = tiny(tmp_path, made_up)
    run = type(run)(
        run.path, run.manifest, run.accuracy[run.accuracy["gamma"].eq(8).fillna(False)], run.timing, run.worst
    )
    table = verdict(Rows(run), "float32", 1e-3, "1/1000")
    assert isinstance(table, Table)
    assert table.rows[0][1] == "nothing fits"
    assert table.rows[0][-1].startswith("nearest miss: lyon:dot:8:minimax, up to 0.8")
    assert "at 0 of 2 exponents" in table.takeaway


def test_an_untimed_precision_tells_what_is_accurate_enough(made_up: Callable[..., Any], tmp_path: Path) -> None:
    study = Rows(tiny(tmp_path, made_up))
    assert isinstance(verdict(study, "float64", 1 / 255, "1/255"), Absent)
    study.run.timing["precision"] = "float64"
    table = verdict(Rows(study.run), "float32", 1 / 255, "1/255")
    assert isinstance(table, Table)
    assert "Nothing was timed at float32" in table.takeaway
    assert table.rows[1] == ("50", "lyon:dot:32:minimax", "1 of 2", "lyon:dot:32:minimax", "0.255")
    assert "sampled below 1/255" in table.headings[1]


def test_the_census_counts_what_the_rows_count(run: Any) -> None:
    table = census(Rows(run))
    assert isinstance(table, Table)
    rows = run.accuracy[run.accuracy["truth"] == "angle"]
    for column in ("nonfinite", "above_one", "negative", "excluded"):
        assert table.data[column].sum() == rows[column].sum()


def test_a_clean_run_has_an_empty_census(made_up: Callable[..., Any], tmp_path: Path) -> None:
    assert isinstance(census(Rows(tiny(tmp_path, made_up))), Absent)


def test_worst_inputs_are_hex_and_come_with_their_command(run: Any) -> None:
    table = worst(Rows(run))
    assert isinstance(table, Table)
    assert len(table.data) == len(table.rows)
    assert f"all {len(run.worst)} in the run's worst.parquet" in table.basis
    assert len(table.details) == len(table.rows)
    for a, b, command in table.details:
        assert b.startswith("b = (")
        assert [float.fromhex(part) for part in a.removeprefix("a = (").removesuffix(")").split(", ")] == [
            0.0,
            0.0,
            1.0,
        ]
        assert shlex.split(command)[:2] == ["phongbench", "run"]
    errors = table.data["error"].abs().tolist()
    assert errors == sorted(errors, reverse=True)


def test_the_command_names_every_value_once_and_is_safe_in_a_shell(run: Any) -> None:
    rows = run.accuracy[run.accuracy["alpha"].isin([10.0, 50.0])].head(400)
    rows = rows.assign(approximation="it's; rm -rf")
    words = shlex.split(reproduce(Rows(run), rows))
    assert words[words.index("--only") + 1] == "it's; rm -rf"
    assert words[words.index("--alpha") + 1] == "10"
    assert words[words.index("--seed") + 1] == "20250101"
    assert words[words.index("--samples") + 1] == "131072"


def test_provenance_holds_no_times(run: Any) -> None:
    run.manifest["provenance"]["started"] = "2025-01-01T00:00:00"
    try:
        rows = dict(provenance(Rows(run)))
    finally:
        del run.manifest["provenance"]["started"]
    assert rows["cpu.model"] == "Example CPU"
    assert rows["command"] == "phongbench run"
    assert rows["seed"] == "20250101"
    assert "started" not in rows
    assert list(rows)[:5] == ["code", "run", "schema", "seed", "state"]


def test_what_was_not_measured_is_computed_from_the_rows(run: Any) -> None:
    told = " ".join(unmeasured(Rows(run)))
    assert "float64" in told
    assert "mesh" in told
    assert "lower bound" in told
    assert "float32" not in told


@pytest.mark.parametrize(
    ("value", "written"),
    [
        (0.02986, "0.0299"),
        (0, "0"),
        (131072, "131\u202f072"),
        (1.7e-5, "1.70×10⁻⁵"),
        (3.0, "3"),
        (None, "–"),
        (12.34, "12.3"),
        (float("nan"), "–"),
        (float("inf"), "not finite"),
        (-0.5, "-0.500"),
        (2.5e7 + 0.5, "2.50×10⁷"),
        (29009.4, "29\u202f009"),
    ],
)
def test_numbers_are_written_one_way(value: Any, written: str) -> None:
    assert text.number(value) == written


def test_words() -> None:
    cell = {"approximation": "lyon", "lambda_form": "cross", "gamma": 8, "beta_policy": "minimax", "space": "half"}
    assert text.label(cell) == "lyon:cross:8:minimax@half"
    assert text.label({"approximation": "schlick", "gamma": pd.NA}) == "schlick"
    assert text.label({"approximation": "blinn"}) == "blinn"  # where no pair is said, its own
    assert text.label({**cell, "approximation": "mine"}) == "mine:cross:8:minimax@half"
    assert text.alpha_is(50.0) == "α\u00a0=\u00a050"
    assert text.gamma_is(8.0) == "γ\u00a0=\u00a08"
    assert text.share(0.125) == "12.5\u00a0%"
    assert text.ratio({"ratio": 0.5, "ratio_low": 0.45, "ratio_high": 0.55}) == "0.500 (0.450 to 0.550)"
    assert text.ratio({"ratio": None}) == "–"
    assert text.listed([]) == "none"
    assert text.listed(["a", "b", "c"]) == "a, b and c"
    assert text.percent(-0.000175) == "−0.0175\u00a0%"
    assert [text.power_of_ten(value) for value in (1e-5, 0.01, 1.0, 1e4, 2.0)] == ["10⁻⁵", "0.01", "1", "10⁴", ""]
    assert nearest([10.0, 40.0, 64.0], 50.0) == 40.0
    assert nearest([5.0, 20.0], 10.0) == 5.0
