"""Rows without pandas are those that pandas reads: the same values, cuts and order."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import psutil
import pytest

from phongbench.analysis.front import records
from phongbench.analysis.rows import at
from phongbench.errors import CorruptRunError
from phongbench.results import runs
from phongbench.results.records import Records, by, first_of
from phongbench.results.schema import CASE, COVERAGES, TABLES

#: of every kind of column: text, whole numbers with and without missing ones, others, and truths
KINDS = ("approximation", "beta_policy", "alpha", "gamma", "gated", "length_error", "max_abs", "nonfinite", "coverage")


def made_up(count: int, seed: int = 5) -> pd.DataFrame:
    """Accuracy rows of few values, in no order, many of which differ in their coverage only; text and numbers lack."""
    rng = np.random.default_rng(seed)
    few: dict[str, list[Any]] = {
        "str": ["b", "a", "\u00e9", None],
        "float64": [0.5, -1.0, np.nan],
        "bool": [True, False],
    }
    few |= {"int64": [0, 7], "Int64": [8, None, 64]}
    columns = {
        column.name: rng.choice(np.array(few[column.kind], object), count) for column in TABLES["accuracy"].columns
    }
    columns |= {"coverage": rng.choice(COVERAGES, count), "device": rng.choice(["cpu", "gpu"], count)}
    return pd.DataFrame(columns).astype(TABLES["accuracy"].types)


@pytest.fixture(params=["file", "frame"])
def pair(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Records, pd.DataFrame]:
    """The same rows without pandas, from a file or a frame, and with it."""
    frame = made_up(400)
    if request.param == "frame":
        return Records.of(frame), frame
    runs.write_table(tmp_path, "accuracy", frame)
    return Records.read(tmp_path / "accuracy.parquet", "accuracy", {}), frame


CUTS: tuple[dict[str, Any], ...] = (
    {},
    {"approximation": "a"},
    {"approximation": ("a", "\u00e9"), "gated": True},
    {"alpha": 0.5, "gamma": 8},
    {"alpha": (0.5, -1.0), "nonfinite": 7},
    {"approximation": "nowhere"},
    {"approximation": ()},
)


@pytest.mark.parametrize("cut", range(len(CUTS)))
def test_cuts_hold_the_rows_that_pandas_finds(pair: tuple[Records, pd.DataFrame], cut: int) -> None:
    rows, frame = pair
    found, expected = rows.at(**CUTS[cut]), at(frame, **CUTS[cut])
    assert len(found) == len(expected)
    assert found.rows(KINDS) == records(expected[list(KINDS)])
    assert [type(value) for row in found.rows(KINDS) for value in row.values()] == [
        type(value) for row in records(expected[list(KINDS)]) for value in row.values()
    ]
    pd.testing.assert_frame_equal(found.of_frame(frame), expected)
    for name in KINDS:
        assert found.distinct(name) == sorted(expected[name].dropna().unique().tolist())


def test_the_strongest_coverage_is_that_which_pandas_finds(pair: tuple[Records, pd.DataFrame]) -> None:
    rows, frame = pair
    frame = frame.assign(**dict.fromkeys(set(CASE) - {"approximation", "alpha", "gamma"}, frame[CASE[3]].iloc[0]))
    order = frame["coverage"].map(COVERAGES.index).sort_values(kind="stable").index
    expected = frame.loc[order].drop_duplicates(CASE, keep="last").sort_index()
    pd.testing.assert_frame_equal(Records.of(frame).strongest().of_frame(frame), expected)
    alone = rows.at(coverage="searched")
    assert len(alone.strongest()) == len(alone)


def test_two_cuts_together_are_in_the_order_of_the_table(pair: tuple[Records, pd.DataFrame]) -> None:
    rows, frame = pair
    found = rows.at(approximation="a").together(rows.at(gated=True))
    assert found.rows(KINDS) == records(frame[(frame["approximation"] == "a") | frame["gated"]][list(KINDS)])


def test_rows_are_sorted_with_what_is_missing_last_and_the_first_of_each_is_kept() -> None:
    rows = [{"a": None, "b": 1}, {"a": 2, "b": None}, {"a": 2, "b": 0}, {"a": 1, "b": 9}]
    ordered = sorted(rows, key=by(["a", "b"]))
    assert ordered == [rows[3], rows[2], rows[1], rows[0]]
    assert first_of(ordered, ["a"]) == [rows[3], rows[2], rows[0]]


def test_a_run_gives_the_rows_of_its_processor_and_what_older_files_leave_unsaid(tmp_path: Path) -> None:
    frame = made_up(40)
    old = frame.drop(columns=["device", "recipe", "normalise"])
    for name, table in {"new": frame, "old": old}.items():
        (tmp_path / name).mkdir()
        facts = runs.write_table(tmp_path / name, "accuracy", table)
        run = runs.Run(tmp_path / name, {"files": {"accuracy.parquet": facts}})
        columns = [*KINDS, "recipe", "normalise", "device"]
        assert run.records("accuracy").rows(columns) == records(run.accuracy[columns])
        assert run.records("accuracy") is run.records("accuracy")
        assert not run.records("timing")
        assert run.records("timing").distinct("working_set") == []


@pytest.mark.parametrize("fault", ["no table", "a column short", "no file"])
def test_a_table_that_is_not_as_it_was_written_is_told_as_pandas_tells_it(tmp_path: Path, fault: str) -> None:
    file = tmp_path / "accuracy.parquet"
    facts = runs.write_table(tmp_path, "accuracy", made_up(3).drop(columns=["max_abs"] * (fault == "a column short")))
    if fault != "a column short":
        file.write_bytes(b"PAR1") if fault == "no table" else file.unlink()
    run = runs.Run(tmp_path, {"files": {file.name: facts}})
    with pytest.raises(CorruptRunError, match="max_abs" if fault == "a column short" else "cannot be read"):
        run.records("accuracy")
    with pytest.raises(CorruptRunError):
        run.read("accuracy")


@pytest.mark.parametrize("value", ["text", None], ids=["text", "nothing"])
def test_a_column_of_numbers_that_holds_something_else_is_named(tmp_path: Path, value: str | None) -> None:
    made_up(20).assign(alpha=pd.Series([value] * 20, dtype=object)).to_parquet(tmp_path / "accuracy.parquet")
    with pytest.raises(CorruptRunError, match="cannot be read: alpha holds"):
        Records.read(tmp_path / "accuracy.parquet", "accuracy", {}).at(device="cpu")


def test_a_run_that_is_kept_keeps_no_file_open_and_notices_another_in_its_place(tmp_path: Path) -> None:
    file = tmp_path / "accuracy.parquet"
    made_up(20).to_parquet(file)
    kept = Records.read(file, "accuracy", {})
    assert len(kept.rows(["alpha"])) == 20
    assert str(file) not in {opened.path for opened in psutil.Process().open_files()}
    made_up(21).to_parquet(file)
    with pytest.raises(CorruptRunError, match="replaced while it was read"):
        kept.rows(["max_abs"])
    file.unlink()
    with pytest.raises(CorruptRunError, match="cannot be read"):
        kept.rows(["max_below"])
