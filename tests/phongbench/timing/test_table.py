"""Rows of several processes merged into one."""

import math
from typing import Any

import numpy as np
import pytest

from phongbench.results.schema import TIMING
from phongbench.timing import table


def row(name: str, ratio: float, width: float = 0.01, **more: Any) -> dict[str, Any]:
    known = {
        "approximation": name,
        "lambda_form": "none",
        "space": "reflect",
        "beta_policy": "none",
        "gamma": None,
        "precision": "float32",
        "working_set": "l1",
        "elements": 10,
        "threads": 1,
        "ns_min": ratio,
        "ns_median": ratio,
        "ratio": ratio,
        "ratio_low": ratio * (1 - width),
        "ratio_high": ratio * (1 + width),
        "verdict": "unresolved",
        "dot_ratio": 2.0,
        "bandwidth_fraction": 0.5,
        "rounds": 24,
        "contaminated": 1,
        "repeats": 3,
        "compile_ms": 1.0,
        "lit": math.nan,
        "processes": 1,
    }
    return known | more


def merged(ratios: list[float], width: float = 0.01) -> dict[str, Any]:
    frames = [TIMING.frame([row("aa-twin", 1.0), row("lyon", r, width)]) for r in ratios]
    return dict(table.merged(frames).set_index("approximation").loc["lyon"])


def test_the_ratio_is_the_median_of_the_processes_and_counts_add_up() -> None:
    found = merged([0.5, 0.6, 0.52])
    assert found["ratio"] == pytest.approx(0.52)
    assert (found["rounds"], found["contaminated"], found["processes"]) == (72, 3, 3)
    assert found["ns_min"] == 0.5
    assert found["verdict"] == "faster"


def test_few_processes_give_an_interval_from_the_lowest_end_to_the_highest() -> None:
    found = merged([0.5, 0.6])
    assert found["ratio_low"] == pytest.approx(0.5 * 0.99)
    assert found["ratio_high"] == pytest.approx(0.6 * 1.01)


def test_eight_processes_give_a_sign_test_interval_across_them() -> None:
    found = merged([0.50, 0.51, 0.52, 0.53, 0.54, 0.55, 0.56, 0.57], width=1e-6)
    assert found["ratio_low"] == pytest.approx(0.50)
    assert found["ratio_high"] == pytest.approx(0.57)


def test_the_interval_is_never_narrower_than_those_within() -> None:
    found = merged([0.5] * 8, width=0.1)
    assert found["ratio_low"] == pytest.approx(0.45)
    assert found["ratio_high"] == pytest.approx(0.55)


def test_processes_that_disagree_about_faster_leave_it_unresolved() -> None:
    assert merged([0.9, 1.2])["verdict"] == "unresolved"


def test_a_row_that_is_void_in_one_process_is_left_out() -> None:
    frames = [TIMING.frame([row("aa-twin", 1.0), row("lyon", 0.5)]), TIMING.frame([row("aa-twin", 1.0)])]
    assert table.merged(frames)["approximation"].tolist() == ["aa-twin"]


def test_rows_at_different_shares_of_lit_pairs_stay_apart() -> None:
    frame = TIMING.frame([row("aa-twin", 1.0), row("phong-skip", 0.5, lit=0.1), row("phong-skip", 0.9, lit=1.0)])
    found = table.merged([frame, frame])
    assert len(found) == 3
    assert np.array_equal(found["ratio"], [1.0, 0.5, 0.9])
