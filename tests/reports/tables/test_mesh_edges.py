"""How wide edges may be: a table of crossings, one row an exponent."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from phongbench.analysis.rows import Rows
from phongbench_reports.table import Absent, Table
from phongbench_reports.tables.mesh_edges import mesh_edges


def test_a_row_an_exponent_and_a_column_a_way(made_up: Callable[..., Any], tmp_path: Path) -> None:
    found = mesh_edges(Rows(made_up(tmp_path, alphas=(10.0, 128.0), gammas=(8,))))
    assert isinstance(found, Table)
    assert [row[0] for row in found.rows] == ["10", "128"]
    assert found.headings[1:4] == ("classic R · dot", "classic R · difference", "classic R · cross")
    assert len(found.headings) == 10
    assert all(len(row) == 10 for row in found.rows)
    cells = {cell for row in found.rows for cell in row[1:]}
    assert "< 2°" in cells  # the dot form, at the finest edge already
    wide = found.data.set_index(["alpha", "lambda_form", "pair"])["degrees"]
    assert wide[128.0, "cross", "half"] > wide[128.0, "cross", "classic"]
    assert "(N,\u00a0H)" in found.takeaway


def test_a_run_without_such_rows_says_how_to_get_them(made_up: Callable[..., Any], tmp_path: Path) -> None:
    run = made_up(tmp_path, alphas=(10.0,), gammas=(8,))
    found = mesh_edges(Rows(replace(run, meshes=run.meshes.iloc[:0])))
    assert isinstance(found, Absent)
    assert "--probe meshes" in found.fix
