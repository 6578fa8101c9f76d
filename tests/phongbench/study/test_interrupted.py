"""A study that is interrupted at each of its stages: what its folder says then, and what every command makes of it."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from click.testing import CliRunner, Result

from phongbench.analysis.rows import Rows
from phongbench.cli.main import main
from phongbench.errors import InterruptedStudyError
from phongbench.inputs.plan import Plan
from phongbench.results import runs
from phongbench.results.runs import Run
from phongbench.study import run as study
from phongbench.support.progress import Progress

#: each stage at whose beginning a study may be interrupted, and what it lacks from then on
STAGES = {
    "compiling": "errors, probes, timing",
    "accuracy": "errors, probes, timing",
    "making the accuracy rows": "errors, probes, timing",
    "hostile inputs": "probes, timing",
    "writing the tables": "probes, timing",
    "timing": "timing",
}
WITH_ROWS = [stage for stage, lacking in STAGES.items() if "errors" not in lacking]
#: commands whose answer is a promise, so that it needs all of a run
PROMISES = (
    ("claims", "RUN"),
    ("front", "RUN", "--alpha", "10"),
    ("recommend", "--alpha", "10", "--max-error", "0.1", "--run", "RUN"),
)


class Stop(Progress):
    """Interrupts where a stage begins."""

    def __init__(self, stage: str) -> None:
        self.at = stage

    def stage(self, text: str, total: float | None = None) -> None:
        if text == self.at:
            raise KeyboardInterrupt


@pytest.fixture(scope="module")
def plan(tiny: Callable[..., Plan]) -> Plan:
    return tiny(strata=("highlight", "peak"), probes=("hostile",), timing=True)


@pytest.fixture(scope="module")
def interrupted(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with the runs, one by the name of each stage."""
    root = tmp_path_factory.mktemp("interrupted")
    for stage in STAGES:
        with pytest.raises(InterruptedStudyError):
            study.run_study(plan, root / _named(stage), progress=Stop(stage))
    return root


def _named(stage: str) -> str:
    return f"run-{stage.replace(' ', '-')}"


@pytest.fixture
def call(interrupted: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Result]:
    """Run a command in the folder of the runs, and see that nothing escapes it."""
    monkeypatch.chdir(interrupted)

    def run(*words: str) -> Result:
        found = CliRunner().invoke(main, list(words))
        assert found.exception is None or isinstance(found.exception, SystemExit), found.exception
        return found

    return run


@pytest.mark.parametrize("stage", STAGES)
def test_the_folder_tells_what_it_lacks_and_has_all_else(interrupted: Path, stage: str) -> None:
    run = runs.load(interrupted / _named(stage))
    assert runs.unfinished(run) == f"the run is partial: it was interrupted and lacks its {STAGES[stage]}"
    assert run.accuracy.empty == (stage not in WITH_ROWS)
    assert run.behaviour.empty == (STAGES[stage] != "timing")
    assert [line for line in runs.verify(run) if "partial" not in line] == []


@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize("words", PROMISES, ids=lambda words: words[0])
def test_what_promises_something_refuses_a_partial_run(call: Callable[..., Result], stage: str, words: Any) -> None:
    found = call(*(_named(stage) if word == "RUN" else word for word in words))
    assert found.exit_code == 2
    assert f"lacks its {STAGES[stage]}" in found.stderr
    assert "--resume" in found.stderr
    assert found.stdout == ""


@pytest.mark.parametrize("stage", STAGES)
def test_show_and_verify_say_that_it_is_partial(call: Callable[..., Result], stage: str) -> None:
    shown = json.loads(call("show", _named(stage), "--json").stdout)
    assert shown["facts"]["state"] == "partial"
    assert STAGES[stage] in shown["facts"]["note"]
    assert bool(shown["best"]) == (stage in WITH_ROWS)
    assert call("show", _named(stage)).exit_code == 0
    checked = call("verify", _named(stage))
    assert (checked.exit_code, "partial" in checked.stdout) == (1, True)


@pytest.mark.parametrize("stage", STAGES)
def test_compare_needs_errors_only(call: Callable[..., Result], stage: str) -> None:
    found = call("compare", _named(stage), _named(stage), "--json")
    assert found.exit_code == (0 if stage in WITH_ROWS else 2)
    assert (json.loads(found.stdout)["equal"] > 0) if stage in WITH_ROWS else ("lacks its errors" in found.stderr)


@pytest.mark.parametrize("stage", [stage for stage in STAGES if stage not in WITH_ROWS])
def test_without_errors_there_is_nothing_to_report(call: Callable[..., Result], stage: str) -> None:
    found = call("report", _named(stage), "--out", "nothing")
    assert found.exit_code == 2
    assert "lacks its errors" in found.stderr
    assert not Path("nothing").exists()


def test_a_report_of_what_is_there_says_what_is_not(call: Callable[..., Result]) -> None:
    found = call("report", _named("hostile inputs"), "--out", "partial-report")
    assert found.exit_code == 0, found.output
    assert "lacks its probes, timing" in found.stderr
    page = Path("partial-report/index.html").read_text()
    assert "This run was interrupted" in page
    assert "was interrupted before it was timed" in page
    assert "Run again without --no-timing" not in page


def test_only_what_was_to_be_timed_awaits_its_timing(interrupted: Path, plan: Plan) -> None:
    run = runs.load(interrupted / _named("hostile inputs"))
    untimed = {**run.manifest, "plan": replace(plan, timing=False).as_dict()}
    assert Rows(run).awaits_timing
    assert not Rows(Run(run.path, untimed)).awaits_timing
    assert not Rows(Run(run.path, {**run.manifest, "state": "complete"})).awaits_timing


@pytest.mark.parametrize("stage", ["hostile inputs", "writing the tables"])
def test_it_is_resumed_with_the_rows_of_one_that_never_was(
    interrupted: Path, plan: Plan, stage: str, tmp_path: Path
) -> None:
    """Rows that were stored early are stored again, together with those of the probes."""
    untimed = replace(plan, timing=False)
    whole = study.run_study(untimed, tmp_path / "whole").run
    with pytest.raises(InterruptedStudyError):
        study.run_study(untimed, tmp_path / "partial", progress=Stop(stage))
    resumed = study.run_study(untimed, tmp_path / "partial", resume=True).run
    assert runs.verify(resumed) == []
    for table in ("accuracy", "worst", "behaviour"):
        pd.testing.assert_frame_equal(getattr(resumed, table), getattr(whole, table), check_exact=True)
