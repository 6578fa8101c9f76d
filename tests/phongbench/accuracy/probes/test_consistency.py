"""Rows of different coverage contradict each other nowhere, and a planted contradiction is seen."""

from dataclasses import replace

import pandas as pd
import pytest

from phongbench.accuracy.probes import consistency
from phongbench.inputs.plan import preset
from phongbench.study import run as study

pytest.importorskip("flint")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    plan = replace(
        preset("quick"),
        probes=("cosines", "certify"),
        alphas=(10.0, 50.0),
        gammas=(4, 8),
        approximations=("phong", "lyon", "gaussian", "schlick"),
        slopes=("taylor", "minimax"),
        samples=6000,
        timing=False,
    ).validated()
    outcome = study.run_study(plan, tmp_path_factory.mktemp("coverage") / "run")
    assert outcome.violations == []
    return outcome.run


def planted(run, metric, value, **where):
    """The run's rows with one changed."""
    rows = run.accuracy.copy()
    chosen = rows["gated"].astype(bool)
    for column, wanted in where.items():
        chosen &= rows[column] == wanted
    index = rows[chosen].index[0]
    rows.loc[index, metric] = value if not callable(value) else value(rows.loc[index, metric])
    return rows


def test_a_study_holds_every_invariant(run):
    assert set(run.accuracy["coverage"]) >= {"sampled", "exhaustive", "certified"}
    assert consistency.violations(run.accuracy) == []
    assert run.manifest["violations"] == []


LYON = {"approximation": "lyon", "lambda_form": "dot", "space": "reflect", "alpha": 50.0, "precision": "float32"}


@pytest.mark.parametrize(
    ("where", "metric", "change", "words"),
    [
        ({"stratum": "cosines", "coverage": "sampled"}, "max_abs", 0.9, "sampled max_abs 0.9"),
        ({"stratum": "cosines", "coverage": "exhaustive"}, "max_above", -1.0, "exhaustive -1"),
        ({"stratum": "highlight"}, "model_max", 0.9, "model_max 0.9"),
        ({"stratum": "cosines", "coverage": "exhaustive"}, "rounding_max", -0.05, "sum of its bounded parts"),
        ({"stratum": "lengths"}, "model_max", 0.9, "is above its bound"),
    ],
)
def test_a_planted_contradiction_is_told_with_its_cell(run, where, metric, change, words):
    told = consistency.violations(planted(run, metric, change, **LYON, **where))
    assert told
    assert any(words in sentence for sentence in told)
    assert all("lyon:dot" in sentence and "alpha 50" in sentence for sentence in told)


@pytest.mark.parametrize(("share", "told"), [(2.0**-52, False), (1e-12, True)])
def test_parts_of_enormous_errors_add_up_but_for_their_own_rounding(run, share, told):
    """bfloat16 made 2e10 of a highlight once, and the sum of the parts was one unit in the last place smaller."""
    largest, rows = 20132659199.945396, planted(run, "max_abs", 20132659199.945396, **LYON, stratum="lengths")
    index = rows.index[rows["max_abs"] == largest][0]
    cell = (rows[consistency._CELL] == rows.loc[index, consistency._CELL]).all(axis=1)
    bound = rows[cell & (rows["coverage"] == "certified")]["model_max"].item() + consistency.slack(50.0)
    rows.loc[index, ["length_max", "rounding_max"]] = 0.0, largest / (1.0 + share) - bound
    sentences = [one for one in consistency.violations(rows) if "sum of its bounded parts" in one and "2013" in one]
    assert bool(sentences) == told


def test_a_bound_below_what_was_measured_is_told(run):
    rows = run.accuracy.copy()
    rows.loc[rows["coverage"] == "certified", "model_max"] *= 0.99
    told = consistency.violations(rows)
    assert len(told) == consistency.REPORTED + 1
    assert "more contradictions" in told[-1]


def test_a_violation_ends_the_study_with_its_sentence(run, tmp_path, monkeypatch):
    plan = replace(run.plan, alphas=(50.0,), approximations=("phong",), probes=(), samples=500).validated()
    monkeypatch.setattr(consistency, "violations", lambda accuracy: ["this cannot be"] * (len(accuracy) > 0))
    assert study.run_study(plan, tmp_path / "run").as_dict()["violations"] == ["this cannot be"]


def test_no_rows_contradict_nothing():
    assert consistency.violations(pd.DataFrame()) == []
