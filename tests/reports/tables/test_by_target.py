"""The answer by target: a column for each group of targets that answer alike, and the figure of their fronts."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from phongbench.analysis import by_target as analysis
from phongbench.analysis.by_target import Answer
from phongbench.analysis.rows import Rows
from phongbench.results.schema import TABLES
from phongbench.targets.costs import shipped
from phongbench_reports.figures import targets
from phongbench_reports.plots import Plate, ink
from phongbench_reports.table import Absent, Table
from phongbench_reports.tables.by_target import by_target

BUDGET = (1 / 255, "1/255")


@pytest.fixture(scope="module")
def made(made_up: Any) -> Any:
    return made_up(Path("run"), alphas=(10.0, 50.0, 200.0), gammas=(8, 16), precisions=("float32",))


@pytest.fixture(scope="module")
def study(made: Any) -> Rows:
    return Rows(made)


@pytest.fixture(scope="module")
def table(study: Rows) -> Table:
    content = by_target(study, *BUDGET)
    assert isinstance(content, Table)
    return content


def test_every_target_has_its_answer_at_every_exponent_shown(study: Rows, table: Table) -> None:
    assert [name for heading in table.headings[1:] for name in heading.split(", ")] == ["cpu", "gcn4", "rdna2"]
    assert [row[0] for row in table.rows] == ["10", "50", "200"]
    assert len(table.data) == 3 * len(table.rows)
    assert all(len(row) == len(table.headings) for row in table.rows)


def test_a_cost_is_that_of_the_shipped_table_and_within_the_budget_by_proof(table: Table) -> None:
    counted = table.data[table.data["cost_kind"] == "compiled"]
    assert set(counted["target"]) == {"gcn4", "rdna2"}
    assert (counted["bound"] <= BUDGET[0]).all()
    for row in counted.to_dict("records"):
        known = shipped(row["target"])
        cost = known.known_of(analysis.Formula.parse(row["name"]), row["alpha"])
        assert (row["cost"], row["ratio"], row["unit"]) == (cost.cost, known.ratio(cost), "cycles")
    here = table.data[table.data["target"] == "cpu"]
    assert set(here["unit"]) == {"ns"}
    assert set(here["cost_kind"]) == {"measured"}


def test_the_sentence_names_each_answer_with_its_targets(table: Table) -> None:
    named = table.data[table.data["alpha"] == 50.0].groupby("target")["name"].first()
    told = table.takeaway.replace("\u00a0", " ")
    assert "at α = 50 it is" in told
    assert all(name in told and target in told for target, name in named.items())
    assert "RADV (Mesa 22)" in table.basis


def test_nothing_is_claimed_of_the_processor_where_its_twin_differs(made: Any) -> None:
    twins = made.timing["approximation"] == "aa-twin"
    noisy = replace(made, timing=made.timing.assign(verdict=made.timing["verdict"].mask(twins, "slower")))
    content = by_target(Rows(noisy), *BUDGET)
    assert isinstance(content, Table)
    assert all(row[1].endswith(", withheld") for row in content.rows)
    assert not any("withheld" in cell for row in content.rows for cell in row[2:])


def test_a_run_without_costs_says_so_in_table_and_figure(made: Any) -> None:
    bare = Rows(replace(made, costs=TABLES["costs"].frame()))
    for content in (by_target(bare, *BUDGET), targets.draw(bare)):
        assert isinstance(content, Absent)
        assert "phongbench run" in content.fix


def test_untimed_runs_have_the_compiled_targets_alone(made: Any) -> None:
    content = by_target(Rows(replace(made, timing=made.timing.head(0))), *BUDGET)
    assert isinstance(content, Table)
    assert "cpu" not in content.headings


def test_what_has_no_answer_is_said_and_grouped(study: Rows) -> None:
    nothing = [Answer(50.0, name, None) for name in ("gcn4", "rdna2")]
    assert analysis.alike(nothing) == [["gcn4", "rdna2"]]
    content = by_target(study, 1e-12, "1e-12")
    assert isinstance(content, Table)
    assert {cell for row in content.rows for cell in row[1:]} == {"nothing fits"}


def test_panels_share_axes_and_hold_every_formula_with_a_cost(study: Rows) -> None:
    with ink():
        plate = targets.draw(study)
    assert isinstance(plate, Plate)
    panels = [axes for axes in plate.figure.axes if axes.axison]
    assert [axes.get_title(loc="left") for axes in panels] == [
        "cpu (time, measured)", "gcn4 (cycles, counted)", "rdna2 (cycles, counted)",
    ]  # fmt: skip
    assert len({(axes.get_xlim(), axes.get_ylim()) for axes in panels}) == 1
    low, high = panels[0].get_ylim()
    assert plate.data["ratio"].between(low, high).all()
    for target, rows in plate.data.groupby("target"):
        assert rows.loc[rows["label"] == "phong", "ratio"].tolist() == pytest.approx([1.0]), target
        assert set(rows["state"]) <= {"on", "off", "unresolved"}
        assert target in plate.alt
