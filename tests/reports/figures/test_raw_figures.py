"""Figures of formulas that remove lengths or start from N, L and V."""

from __future__ import annotations

import pytest

from phongbench.analysis.rows import Rows
from phongbench_reports.figures import FIGURES
from phongbench_reports.plots import Plate, ink
from phongbench_reports.table import Absent


def test_recipes_are_judged_by_the_worse_sign_and_named_by_size(plates: dict[str, Plate]) -> None:
    data = plates["raw_vectors"].data
    assert data["lengths"].nunique() == 5
    worst = data[(data["label"] == "lyon:cross:8@lengthwise")].set_index("lengths")["error"]
    assert worst.tolist() == pytest.approx([1e-3, 1e-3 + 0.002, 1e-3 + 0.02, 1e-3 + 0.1, 1e-3])
    told = plates["raw_vectors"].takeaway.replace("\u00a0", " ")
    assert "lengths 0.1 % wrong: lyon:cross:8@lengthwise (0.500" in told
    assert "lengths 1 % wrong: phong@lengthwise/once (1.60" in told


def test_steps_are_differences_of_ratios(plates: dict[str, Plate]) -> None:
    data = plates["step_costs"].data.set_index("step")
    assert data.loc["one root", "share"] == pytest.approx(0.5)
    assert data.loc["one root", "share_low"] <= 0.5 * 0.99
    assert data.index[0] == "a.b alone"
    assert "normalise R and V: 100" in plates["step_costs"].takeaway


@pytest.mark.parametrize("name", ["raw_vectors", "step_costs"])
def test_a_run_without_raw_formulas_says_so(name: str, study: Rows) -> None:
    with ink():
        assert isinstance(next(f for f in FIGURES if f.name == name).make(study), Absent)
