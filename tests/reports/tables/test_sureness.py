"""How sure the numbers are: one line a formula, each coverage in its column, and contradictions in red."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from phongbench.analysis.rows import Rows
from phongbench_reports import build
from phongbench_reports.table import Absent, Table
from phongbench_reports.tables.sureness import sureness

SENTENCE = "lyon, dot: sampled <max_abs> 0.9 is above exhaustive 0.03"
FACTS = {
    "digits": 50,
    "arithmetic": "mpmath",
    "random_values": 10_000,
    "random_disagreement": 1e-15,
    "random_share": 0.1,
    "worst_values": 345,
    "worst_disagreement": 2e-15,
    "worst_share": 0.25,
}


@pytest.fixture
def proven(run: Any) -> Callable[..., Any]:
    """The made-up run with searched, exhaustive and certified rows, each a little above the one before it."""

    def make(**manifest: Any) -> Any:
        rows = run.accuracy
        own = rows[rows["gated"] & (rows["stratum"] == "highlight") & (rows["space"] == "reflect")]
        searched = own.assign(stratum="vectors", coverage="searched", max_abs=1.01 * own["max_abs"])
        near = own[own["lambda_form"].isin(["dot", "none"])]
        cosines = near.assign(stratum="cosines", coverage="exhaustive", max_abs=1.02 * near["max_abs"])
        lyon = own[(own["approximation"] == "lyon") & (own["precision"] == "float32")]
        bounds = lyon.assign(
            stratum="cosines", coverage="certified", precision="exact", model_max=1.001 * lyon["model_max"]
        )
        whole = pd.concat([rows, searched, cosines, bounds], ignore_index=True)
        return type(run)(run.path, run.manifest | manifest, whole, run.timing, run.worst)

    return make


def test_every_coverage_has_its_column(proven: Callable[..., Any]) -> None:
    study = Rows(proven(probes={"recheck": FACTS}))
    table = sureness(study)
    assert isinstance(table, Table)
    lines = {row[0]: row[1:] for row in table.rows}
    cell = table.data.query(
        "approximation == 'lyon' and lambda_form == 'dot' and gamma == 8 and alpha == 50 and beta_policy == 'taylor'"
    ).set_index("precision")
    assert cell.loc["float32", "searched"] >= cell.loc["float32", "sampled"]
    assert lines["lyon:dot:8"][5] == "0.10\u00a0%"
    assert lines["lyon:cross:8"][2] == "–"  # a cosine alone does not make this form
    assert lines["schlick"][4:] == ("–", "–")
    assert len(lines) == len(table.rows)
    assert "No two numbers contradict each other" in table.takeaway
    assert "10\u202f345 exact values were computed again with 50 digits" in table.takeaway
    assert "25\u00a0% of its stated error" in table.takeaway


def test_a_run_of_samples_alone_says_how_to_know_more(run: Any) -> None:
    content = sureness(Rows(run))
    assert isinstance(content, Absent)
    assert "--probe cosines,search,certify,recheck" in content.fix


def test_contradictions_stand_in_red_at_the_top_and_are_escaped(
    proven: Callable[..., Any], report: Path, tmp_path: Path, only_figures: Callable[..., AbstractContextManager[None]]
) -> None:
    with only_figures():
        page = build(proven(violations=[SENTENCE]), tmp_path / "report").read_text(encoding="utf-8")
    head = page[: page.index("<main>")]
    assert 'class="warning violation"' in head
    assert "sampled &lt;max_abs&gt; 0.9" in head
    assert "1 contradictions" not in page
    assert "1 contradiction between rows" in page
    assert "violation" not in (report / "index.html").read_text(encoding="utf-8")
