"""The rows of costs.parquet: what shipped tables, compilers and the run's own times say of its formulas."""

from dataclasses import replace

import pandas as pd
import pytest

from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.inputs.plan import Cell, preset
from phongbench.results.schema import TABLES, TIMING
from phongbench.study import target_costs
from phongbench.study.forecast import forecast
from phongbench.study.target_costs import Costs, checked
from phongbench.targets import costs as shipped_costs
from phongbench.targets.chips import TARGETS
from phongbench.targets.costs import shipped
from phongbench.targets.measure import CONTEXTS

FORMULAS = ("phong", "lyon:dot:8", "gaussian:dot:minimax", "lyon:cross:8/once", "phong/estimate")


def cells(*alphas: float) -> list[Cell]:
    return [Cell(Formula.parse(name), alpha, "float32") for name in FORMULAS for alpha in alphas]


def made(*targets: str, alphas: tuple[float, ...] = (10.0, 50.0), timing: pd.DataFrame | None = None) -> pd.DataFrame:
    """The table; a note is a failure."""
    return Costs(cells(*alphas), REGISTRY, pytest.fail).frame(targets, TIMING.frame() if timing is None else timing)


@pytest.mark.parametrize("name", TARGETS)
def test_rows_say_what_the_shipped_table_does(name: str) -> None:
    rows, table = made(name), shipped(name)
    assert not rows.duplicated(TABLES["costs"].key).any()
    assert list(rows.columns) == TABLES["costs"].names
    assert set(rows["context"]) == set(CONTEXTS)
    for row in rows.to_dict("records"):
        cost = table.known_of(Formula.of_row(row), row["alpha"])
        assert cost is not None
        place = CONTEXTS.index(row["context"])
        assert row["cost"] == cost.around[place]
        exact = table.dot.around[place] + table.baseline.around[place]
        assert row["ratio"] == row["ratio_low"] == row["ratio_high"] == (table.dot.around[place] + row["cost"]) / exact
        assert (row["unit"], row["tool_version"]) == (table.target.unit, table.tool_version)
        if row["context"] == 0:
            assert (row["bound_by"], row["issue"], row["busy"]) == (cost.bound_by, cost.issue, cost.special)
            assert (row["ratio"], row["over_dot"]) == (table.ratio(cost), table.over_dot(cost))


def test_every_target_counts_the_same_formulas_and_what_has_no_code_is_left_out() -> None:
    counted = made().groupby("target")[["approximation", "lambda_form", "gamma", "normalise"]].nunique(dropna=False)
    assert list(counted.index) == sorted(TARGETS)
    assert "estimate" not in set(made()["normalise"])
    assert set(made()["approximation"]) == {"phong", "lyon", "gaussian"}


@pytest.mark.parametrize(("alphas", "taken"), [((10.0, 50.0), 50.0), ((10.0, 45.0, 1000.0), 45.0), ((7.0,), 7.0)])
def test_the_code_is_that_of_the_exponent_nearest_to_50(alphas: tuple[float, ...], taken: float) -> None:
    assert set(made("rdna2", alphas=alphas)["alpha"]) == {taken}


def test_the_processor_has_its_times_as_costs() -> None:
    usual = {"lambda_form": "dot", "space": "reflect", "beta_policy": "none", "gamma": 8, "precision": "float32"}
    usual |= {"recipe": "pair", "normalise": "none", "elements": 9, "threads": 1, "ns_min": 0.2, "ns_median": 0.2}
    usual |= {"ratio": 0.5, "ratio_low": 0.49, "ratio_high": 0.51, "verdict": "faster", "dot_ratio": 2.0}
    usual |= {"bandwidth_fraction": 0.1, "rounds": 20, "contaminated": 0}
    lyon, far = usual | {"approximation": "lyon"}, {"working_set": "memory", "ratio": 0.9}
    rows = [lyon | {"working_set": "l1"}, lyon | far, lyon | {"working_set": "l1", "threads": 2, "ratio": 0.3}]
    rows += [usual | {"approximation": "dot", "working_set": "l1"}]
    rows = [{"repeats": 1, "compile_ms": 0.0, "lit": None, "processes": 1} | row for row in rows]
    found = made("cpu", timing=TIMING.frame(rows))
    assert len(found) == 1
    row = found.iloc[0]
    assert (row["target"], row["cost_kind"], row["unit"], row["alpha"]) == ("cpu", "measured", "ns", 50.0)
    assert (row["cost"], row["over_dot"], row["ratio"], row["ratio_high"]) == (0.2, 2.0, 0.5, 0.51)
    assert pd.isna(row["bound_by"])
    assert pd.isna(row["fp32"])


@pytest.fixture
def own(monkeypatch: pytest.MonkeyPatch) -> Costs:
    """Costs of a formula of the user's, with a body that no table knows, and its notes in `.notes`."""
    spec = replace(REGISTRY["schlick"], name="own", kernel=unheard_of)
    notes: list[str] = []
    made = Costs([Cell(Formula("own"), 50.0, "float32")], {**REGISTRY, "own": spec}, notes.append)
    object.__setattr__(made, "notes", notes)
    for target in TARGETS.values():
        monkeypatch.setattr(type(target), "why_not", lambda self: None)
    return made


def unheard_of(cosine: float, alpha: float) -> float:
    return cosine * cosine / (alpha * alpha + cosine * cosine * cosine)


def test_own_formulas_are_compiled_beside_exact_phong(own: Costs, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def answered(target, codes, precision: str):
        asked.append([one.name for one in codes])
        table = shipped(target.name)
        rows = {one.shape: (one.name, table.baseline) for one in codes}
        return shipped_costs.CostTable(target, "another compiler", table.dot, rows)

    monkeypatch.setattr(target_costs, "compiled", answered)
    rows = own.frame(("rdna2",), TIMING.frame())
    assert asked == [["phong 50", "own 50"]]
    assert set(rows["approximation"]) == {"own"}
    assert set(rows["tool_version"]) == {"another compiler"}
    assert set(rows["ratio"]) == {1.0}
    assert own.notes == []


def test_targets_without_a_compiler_share_a_note_and_one_that_refuses_has_its_own(
    own: Costs, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(target, codes, precision: str):
        raise InputError("the code is refused", target.name, "write another")

    monkeypatch.setattr(target_costs, "compiled", refused)
    assert own.frame(("gcn4",), TIMING.frame()).empty
    assert [note for note in own.notes if "gcn4" in note and "refused" in note] == own.notes
    own.notes.clear()
    monkeypatch.setattr(type(TARGETS["gcn4"]), "why_not", lambda self: "apt has it")
    own.frame(("gcn4", "rdna2"), TIMING.frame())
    assert own.notes == ["own formulas have no cost on gcn4, rdna2: apt has it"]


def test_what_ships_is_never_compiled_in_a_study(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(target_costs, "shipped", lambda name, precision: replace(shipped(name, precision), rows={}))
    monkeypatch.setattr(target_costs, "compiled", lambda *_: pytest.fail("a study of shipped formulas compiles"))
    assert made("rdna2").empty


def test_an_unknown_target_is_refused_before_anything_is_measured() -> None:
    assert checked(("cpu", "rdna2", "cpu")) == ("cpu", "rdna2")
    with pytest.raises(UnknownNameError, match="gcn4"):
        checked(("geforce",))
    plan = replace(preset("quick"), targets=("geforce",)).validated()
    with pytest.raises(UnknownNameError, match="geforce"):
        forecast(plan)
