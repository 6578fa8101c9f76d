"""A whole study: stored, resumed after a kill with the same rows, forecast before it runs."""

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace

import pandas as pd
import pytest
from click.testing import CliRunner

from phongbench.accuracy import sweep
from phongbench.cli.main import main
from phongbench.errors import InputError, InterruptedStudyError
from phongbench.inputs.plan import preset
from phongbench.results import checkpoints, runs
from phongbench.study import run as study
from phongbench.study import run_folder, sweep_parts
from phongbench.study.forecast import forecast
from phongbench.support.progress import Progress


@pytest.fixture(scope="module")
def plan(tiny):
    forms = preset("quick").lambda_forms
    return tiny(alphas=(10.0, 50.0), lambda_forms=forms, raw=("phong/each", "lyon:dot:8:minimax/once"), samples=4000)


@pytest.fixture(scope="module")
def whole(plan, tmp_path_factory):
    """The uninterrupted study."""
    return study.run_study(plan, tmp_path_factory.mktemp("study") / "whole")


class Killer(Progress):
    """Interrupts the sweep after some blocks."""

    def __init__(self, after):
        self.left = after
        self.text = ""

    def stage(self, text, total=None):
        self.text = text

    def advance(self, steps=1):
        if self.text == "accuracy":
            self.left -= 1
            if not self.left:
                raise KeyboardInterrupt


def test_a_study_leaves_a_complete_run(whole, plan):
    run = runs.load(whole.run.path)
    assert run.complete
    assert run.plan == plan
    assert runs.verify(run) == []
    assert len(run.accuracy)
    assert set(run.manifest["files"]) == {"accuracy.parquet", "worst.parquet", "costs.parquet"}
    assert not (run.path / "parts").exists()
    told = whole.as_dict()
    keys = "run path cells evaluations seconds peak_mib failed_cells violations report"
    assert set(told) == set(keys.split())
    assert set(told["seconds"]) == {"compiling", "accuracy", "stability", "timing", "report", "total"}


def test_an_interrupted_study_is_resumed_with_the_same_rows(whole, plan, tmp_path, monkeypatch):
    monkeypatch.setattr(sweep_parts, "CHECKPOINT_SECONDS", 0.0)
    out = tmp_path / "run"
    with pytest.raises(InterruptedStudyError, match="interrupted") as caught:
        study.run_study(plan, out, progress=Killer(12))
    assert f"--out {out} --resume" in str(caught.value)
    assert not runs.load(out).complete
    kept = sum(len(frame) for frame in checkpoints.read_parts(out))
    assert kept > 0
    measured = []
    genuine = sweep.run

    def counted(*args, **kwargs):
        measured.append(len(kwargs["done"]))
        return genuine(*args, **kwargs)

    monkeypatch.setattr(sweep, "run", counted)
    resumed = study.run_study(plan, out, resume=True)
    assert measured[0] > 0
    pd.testing.assert_frame_equal(resumed.run.accuracy, whole.run.accuracy, check_exact=True)
    pd.testing.assert_frame_equal(resumed.run.worst, whole.run.worst, check_exact=True)


def test_a_killed_process_is_resumed_with_the_same_rows(tmp_path, monkeypatch):
    """SIGKILL in the middle of the real command, then --resume: the rows of a run that was never killed."""
    options = [
        "--alpha",
        "10,50,128",
        "--only",
        "lyon",
        "--precision",
        "float32",
        "--no-timing",
        "--no-report",
        "--samples",
        "150000",
    ]
    options += ["--gamma", "4,8", "--probe", "hostile,smoothness"]
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(main, ["run", *options, "--out", "whole"]).exit_code == 0
    code = "from phongbench.study import sweep_parts; sweep_parts.CHECKPOINT_SECONDS = 0.0"
    code += "; from phongbench.cli.main import main; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", code, "run", *options, "--out", "killed"],
        cwd=tmp_path,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    parts = tmp_path / "killed" / "parts"
    deadline = time.monotonic() + 600
    while time.monotonic() < deadline and len(list(parts.glob("0*.parquet"))) < 5:
        with suppress(subprocess.TimeoutExpired):
            process.wait(0.01)
            break
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert not runs.load(tmp_path / "killed").complete
    assert CliRunner().invoke(main, ["run", *options, "--out", "killed", "--resume"]).exit_code == 0
    whole, resumed = (runs.load(tmp_path / name).accuracy for name in ("whole", "killed"))
    pd.testing.assert_frame_equal(resumed, whole, check_exact=True)


def test_a_folder_with_a_run_is_not_overwritten(whole, plan):
    with pytest.raises(InputError, match="already holds a run"):
        study.run_study(plan, whole.run.path)


def test_a_finished_study_is_resumed_by_doing_what_is_left(whole, plan, monkeypatch):
    """Nothing is measured, not even by other code; a report that was not drawn is, and what a kill left is removed."""
    monkeypatch.setattr(sweep, "compile_kernels", None)
    monkeypatch.setattr(run_folder, "fingerprint_code", lambda: "other")
    before = (whole.run.path / "manifest.json").read_bytes()
    (whole.run.path / "parts").mkdir()
    (whole.run.path / "parts" / "000000.parquet").touch()
    again = study.run_study(
        plan, whole.run.path, resume=True, build_report=lambda run, folder, reached: folder / run.id
    )
    assert (again.cells, again.evaluations) == (whole.cells, whole.evaluations)
    assert again.report == whole.run.path / "report" / whole.run.id
    assert (whole.run.path / "manifest.json").read_bytes() == before
    assert not (whole.run.path / "parts").exists()
    with pytest.raises(InputError, match="another plan"):
        study.run_study(replace(plan, seed=9), whole.run.path, resume=True)


def test_only_the_same_plan_and_code_are_resumed(plan, tmp_path, monkeypatch):
    with pytest.raises(InterruptedStudyError):
        study.run_study(plan, tmp_path / "run", progress=Killer(1))
    with pytest.raises(InputError, match="another plan"):
        study.run_study(replace(plan, seed=9), tmp_path / "run", resume=True)
    monkeypatch.setattr(run_folder, "fingerprint_code", lambda: "other")
    with pytest.raises(InputError, match="other code"):
        study.run_study(plan, tmp_path / "run", resume=True)
    with pytest.raises(InputError, match="nothing to resume"):
        study.run_study(plan, tmp_path / "empty", resume=True)


def test_fresh_discards_what_was_there(whole, plan, tmp_path):
    out = tmp_path / "run"
    with pytest.raises(InterruptedStudyError):
        study.run_study(replace(plan, seed=3), out, progress=Killer(1))
    again = study.run_study(plan, out, fresh=True)
    pd.testing.assert_frame_equal(again.run.accuracy, whole.run.accuracy, check_exact=True)


def test_a_forecast_counts_rightly(whole, plan):
    told = forecast(plan)
    assert told.cells == whole.cells
    assert told.evaluations == whole.evaluations
    assert told.rows == (whole.run.accuracy["stratum"] != "cosines").sum()
    assert told.seconds["accuracy"] > 0
    stored = sum(facts["bytes"] for facts in whole.run.manifest["files"].values())
    assert 0.2 < told.bytes / stored < 5


def test_a_timing_budget_that_is_too_short_gives_way_and_is_told(plan, tmp_path):
    notes = []

    class Listener(Progress):
        def note(self, text):
            notes.append(text)

    timed = replace(plan, alphas=(10.0,), timing=True, timing_budget=0.001, samples=100).validated()
    run = study.run_study(timed, tmp_path / "run", progress=Listener()).run
    assert len(run.timing)
    assert any("0.001 s are too short" in note and "it may take" in note for note in notes)
