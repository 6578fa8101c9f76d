"""The tables of behaviour say what the rows say."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pandas as pd
import pytest

from phongbench.analysis.rows import Rows
from phongbench_reports.table import Absent, Table
from phongbench_reports.tables.behaviour import hostile, smoothness, worst


@pytest.fixture(scope="module")
def study(run: Any) -> Rows:
    return Rows(run)


def table(content: Table | Absent) -> Table:
    assert isinstance(content, Table)
    assert all(len(row) == len(content.headings) for row in content.rows)
    return content


def test_hostile_inputs_have_a_row_for_each_form_and_a_column_for_each_case(study: Rows) -> None:
    shown = table(hostile(study))
    assert shown.headings == ("formula", "a\u00a0=\u00a0−b", "a is huge", "a is zero", "alpha 0")
    rows = {row[0]: row[1:] for row in shown.rows}
    assert rows["lyon:dot"] == ("ok", "∞", "0 or 1", "ok")
    assert rows["lyon:cross, ungated"] == ("0 or 1", "0 or 1", "0 or 1", "ok")
    assert list(rows).index("lyon:cross") < list(rows).index("lyon:cross, ungated")
    assert len(shown.data) == (study.run.behaviour["precision"] == study.precision).sum()


def test_hostile_inputs_count_what_leaves_the_range(study: Rows) -> None:
    shown = table(hostile(study))
    mine = study.run.behaviour
    mine = mine[mine["precision"] == "float32"]
    assert f"{(mine['outcome'] == 'infinite').sum()} of {len(mine)} answers" in shown.takeaway


def test_the_worst_of_some_outcomes_is_told() -> None:
    assert worst(pd.Series(["value", "saturates", "value"])) == "0 or 1"
    assert worst(pd.Series(["refused"])) == "refused"
    assert worst(pd.Series([], dtype=str)) == "–"


def test_smoothness_shows_edges_and_rises(study: Rows) -> None:
    shown = table(smoothness(study))
    assert "γ 2 shows its edge, γ 4, 8, 16, 32, 64 does not" in shown.takeaway
    assert "lyon:dot" in shown.takeaway
    rows = {(row[0], row[1]): row[2:] for row in shown.rows}
    assert rows["dot", "2"][0] == "1"
    assert rows["dot", "8"][0] == "< 0.001"
    assert rows["dot", "8"][2:] == ("0", "0", "0 / 0", "200", "12.8", "0 / 300")


@pytest.mark.parametrize(("draw", "name"), [(hostile, "behaviour"), (smoothness, "smoothness")])
def test_without_rows_the_probe_is_named(study: Rows, draw: Callable[[Rows], Table | Absent], name: str) -> None:
    empty = replace(study.run, **{name: pd.DataFrame(columns=getattr(study.run, name).columns)})
    content = draw(Rows(empty))
    assert isinstance(content, Absent)
    assert "probe" in content.fix
