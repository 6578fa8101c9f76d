"""Every cosine: nothing is left out, nothing is counted twice, and the rows are what an obvious loop finds."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from phongbench import testing
from phongbench.accuracy import sweep
from phongbench.accuracy.probes import exhaustive
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.compiler.precisions import BFLOAT16, FLOAT16, FLOAT32, precision_named
from phongbench.formulas.spec import Setting
from phongbench.inputs.plan import preset
from phongbench.results.schema import ACCURACY, CASE, WORST


@pytest.fixture(scope="module")
def plan():
    return replace(
        preset("quick"),
        alphas=(10.0, 50.0),
        gammas=(8,),
        approximations=("phong", "lyon", "schlick"),
        slopes=("taylor",),
        timing=False,
        raw=(),
        probes=("cosines",),
        precisions=("q1.10", "q1.23", "float16", "bfloat16", "float32", "float64"),
        samples=5000,
    ).validated()


@pytest.fixture(scope="module")
def context(plan):
    return ProbeContext(sweep.prepare(plan), pd.DataFrame(), pd.DataFrame(), 2)


@pytest.fixture(scope="module")
def found(context):
    return exhaustive.measure(context)


def test_the_numbers_of_float16_are_all_there():
    everything = np.arange(65536, dtype=np.uint16).view(np.float16).astype(np.float32)
    inside = np.unique(everything[(everything >= -1) & (everything <= 1)])
    np.testing.assert_array_equal(exhaustive.representables(FLOAT16, -1.0, 1.0), inside)
    np.testing.assert_array_equal(exhaustive.representables(FLOAT16, 0.0, 1.0), inside[inside >= 0])
    np.testing.assert_array_equal(
        exhaustive.representables(FLOAT16, -0.5, -0.25), inside[(inside >= -0.5) & (inside <= -0.25)]
    )


def test_float32_has_8388609_cosines_from_a_half_to_one_each_met_once(plan):
    domain = next(d for d in exhaustive.domains(plan) if d.precision == FLOAT32)
    values = domain.values
    assert len(values) == 8_388_609
    np.testing.assert_array_equal(np.sort(values), 0.5 + np.arange(8_388_609) * 2.0**-24)
    # any run of them is a fair sample: the percentiles are read from half of the chunks
    assert values[:4096].mean() == pytest.approx(0.75, abs=1e-3)


def test_the_rows_are_whole_and_unique(found):
    assert list(found["accuracy"].columns) == ACCURACY.names
    assert list(found["worst"].columns) == WORST.names
    assert not found["accuracy"].duplicated(ACCURACY.key).any()
    assert set(found["accuracy"]["coverage"]) == {"exhaustive", "sampled"}
    assert (found["accuracy"]["nonfinite"] == 0).all()
    assert set(found["accuracy"]["precision"]) == {"q1.10", "float16", "bfloat16", "float32"}


@pytest.mark.parametrize("name", ["phong", "lyon", "schlick"])
@pytest.mark.parametrize("precision", [FLOAT16, BFLOAT16, FLOAT32, precision_named("q1.10")], ids=lambda p: p.name)
def test_an_obvious_loop_finds_the_same_maxima(context, found, name, precision):
    x = exhaustive.representables(precision, 0.5 if precision == FLOAT32 else -1.0, 1.0).astype(float)
    rows = found["accuracy"].query(f"approximation == '{name}' and precision == '{precision.name}'")
    rows = rows[rows["gated"] & (rows["space"] == "reflect") & (rows["coverage"] == "exhaustive")]
    assert sorted(rows["alpha"]) == [10, 50]
    spec = context.registry[name]
    for _, row in rows.iterrows():
        setting = Setting(row["alpha"], None if pd.isna(row["gamma"]) else int(row["gamma"]), row["beta_policy"])
        coordinate = x if spec.coordinate == "cosine" else precision.rounded(1 - x)
        value = np.where(x > 0, testing.compiled(spec, setting, precision, coordinate), 0).astype(float)
        error = value - np.maximum(x, 0) ** setting.alpha
        assert row["samples"] == len(x)
        assert row["max_above"] == pytest.approx(max(error.max(), 0), abs=1e-15)
        assert row["max_below"] == pytest.approx(max(-error.min(), 0), abs=1e-15)
        assert row["rms"] == pytest.approx(np.sqrt((error**2).mean()), rel=1e-9)
        assert row["above_one"] == (value > 1).sum()


def test_a_sample_is_never_worse_than_everything(found):
    rows = found["accuracy"]
    both = rows[rows["coverage"] == "sampled"].merge(
        rows[rows["coverage"] == "exhaustive"], on=CASE, suffixes=("", "_all")
    )
    assert len(both) == len(rows) / 2
    assert (both["samples"] < both["samples_all"]).all()
    for name in ("max_abs", "max_above", "max_below", "model_max", "rounding_max", "above_one", "negative"):
        assert (both[name] <= both[f"{name}_all"]).all()


def test_threads_change_no_bit(context, found):
    alone = exhaustive.measure(replace(context, jobs=1))
    for name, frame in found.items():
        pd.testing.assert_frame_equal(frame, alone[name])


def test_worst_inputs_are_unit_vectors_with_the_cosine_and_reproduce_their_error(context, found):
    worst = found["worst"]
    assert (
        len(worst)
        == (found["accuracy"]["coverage"] == "exhaustive").sum() - (found["accuracy"]["max_abs"] == 0).sum() / 2
    )
    for _, row in worst[worst["gated"] & (worst["space"] == "reflect")].iterrows():
        a, b = ([float.fromhex(row[f"{v}{axis}"]) for axis in "xyz"] for v in "ab")
        assert np.dot(b, b) == pytest.approx(1, abs=1e-15)
        assert max(0.0, float(np.dot(a, b))) ** row["alpha"] == pytest.approx(row["exact"], abs=1e-13)
        assert abs(row["value"] - row["exact"]) == row["error"]


def test_the_ungated_dot_form_is_measured_behind_the_surface(found):
    rows = found["accuracy"]
    ungated = rows[~rows["gated"].astype(bool)]
    assert set(ungated["precision"]) == {"q1.10", "float16", "bfloat16"}
    assert set(ungated["lambda_form"]) == {"dot"}


def test_the_forecast_counts_what_is_done(plan, found):
    done = found["accuracy"].query("coverage == 'exhaustive'")["samples"].sum()
    assert exhaustive.seconds(plan, 1) * exhaustive.RATE == pytest.approx(done)
