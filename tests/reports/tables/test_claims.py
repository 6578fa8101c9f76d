"""The section on the textbook claims: every claim with sign, verdict and reason, traceable and inert."""

import json
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import phongbench_reports
from phongbench.analysis.claims import CLAIMS, SIGNS, VERDICTS
from phongbench.analysis.rows import Rows
from phongbench_reports.figures import FIGURES
from phongbench_reports.figures.pictures import SECTIONS
from phongbench_reports.table import Absent
from phongbench_reports.tables.claims import ClaimTable, claims


@pytest.fixture(scope="module")
def table(run: Any) -> ClaimTable:
    found = claims(Rows(run))
    assert isinstance(found, ClaimTable)
    return found


def test_every_claim_has_a_sign_a_verdict_and_a_reason(table: ClaimTable) -> None:
    assert [entry.key for entry in table.entries] == [claim.key for claim in CLAIMS]
    for entry in table.entries:
        assert SIGNS[entry.verdict] == entry.sign
        assert entry.because.endswith(".")
        assert (entry.verdict == "not measured") == bool(entry.lacking)
    assert len(set(SIGNS.values())) == len(VERDICTS)


def test_the_takeaway_counts_the_verdicts(table: ClaimTable) -> None:
    counted = [sum(entry.verdict == verdict for entry in table.entries) for verdict in VERDICTS]
    assert sum(counted) == len(CLAIMS)
    for count, word in zip(counted, ("hold", "under conditions", "mostly", "fail", "not measured"), strict=True):
        assert (f"{count} " in table.takeaway and word in table.takeaway) or not count


def test_numbers_and_rows_are_shown_and_the_csv_holds_them_all(table: ClaimTable) -> None:
    first = table.entries[0]
    (numbers,) = first.numbers
    assert {len(row) for row in numbers.rows} == {len(numbers.headings)}
    assert "max error 0.00392" in numbers.common
    assert all("max abs" in line and "(accuracy)" in line for line in first.evidence)
    assert first.command.startswith("phongbench run --only lyon")
    row = table.data.set_index("key").loc["a"]
    assert len(json.loads(str(row["conditions"]))) == len(numbers.rows)
    assert len(json.loads(str(row["evidence"]))) == len(first.evidence)


def test_every_figure_that_a_claim_names_is_on_the_page(table: ClaimTable) -> None:
    names = {part.name for part in (*FIGURES, *SECTIONS)}
    assert {claim.figure for claim in CLAIMS} - {None} <= names
    for entry, claim in zip(table.entries, CLAIMS, strict=True):
        assert entry.figure == (claim.figure if claim.figure and entry.evidence else "")


def test_a_run_without_the_rows_says_how_to_get_them(run: Any) -> None:
    rows = run.accuracy[run.accuracy["approximation"] == "schlick"]
    none = {name: getattr(run, name).head(0) for name in ("timing", "meshes", "incidence", "cuts")}
    found = claims(Rows(replace(run, accuracy=rows, **none)))
    assert isinstance(found, Absent)
    assert "phongbench run" in found.fix


def test_names_of_files_are_inert_on_the_page(
    made_up: Callable[..., Any], tmp_path: Path, only_figures: Callable[..., AbstractContextManager[None]]
) -> None:
    run = made_up(tmp_path, alphas=(10.0,), gammas=(8,))
    named = replace(run, meshes=run.meshes.assign(mesh="<script>alert(1)</script>"))
    with only_figures("front", "speed", "meshes"):
        page = phongbench_reports.build(named, tmp_path / "report").read_text(encoding="utf-8")
    assert "&lt;script&gt;alert(1)" in page
    assert "<script>" not in page
