"""Timing in fresh processes: what is handed over, and that it comes back."""

import json
import tempfile
from pathlib import Path
from typing import Any

import pytest

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32
from phongbench.errors import BudgetError, InputError, MeasurementError
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.user_files import load_file, registry_with
from phongbench.inputs.plan import PRESETS, preset
from phongbench.results.schema import TIMING
from phongbench.timing import processes
from phongbench.timing.measure import Timing
from phongbench.timing.processes import measure_in_processes
from phongbench.timing.timed_kernels import TimedFormula, timed_formulas

LYON = TimedFormula.of("lyon:dot:8", FLOAT32)
compiled_only = pytest.mark.skipif(jit.DISABLED, reason="plain Python is not timed")


@pytest.fixture(autouse=True)
def own_lock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))


@compiled_only
def test_two_processes_are_merged_into_one_table() -> None:
    told: list[tuple[int, int, str]] = []
    timing = measure_in_processes(
        [LYON], processes=2, budget_seconds=4.0, working_sets=["l1"], seed=1, progress=lambda *now: told.append(now)
    )
    rows = timing.rows
    assert list(rows.columns) == TIMING.names
    assert timing.problems == []
    assert set(rows["processes"]) == {2}
    assert "lyon" in set(rows["approximation"])
    assert told == [(1, 2, "process 1 of 2"), (2, 2, "process 2 of 2")]
    assert (rows["rounds"] >= 16).all()


@compiled_only
def test_one_process_is_this_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processes, "_in_a_process", lambda task: pytest.fail("a process was started"))
    assert len(measure_in_processes([LYON], processes=1, budget_seconds=2.0, working_sets=["l1"]).rows)


@compiled_only
def test_a_users_own_approximation_goes_along_by_its_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = Path(str(REGISTRY["lyon"].kernel.__code__.co_filename)).read_text().replace('name="lyon"', 'name="mine"')
    (tmp_path / "mine.py").write_text(source)
    (mine,) = load_file(tmp_path / "mine.py")
    seen: list[dict[str, object]] = []

    def caught(task: dict[str, object]) -> Timing:
        seen.append(task)
        raise MeasurementError("stop")

    monkeypatch.setattr(processes, "_in_a_process", caught)
    with pytest.raises(MeasurementError, match="stop"):
        measure_in_processes(
            [LYON, TimedFormula.of("mine:dot:8", FLOAT32, registry={"mine": mine})], processes=2, budget_seconds=2.0
        )
    assert seen[0]["files"] == [str(tmp_path / "mine.py")]


@pytest.mark.parametrize("name", PRESETS)
def test_what_a_preset_times_is_what_its_processes_are_told_to_time(name: str) -> None:
    plan = preset(name).validated()
    timed = timed_formulas(plan.cells(REGISTRY))
    task = json.loads(json.dumps(processes._task(timed, 1.0, 0, {})))
    told = processes._formulas(task)
    assert task["files"] == []
    assert any(t.far for t in timed)
    assert any(t.formula.normalise == "squared" for t in timed)
    for field in ("key", "name", "formula", "precision", "alpha", "label", "far"):
        assert [getattr(t, field) for t in told] == [getattr(t, field) for t in timed]
    assert [t.spec.coefficients(t.setting) for t in told] == [t.spec.coefficients(t.setting) for t in timed]


def test_a_squared_cosine_of_a_users_own_goes_along_by_its_file(tmp_path: Path) -> None:
    source = Path(str(REGISTRY["phong"].kernel.__code__.co_filename)).read_text().replace('name="phong"', 'name="mine"')
    (tmp_path / "mine.py").write_text(source)
    registry = registry_with([tmp_path / "mine.py"])
    timed = [TimedFormula.of("mine/squared", FLOAT32, registry=registry)]
    task = processes._task(timed, 1.0, 0, {})
    assert task["files"] == [str(tmp_path / "mine.py")]
    assert [t.key for t in processes._formulas(task)] == [t.key for t in timed]


@compiled_only
def test_a_budget_too_small_for_each_process_says_what_each_needs() -> None:
    with pytest.raises(InputError, match=r"0\.001 s are too short to time"):
        measure_in_processes([LYON], processes=2, budget_seconds=0.002, working_sets=["l1"])


@compiled_only
def test_where_a_share_is_too_short_the_process_starts_again_with_more_and_the_finished_ones_stay(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[float] = []

    def child(task: dict[str, Any]) -> Timing:
        asked.append(task["options"]["budget_seconds"])
        if len(asked) == 2:
            raise BudgetError("too short", 3.0)
        return Timing(TIMING.frame([]), [], [f"note {len(asked)}"])

    monkeypatch.setattr(processes, "_in_a_process", child)
    monkeypatch.setattr(processes.table, "merged", lambda frames: frames)
    found = measure_in_processes([LYON], processes=4, budget_seconds=4.0, on_short=lambda short: 2 * short.needed)
    assert asked == [1.0, 1.0, 6.0, 6.0, 6.0]  # each needs 3, so all need 12, and are given 24
    assert found.notes == ["note 1", "note 3", "note 4", "note 5"]
    assert len(found.rows) == 4


@compiled_only
def test_a_process_that_fails_says_why() -> None:
    with pytest.raises(MeasurementError, match="a timing process failed: KeyError"):
        processes._in_a_process({})


@compiled_only
def test_what_cannot_be_is_refused_before_any_process_starts() -> None:
    with pytest.raises(InputError, match="no time"):
        measure_in_processes([LYON], processes=2, budget_seconds=0.0)
