"""Skipping in kernels: told where it was timed, by rules and not by hand."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from phongbench.analysis.rows import Rows
from phongbench.results.schema import RAW
from phongbench_reports.table import Absent, Table
from phongbench_reports.tables.skipped import skipped


def kernel(name: str, lit: float, ratio: float) -> dict[str, Any]:
    return {
        "approximation": name,
        "lambda_form": "none",
        "space": "reflect",
        "beta_policy": "none",
        "gamma": pd.NA,
        "precision": "float32",
        "working_set": "l2",
        "elements": 1000,
        "threads": 1,
        "ns_min": ratio,
        "ns_median": ratio,
        "ratio": ratio,
        "ratio_low": ratio - 0.05,
        "ratio_high": ratio + 0.05,
        "verdict": "faster",
        "dot_ratio": 1.0,
        "bandwidth_fraction": 0.1,
        "rounds": 24,
        "contaminated": 0,
        "lit": lit,
    }


@pytest.fixture
def study(made_up: Callable[..., Any], tmp_path: Path) -> Rows:
    run = made_up(tmp_path, alphas=(10.0,), gammas=(8,))
    rows = [kernel("phong-plain", 0.01, 1.0), kernel("phong-skip", 0.01, 0.4)]
    rows += [kernel("phong-plain", 1.0, 1.0), kernel("phong-skip", 1.0, 1.2)]
    timing = pd.concat([run.timing.assign(lit=float("nan")), pd.DataFrame(rows).assign(**RAW)], ignore_index=True)
    return Rows(replace(run, timing=timing.astype({"gamma": "Int64"})))


def test_plain_and_skipping_stand_side_by_side(study: Rows) -> None:
    found = skipped(study)
    assert isinstance(found, Table)
    assert [row[:2] for row in found.rows] == [("phong", "1\u00a0%"), ("phong", "100\u00a0%")]
    assert found.rows[0][3] == "1"
    assert found.rows[0][5] == "0.400"


def test_only_what_is_certain_is_claimed(study: Rows) -> None:
    found = skipped(study)
    assert isinstance(found, Table)
    assert found.takeaway.endswith("phong: certainly faster at 1\u00a0% lit.")


def test_a_run_without_such_rows_says_how_to_get_them(made_up: Callable[..., Any], tmp_path: Path) -> None:
    found = skipped(Rows(made_up(tmp_path, alphas=(10.0,), gammas=(8,))))
    assert isinstance(found, Absent)
    assert "--preset standard" in found.fix
