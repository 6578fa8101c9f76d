"""The search: never below the samples, never beyond what there is, and every find reproduces."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from phongbench.accuracy import sweep, tables
from phongbench.accuracy.probes import consistency, search
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.accuracy.probes.search_cells import LONGEST, NOT_UNIT, key_of, stored
from phongbench.compiler.lowering import precision_named
from phongbench.inputs.plan import preset
from phongbench.results.frames import as_given
from phongbench.results.schema import ACCURACY, WORST

CELL = ["approximation", "lambda_form", "space", "beta_policy", "alpha", "gamma", "precision"]
PAIR = ["ax", "ay", "az", "bx", "by", "bz"]


def context_of(**wishes):
    plan = replace(
        preset("quick"),
        **{"preset": "standard", "gammas": (8,), "approximations": ("phong", "lyon"), "slopes": ("taylor",)}
        | {"samples": 4096, "spaces": ("reflect",), "strata": consistency.UNIT_STRATA, "timing": False}
        | wishes,
    ).validated()
    prepared = sweep.prepare(plan)
    sweep.compile_kernels(prepared)
    parts = [tables.part(list(sweep.run(prepared)))]
    return ProbeContext(prepared, tables.accuracy(prepared, parts), tables.worst(prepared, parts), 2)


@pytest.fixture(scope="module")
def context():
    return context_of(alphas=(10.0, 50.0, 1000.0), precisions=("float32",))


@pytest.fixture(scope="module")
def found(context):
    return search.measure(context)


def test_every_gated_cell_has_a_row_and_its_worst_input(context, found):
    accuracy, worst = found["accuracy"], found["worst"]
    assert list(accuracy.columns) == ACCURACY.names
    assert list(worst.columns) == WORST.names
    plain = sum(cell.gated and not cell.formula.raw for cell in context.sweep.cells)
    raw = sum(cell.formula.raw and cell.formula.recipe == "pair" for cell in context.sweep.cells)
    assert len(as_given(accuracy)) == plain
    assert len(accuracy) == len(worst) == plain + len(LONGEST) * raw
    assert set(accuracy["coverage"]) == {"searched"}
    assert not accuracy.duplicated(ACCURACY.key).any()
    assert (accuracy["samples"] > search.LEVELS * search.BOXES * search.POINTS).all()


def test_it_finds_no_less_than_the_samples(context, found):
    whole = pd.concat([context.accuracy, found["accuracy"]], ignore_index=True)
    assert consistency.violations(whole) == []
    sampled = as_given(context.accuracy[context.accuracy["gated"].astype(bool)])
    sampled = sampled.groupby(CELL, dropna=False)["max_abs"].max().reset_index()
    both = as_given(found["accuracy"]).merge(sampled, on=CELL, suffixes=("", "_sampled"))
    assert len(both) == len(as_given(found["accuracy"]))
    # 4096 samples a stratum miss rounding's worst by far
    assert (both["max_abs"] > both["max_abs_sampled"]).mean() > 0.8


def test_every_find_reproduces_and_lies_in_the_domain(found, exact_angle):
    for _, row in found["worst"].iterrows():
        pair = np.array([float.fromhex(row[name]) for name in PAIR])
        np.testing.assert_array_equal(pair, pair.astype(np.float32))
        for length in (np.linalg.norm(pair[:3]), np.linalg.norm(pair[3:])):
            if row["normalise"] == "none":
                assert abs(length - 1) <= 2.0**-23
            else:
                assert 1 / (1 + row["length_error"]) <= length <= 1 + row["length_error"]
        exact = float(exact_angle(pair[:3], pair[3:], row["alpha"]))
        assert row["exact"] == pytest.approx(exact, abs=1e-12)
        assert row["error"] == abs(row["value"] - row["exact"])


def test_no_length_from_a_thousandth_to_a_thousand_does_more_than_round(found):
    """Of each, once and squared the bar is 4 eps alpha; cheap roots leave what they err, at either end of the range."""
    raw = found["accuracy"][found["accuracy"]["normalise"] != "none"]
    assert set(raw["perturbation"]) == {"any"}
    assert set(raw["length_error"]) == {1.0, 999.0}
    assert set(raw["normalise"]) == {"each", "once", "squared", "fast", "estimate"}
    phong = raw[raw["approximation"] == "phong"]
    exact = phong[phong["normalise"].isin(["each", "once", "squared"])]
    assert (exact["max_abs"] <= 4 * 2.0**-23 * exact["alpha"]).all()
    for name, root in (("fast", 1.752e-3), ("estimate", 1.5 * 2.0**-12)):
        cheap = phong[phong["normalise"] == name]
        worst = np.maximum((1 + root) ** (2 * cheap["alpha"]) - 1, 1 - (1 - root) ** (2 * cheap["alpha"]))
        assert (cheap["max_abs"] <= 1.01 * worst).all()
        assert (cheap["max_abs"] > 0.5 * (1 - (1 - root) ** (2 * cheap["alpha"]))).all()


def test_threads_change_no_bit(context, found):
    alone = search.measure(replace(context, jobs=1))
    for name, frame in found.items():
        pd.testing.assert_frame_equal(frame, alone[name])


def test_a_stored_worst_input_is_never_lost(context, found):
    """What was stored before is where the search starts: an error planted there comes back."""
    worst = context.worst.copy()
    worst.loc[worst["gated"] & (worst["rank"] == 1), "error"] = 7.0
    again = search.measure(replace(context, worst=worst))
    assert (again["accuracy"]["max_abs"] == 7.0).all()


def test_the_worst_cosine_seeds_the_search_but_counts_for_nothing(context):
    cosine = context.worst.query("gated and rank == 1").assign(stratum="cosines", coverage="exhaustive", error=7.0)
    worst = pd.concat([context.worst, cosine], ignore_index=True)
    cell = next(c for c in context.sweep.cells if c.gated)
    kept = stored(worst, NOT_UNIT)[key_of(cell)]
    assert sorted(candidate[0] for candidate in kept)[:1] == [-1.0]
    again = search.measure(replace(context, worst=worst))["accuracy"]
    assert (as_given(again)["max_abs"] < 1).all()


@pytest.mark.parametrize("form", ["dot", "difference", "cross"])
def test_in_a_tiny_format_it_comes_near_the_worst_of_all_pairs(form):
    """Nearly unit vectors of eighths: all pairs of them can be gone through."""
    precision = precision_named("q1.3")
    context = context_of(
        alphas=(10.0,), precisions=(precision.name,), lambda_forms=(form,), approximations=("lyon",), samples=16
    )
    axis = precision.representables(-2.0, 2.0)
    grid = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    unit = grid[np.abs(np.linalg.norm(grid, axis=1) - 1) <= precision.eps]
    position = next(p for p, c in enumerate(context.sweep.cells) if c.gated and c.approximation == "lyon")
    cell = search._Cell(context.sweep.cells[position], context.sweep.kernels(position)[0], precision.eps)
    everything = max(cell.errors(np.hstack([np.tile(a, (len(unit), 1)), unit])).max() for a in unit)
    searched = search.measure(context)["accuracy"].query("approximation == 'lyon'")["max_abs"].item()
    assert 0.9 * everything <= searched <= everything


def test_float64_is_not_searched_and_a_run_without_cells_has_no_rows():
    assert search.measure(context_of(alphas=(10.0,), precisions=("float64",))) == {}


def test_a_place_that_is_kept_for_every_cell_keeps_no_points_with_it(context):
    cell = context.sweep.cells[0]
    searched = search._Cell(cell, context.sweep.kernels(0)[0], 2.0**-23)
    place, _ = search._boxes(searched, None, search._random(0)[False][:2])
    assert place.base is None
    assert place.nbytes == 32


def test_the_forecast_counts_the_cells(context, found):
    assert search.seconds(context.plan, 1) == pytest.approx(search.SECONDS * len(found["accuracy"]))
