"""Probes: what a study asks after the sweep."""

from dataclasses import replace

import pandas as pd
import pytest

from phongbench.accuracy import probes
from phongbench.accuracy.probes import Probe
from phongbench.errors import InterruptedStudyError, UnknownNameError
from phongbench.inputs import plan as plans
from phongbench.results import runs, schema
from phongbench.study import run as study
from phongbench.study.forecast import forecast

CASE = "zero"


@pytest.fixture
def asked(small_plan, monkeypatch):
    """A plan with one probe, which notes every call, gives a table and further accuracy rows, and finds a violation."""
    calls = []

    def measure(context):
        calls.append(context.plan)
        context.advance(1.0)
        context.violations.append("this cannot be")
        first = context.accuracy.head(1)
        behaviour = first.assign(case=CASE, outcome="value", lowest=0.0, highest=1.0, exact=1.0)
        return {"accuracy": first, "behaviour": behaviour[schema.BEHAVIOUR.names]}

    monkeypatch.setattr(plans, "PROBE_NAMES", ("hostility",))
    monkeypatch.setattr(probes, "PROBES", (Probe("hostility", "asking", measure, lambda plan, jobs: 7.0),))
    wanted = replace(small_plan, probes=("hostility",), samples=100, precisions=("float32",)).validated()
    return wanted, calls


def test_a_probe_adds_tables_and_rows_and_its_violations_are_told(asked, tmp_path):
    plan, calls = asked
    outcome = study.run_study(plan, tmp_path / "run")
    run = runs.load(outcome.run.path)
    assert calls == [plan]
    assert list(run.behaviour["case"]) == [CASE]
    without = study.run_study(replace(plan, probes=()), tmp_path / "without").run
    assert len(run.accuracy) == len(without.accuracy) + 1
    assert without.behaviour.empty
    pd.testing.assert_frame_equal(run.accuracy[: len(without.accuracy)], without.accuracy)
    assert outcome.as_dict()["violations"] == run.manifest["violations"] == ["this cannot be"]
    assert runs.verify(run) == []


def test_a_finished_probe_is_not_asked_again_when_a_run_is_resumed(asked, tmp_path, monkeypatch):
    plan, calls = asked
    genuine = runs.write_table
    monkeypatch.setattr(runs, "write_table", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(InterruptedStudyError):
        study.run_study(plan, tmp_path / "run")
    monkeypatch.setattr(runs, "write_table", genuine)
    outcome = study.run_study(plan, tmp_path / "run", resume=True)
    assert len(calls) == 1
    assert outcome.violations == ["this cannot be"]
    assert list(runs.load(tmp_path / "run").behaviour["case"]) == [CASE]


def test_the_forecast_counts_the_probes(asked):
    assert forecast(asked[0]).seconds["stability"] == 7.0


def test_an_unknown_probe_is_refused(small_plan):
    with pytest.raises(UnknownNameError, match="probe"):
        replace(small_plan, probes=("astrology",)).validated()


def test_every_name_has_its_probe():
    assert tuple(p.name for p in probes.PROBES) == plans.PROBE_NAMES
