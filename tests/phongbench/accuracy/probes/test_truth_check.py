"""The re-check at 50 digits: the stated errors hold, and a wrong exact value is told."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from phongbench.accuracy import sweep, tables
from phongbench.accuracy.probes import exhaustive, truth_check
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.formulas import exact
from phongbench.inputs.plan import preset


@pytest.fixture(scope="module")
def context():
    plan = replace(
        preset("quick"),
        alphas=(0.3, 1.0, 50.0, 1000.0),
        gammas=(8,),
        approximations=("phong", "lyon", "blinn"),
        slopes=("taylor",),
        precisions=("float16", "float32", "float64"),
        samples=2048,
        timing=False,
    ).validated()
    prepared = sweep.prepare(plan)
    sweep.compile_kernels(prepared)
    parts = [tables.part(list(sweep.run(prepared)))]
    context = ProbeContext(prepared, tables.accuracy(prepared, parts), tables.worst(prepared, parts), 2)
    more = exhaustive.measure(context)["worst"]
    return replace(context, worst=pd.concat([context.worst, more], ignore_index=True))


@pytest.mark.parametrize("with_flint", [True, False])
def test_every_exact_value_is_within_its_stated_error(context, monkeypatch, with_flint):
    if with_flint:
        pytest.importorskip("flint")
    monkeypatch.setattr(truth_check, "find_spec", lambda name: "there" if with_flint else None)
    monkeypatch.setattr(truth_check, "RANDOM", 10_000 if with_flint else 500)
    asked = replace(context, worst=context.worst if with_flint else context.worst[::9], violations=[], facts={})
    assert truth_check.measure(asked) == {}
    assert asked.violations == []
    facts = asked.facts["recheck"]
    assert facts["arithmetic"] == ("python-flint" if with_flint else "mpmath")
    assert facts["random_values"] >= 0.9 * truth_check.RANDOM
    assert facts["worst_values"] >= 0.8 * len(asked.worst)
    for name in ("random", "worst"):
        assert 0 < facts[f"{name}_share"] < 1
        # at alpha 0.3 the power has no slope at 90 degrees: (16 u)^0.3
        assert 0 < facts[f"{name}_disagreement"] < 4e-5


@pytest.mark.parametrize("stratum", ["highlight", "cosines", "lengths"])
def test_a_wrong_exact_value_is_told_with_its_input(context, stratum):
    worst = context.worst.copy()
    index = worst[(worst["stratum"] == stratum) & (worst["precision"] == "float32") & (worst["alpha"] == 50)].index[0]
    worst.loc[index, "exact"] += 1e-11
    asked = replace(context, worst=worst, violations=[], facts={})
    truth_check.measure(asked)
    assert len(asked.violations) == 1
    assert f"worst {stratum} input" in asked.violations[0]
    assert "alpha 50" in asked.violations[0]
    assert asked.facts["recheck"]["worst_share"] > 1


def test_many_wrong_values_are_summed_up(context):
    asked = replace(context, worst=context.worst.assign(exact=context.worst["exact"] + 0.1), violations=[], facts={})
    truth_check.measure(asked)
    assert len(asked.violations) == truth_check.REPORTED + 1
    assert "more worst exact values" in asked.violations[-1]


def test_the_stated_error_of_the_angle_is_small_and_grows_like_the_root_of_alpha():
    assert exact.angle_error(50.0) < 1e-14
    assert exact.angle_error(1e4) < 3e-14
    assert exact.angle_error(50.0, half_space=True) == 2 * exact.angle_error(50.0)
    assert exact.angle_error(0.01) > 0.1  # below alpha = 1 the power has no slope at 90 degrees


def test_lengths_that_float64_cannot_square_are_left_out():
    ones = (0.0, 0.0, 1.0)
    assert truth_check._holds((*ones, *ones))
    for hostile in (0.0, 1e-200, 1e160, np.inf, np.nan):
        assert not truth_check._holds((*ones, hostile, 0.0, 0.0))


def test_the_forecast_asks_whether_flint_is_there(context, monkeypatch):
    cells = sum(1 for _ in context.plan.cells())
    for there in (True, False):
        monkeypatch.setattr(truth_check, "find_spec", lambda name, there=there: "there" if there else None)
        assert truth_check.seconds(context.plan, 1) == truth_check.SECONDS[there] * (truth_check.RANDOM + 5 * cells)
