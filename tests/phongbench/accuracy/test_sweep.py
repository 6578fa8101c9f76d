"""The sweep: the laws of the field hold in its rows, and its rows do not depend on how it is run."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from phongbench.accuracy import sweep, tables
from phongbench.benchmarks import numpy_sweep
from phongbench.formulas import error_laws
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation, Cost
from phongbench.inputs.plan import preset
from phongbench.results.schema import ACCURACY


def lyon(frame, form, policy="taylor"):
    chosen = (frame["approximation"] == "lyon") & (frame["lambda_form"] == form) & (frame["beta_policy"] == policy)
    return frame[chosen & (frame["truth"] == "angle")]


def signed(row):
    """The error of larger size, exact - approximation."""
    return row["max_below"] if row["max_below"] >= row["max_above"] else -row["max_above"]


def tolerance(gamma):
    """Law 1 of the notes holds within 1 % for gamma >= 4, and about 4 % at gamma = 2."""
    return 0.011 if gamma >= 4 else 0.045


@pytest.mark.parametrize("form", ["dot", "difference"])
def test_law_1_lyon_on_unit_vectors(law_rows, form):
    unit = lyon(law_rows[law_rows["stratum"] == "highlight"], form)
    unit = unit[unit["alpha"] >= 10]
    assert len(unit) == 11 * 6
    for _, row in unit.iterrows():
        wanted = error_laws.lyon_taylor_dot(row["alpha"], row["gamma"])
        # the law subtracts two terms of this size; where they nearly cancel its error stays a share of them
        assert (
            abs(signed(row) - wanted)
            <= tolerance(row["gamma"]) * (abs(wanted) + 0.02 * error_laws.E(1 / row["gamma"])) + 1e-9
        )


def test_law_2_cross_is_dot_at_half_the_exponent(law_rows):
    unit = law_rows[law_rows["stratum"] == "highlight"]
    cross = lyon(unit, "cross").set_index(["alpha", "gamma"])
    dot = lyon(unit, "dot").set_index(["alpha", "gamma"])
    compared = 0
    for alpha, gamma in cross.index:
        if (alpha / 2, gamma) in dot.index and alpha / 2 >= 10:
            assert signed(cross.loc[alpha, gamma]) == pytest.approx(
                signed(dot.loc[alpha / 2, gamma]), rel=2e-3, abs=1e-5
            )
            compared += 1
    assert compared >= 24


def test_law_3_every_form_has_its_kappa(law_rows):
    unit = law_rows[law_rows["stratum"] == "highlight"]
    for form, kappa in (("dot", 1), ("difference", 1), ("cross", 2), ("tan2", -2)):
        chosen = lyon(unit, form)
        for _, row in chosen[(chosen["alpha"] >= 50) & (chosen["gamma"] >= 8)].iterrows():
            scale = 0.2707 * (1 / row["gamma"] + abs(kappa) / row["alpha"])
            assert abs(signed(row) - error_laws.leading(row["alpha"], row["gamma"], kappa)) < 0.06 * scale


def test_lyon_at_gamma_equal_to_alpha_is_phong(law_rows):
    unit = lyon(law_rows[law_rows["stratum"] == "highlight"], "difference")
    same = unit[unit["alpha"] == unit["gamma"]]
    assert sorted(same["alpha"]) == [32, 64]
    assert same["max_abs"].max() < 1e-13


def test_law_5_minimax_slope_more_than_halves_the_error(law_rows):
    unit = law_rows[law_rows["stratum"] == "highlight"]
    for alpha, gamma, wanted in ((50, 8, 0.01363), (200, 16, 0.00734), (1000, 8, 0.01603)):
        chosen = lyon(unit, "dot", "minimax")
        found = chosen[(chosen["alpha"] == alpha) & (chosen["gamma"] == gamma)]["max_abs"].item()
        assert found == pytest.approx(wanted, rel=5e-3)


def test_law_7_gaussian(law_rows):
    chosen = law_rows[(law_rows["approximation"] == "gaussian") & (law_rows["stratum"] == "highlight")]
    chosen = chosen[(chosen["lambda_form"] == "dot") & (chosen["beta_policy"] == "taylor")].set_index("alpha")[
        "max_abs"
    ]
    for alpha, wanted in ((10, 0.0280), (50, 0.00545), (200, 0.00136), (1000, 0.00027)):
        assert chosen[alpha] == pytest.approx(wanted, rel=0.02)


def test_law_8_lengths_move_each_form_as_its_peak_law_says(law_rows):
    frame = law_rows[(law_rows["stratum"] == "lengths") & (law_rows["perturbation"] == "a")]
    frame = frame[frame["length_error"] == 0.01]
    for form, peak in (
        ("dot", error_laws.dot_peak),
        ("difference", lambda alpha, gamma, e, d: max(0.0, 1 - alpha / gamma * (e - d) ** 2 / 2) ** gamma),
        ("cross", lambda *_: 1.0),
    ):
        for _, row in lyon(frame, form).iterrows():
            change = abs(peak(row["alpha"], row["gamma"], 0.01, 0.0) - 1)
            # at least what happens at the peak; sampled near it, not on it
            assert row["length_max"] > 0.9 * change - 1e-4
    chosen = lyon(frame, "dot").set_index(["alpha", "gamma"])
    assert chosen.loc[128, 64]["above_one"] > 0
    assert 1 + chosen.loc[128, 64]["max_above"] == pytest.approx(error_laws.dot_peak(128, 64, 0.01, 0.0), rel=0.02)


def test_law_8_changes_of_difference_and_cross(law_rows):
    frame = law_rows[
        (law_rows["stratum"] == "lengths") & (law_rows["perturbation"] == "a") & (law_rows["length_error"] == 0.01)
    ]
    for form, wanted in (("difference", 0.0070), ("cross", 0.0074)):
        row = lyon(frame, form).set_index(["alpha", "gamma"]).loc[128, 64]
        assert row["length_max"] == pytest.approx(wanted, rel=0.05)


def test_an_error_is_never_more_than_its_parts(small_rows):
    parts = small_rows["model_max"] + small_rows["length_max"] + small_rows["rounding_max"]
    finite = small_rows["nonfinite"] == 0
    assert (small_rows["max_abs"] <= parts * (1 + 1e-9) + 1e-15)[finite].all()


def test_unit_vectors_have_one_truth_and_others_two(small_rows):
    truths = small_rows.groupby("stratum")["truth"].unique().map(set)
    for name, found in truths.items():
        assert found == ({"angle", "given"} if name in ("lengths", "hostile") else {"angle"})


def test_rows_have_the_columns_and_keys_of_the_contract(small_rows):
    assert list(small_rows.columns) == ACCURACY.names
    assert not small_rows.duplicated(ACCURACY.key).any()


def test_the_ungated_cross_form_shines_again_at_the_antipode(small_rows):
    chosen = small_rows[(small_rows["approximation"] == "lyon") & (small_rows["stratum"] == "grazing")]
    chosen = chosen[
        (chosen["precision"] == "float32") & (chosen["lambda_form"] == "cross") & (chosen["space"] == "reflect")
    ]
    assert (chosen[~chosen["gated"]]["max_above"] > 0.999).all()
    assert (chosen[chosen["gated"]]["max_above"] < 0.2).all()


def test_hostile_vectors_are_counted_and_never_crash(small_rows):
    hostile = small_rows[small_rows["stratum"] == "hostile"]
    assert (hostile["nonfinite"] > 0).any()
    assert (hostile["excluded"] >= hostile["nonfinite"]).all()
    assert hostile["max_abs"].map(np.isfinite).all()


def test_rows_are_the_same_bits_for_any_number_of_threads(small_plan, small_rows, swept):
    pd.testing.assert_frame_equal(swept(small_plan, jobs=1), small_rows, check_exact=True)


def test_many_slabs_give_the_same_bits_on_one_thread_and_on_three(monkeypatch, swept):
    plan = replace(
        preset("quick"),
        alphas=(50.0,),
        gammas=(8,),
        approximations=("phong", "lyon"),
        strata=("highlight", "lengths"),
        precisions=("float32",),
        spaces=("reflect",),
        samples=40_000,
        timing=False,
    ).validated()
    monkeypatch.setattr(sweep, "SLAB", 1 << 14)
    pd.testing.assert_frame_equal(swept(plan, jobs=1), swept(plan, jobs=3), check_exact=True)


def test_contexts_that_are_done_are_left_out(small_plan):
    prepared = sweep.prepare(small_plan)
    sweep.compile_kernels(prepared)
    skipped = {c.index for c in prepared.batches[:-2]}
    assert [m.batch.index for m in sweep.run(prepared, done=skipped)] == [c.index for c in prepared.batches[-2:]]


def test_numpy_finds_the_same_rows(swept):
    """The yardstick is a second oracle: other code, other order of operations, the same errors."""
    plan = replace(
        numpy_sweep.plan_of_bench(9000),
        precisions=("float64",),
        strata=("uniform", "highlight", "grazing", "lengths"),
        alphas=(10.0, 200.0),
        gammas=(2, 16),
    )
    prepared = sweep.prepare(plan.validated())
    other = pd.DataFrame(numpy_sweep.numpy_sweep(prepared)).set_index(ACCURACY.key).sort_index()
    ours = swept(plan.validated()).set_index(ACCURACY.key).sort_index()
    assert len(ours) == len(other)
    for column in ("max_abs", "mean_abs", "rms", "bias", "max_above", "max_below", "model_max", "length_max"):
        difference = np.abs(ours[column].to_numpy() - other[column].to_numpy(dtype=float))
        assert difference.max() < 1e-11 + 1e-9 * np.abs(ours[column]).max(), column
    # quantiles come from every second chunk of pairs: another sample of the same errors
    bright = ours.index.get_level_values("stratum") == "highlight"
    ratio = (ours["p99_abs"] + 1e-6).to_numpy() / (other["p99_abs"] + 1e-6).to_numpy(dtype=float)
    assert np.abs(ratio[bright] - 1).max() < 0.1


def test_a_formula_that_fails_fails_alone():
    broken = Approximation(
        name="broken",
        title="Broken",
        kind="approximation",
        formula="1 / 0",
        source=REGISTRY["lyon"].source,
        kernel=REGISTRY["gaussian"].kernel,
        coefficients=lambda s: {"sharpness": 1 / (s.alpha - 50)},
        domain="none",
        cost=Cost("none"),
    )
    registry = dict(REGISTRY) | {"broken": broken}
    plan = replace(
        preset("quick"),
        alphas=(10.0, 50.0),
        approximations=("broken",),
        strata=("highlight",),
        spaces=("reflect",),
        precisions=("float32",),
        samples=1000,
        timing=False,
    ).validated(registry)
    prepared = sweep.prepare(plan, registry)
    sweep.compile_kernels(prepared)
    assert {prepared.cells[i].alpha for i in prepared.failures} == {50.0}
    assert all("ZeroDivisionError" in message for message in prepared.failures.values())
    frame = tables.accuracy(prepared, [tables.part(list(sweep.run(prepared)))])
    assert set(frame[frame["approximation"] == "broken"]["alpha"]) == {10.0}
    assert set(frame[frame["approximation"] == "phong"]["alpha"]) == {10.0, 50.0}


def test_worst_inputs_reproduce_their_error(small_plan):
    prepared = sweep.prepare(small_plan)
    sweep.compile_kernels(prepared)
    worst = tables.worst(prepared, [tables.part(list(sweep.run(prepared)))])
    assert (
        worst.groupby(
            ["approximation", "lambda_form", "space", "alpha", "gamma", "precision", "gated", "normalise"], dropna=False
        )
        .size()
        .max()
        <= 5  # three on unit vectors, one on wrong lengths, one hostile
    )
    chosen = worst[(worst["precision"] == "float32") & (worst["stratum"] == "lengths") & (worst["truth"] == "given")]
    assert len(chosen)
    for _, row in chosen.head(20).iterrows():
        a, b = (np.array([float.fromhex(row[f"{v}{c}"]) for c in "xyz"]) for v in "ab")
        x = max(float(a @ b), 0.0)
        wanted = max(2 * x * x - 1, 0) if row["space"] == "half" else x
        assert wanted ** row["alpha"] == pytest.approx(row["exact"], rel=1e-9, abs=1e-300)
        assert abs(row["value"] - row["exact"]) == pytest.approx(row["error"], rel=1e-12)
