"""On every device: a line a formula with its bound by contract in both precisions, beside what was measured."""

from typing import Any

import pandas as pd

from phongbench.analysis.rows import Rows
from phongbench_reports.table import Absent, Table
from phongbench_reports.tables.devices import devices


def test_a_run_without_bounds_says_how_to_get_them(run: Any) -> None:
    content = devices(Rows(run))
    assert isinstance(content, Absent)
    assert "--probe contract" in content.fix


def test_written_code_stands_beside_its_bound(run: Any) -> None:
    rows = run.accuracy
    own = rows[rows["gated"] & (rows["stratum"] == "highlight") & (rows["truth"] == "angle")]
    code = own.assign(code="gpu", fused=False, max_abs=2 * own["max_abs"])
    both = pd.concat([code, code.assign(fused=True, max_abs=3 * own["max_abs"]), code.assign(code="c", max_abs=1.0)])

    class Written(Rows):
        emitted = both

    table = devices(Written(run))
    assert isinstance(table, Table)
    assert table.headings.index("as written, float32") == 2
    data = table.data[table.data["measured"].notna()]
    assert len(data)
    assert (data["written_float32"] == 3 * data["measured"]).all(), "whichever way to round errs more"
    assert data[["float32", "float16"]].isna().all(axis=None)
    assert "not asked for" in table.takeaway


def test_each_formula_has_its_bounds_and_what_was_measured(run: Any) -> None:
    rows = run.accuracy
    own = rows[rows["gated"] & (rows["stratum"] == "highlight") & (rows["precision"] == "float32")]
    own = own[own["truth"] == "angle"]
    about = {"stratum": "devices", "coverage": "contract", "perturbation": "none", "truth": "angle"}
    known = own.assign(**about, max_abs=2 * own["max_abs"])
    half = own[own["approximation"] != "schlick"].assign(**about, precision="float16", max_abs=0.25)
    whole = pd.concat([rows, known, half], ignore_index=True)
    table = devices(Rows(type(run)(run.path, run.manifest, whole, run.timing, run.worst)))
    assert isinstance(table, Table)
    lines = {row[0]: row[1:] for row in table.rows}
    assert lines["schlick"][4:] == ("–", "–")
    assert lines["lyon:dot:8"][4:] == ("0.250", "63.8")
    data = table.data[table.data["approximation"] == "lyon"]
    assert (data["float32"] == 2 * data["measured"]).all()
    assert "in float32" in table.takeaway
