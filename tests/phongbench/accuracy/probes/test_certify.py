"""Certified bounds: they hold, they are tight, and they come from the kernels' own bodies."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from phongbench.accuracy import sweep
from phongbench.accuracy.probes import consistency
from phongbench.accuracy.probes.certify import bounds, sets
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.formulas.kernel import evaluate
from phongbench.formulas.lambda_forms import deficit_of_angle
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Setting
from phongbench.inputs.plan import preset
from phongbench.results.schema import ACCURACY

flint = pytest.importorskip("flint")
balls = pytest.importorskip("phongbench.accuracy.probes.certify.taylor_balls")
ranges = pytest.importorskip("phongbench.accuracy.probes.certify.intervals")

CELL = ["approximation", "lambda_form", "space", "beta_policy", "alpha", "gamma"]
DEFICITS = np.concatenate([[0.0], np.geomspace(1e-7, 1, 4001)])


def dense(spec, form, setting):
    """|approximation - exact| on a dense grid of deficits, by the compiled float64 kernel."""
    cosine = 1 - DEFICITS
    coordinate = cosine if form == "none" else deficit_of_angle(form, cosine)
    reflected = 2 * cosine**2 - 1 if setting.space == "half" else cosine
    gate = np.where(DEFICITS < 1, 1.0, 0.0)
    return np.abs(evaluate(spec, setting, coordinate, gate) - np.maximum(reflected, 0) ** setting.alpha)


SOME = [
    *(
        ("lyon", form, Setting(a, g, "taylor"))
        for form in ("dot", "cross", "tan2")
        for a, g in ((1.0, 8), (50.0, 4), (1e4, 128))
    ),
    ("lyon", "dot", Setting(50.0, 8, "minimax")),
    ("lyon", "cross", Setting(50.0, 8, "energy", "half")),
    ("lyon", "dot", Setting(5.0, 1, "taylor")),
    ("lyon-quadratic", "dot", Setting(200.0, 4)),
    ("lyon-quadratic", "tan2", Setting(20.0, 64)),
    ("gaussian", "dot", Setting(10.0, None, "taylor")),
    ("gaussian", "tan2", Setting(2.0, None, "minimax")),
    ("schlick", "none", Setting(1000.0)),
    ("blinn", "none", Setting(50.0, None, "lagarde", "half")),
    ("table-x", "none", Setting(200.0)),
    ("table-u", "cross", Setting(50.0)),
    ("kuijk-blake", "none", Setting(5.0)),
]


@pytest.mark.parametrize(("name", "form", "setting"), SOME)
def test_the_bound_holds_and_is_within_one_percent_of_what_a_dense_grid_finds(name, form, setting):
    spec = REGISTRY[name]
    bound = bounds.largest(bounds.error_of(spec, form, setting), setting.exponent)
    found = dense(spec, form, setting).max()
    assert found <= bound + consistency.slack(setting.alpha)
    assert bound <= 1.01 * found


def test_where_lyon_is_phong_the_bound_is_nothing():
    error = bounds.error_of(REGISTRY["lyon"], "dot", Setting(64.0, 64, "taylor"))
    assert bounds.largest(error, 64.0) <= bounds.NOTHING


@pytest.mark.parametrize("box", [(0.0, 0.001), (0.01, 0.02), (0.0, 1.0), (0.3, 0.9), (0.124, 0.126), (0.999, 1.0)])
@pytest.mark.parametrize("at", range(len(SOME)))
def test_no_point_of_a_box_is_worse_than_its_bound(at, box):
    name, form, setting = SOME[at]
    error = bounds.error_of(REGISTRY[name], form, setting)
    bound = bounds.bound(error, *box)
    for deficit in np.random.default_rng(at).uniform(*box, 50):
        assert abs(float(error(float(deficit)))) <= bound + consistency.slack(setting.alpha)


def test_the_error_is_that_of_the_bodies_and_of_nothing_else():
    mpmath = pytest.importorskip("mpmath")
    error = bounds.error_of(REGISTRY["lyon"], "cross", Setting(50.0, 8, "taylor"))
    with mpmath.workdps(40):
        d = mpmath.mpf("0.03")
        lam = d - d * d / 2
        assert mpmath.almosteq(error(d), (1 - mpmath.mpf(50) / 8 * lam) ** 8 - (1 - d) ** 50, 1e-30)


def test_every_law_of_a_plan_has_its_row():
    plan = replace(
        preset("quick"),
        preset="standard",
        alphas=(50.0,),
        gammas=(8,),
        approximations=("phong", "lyon", "bit-trick", "schlick"),
        slopes=("taylor",),
        precisions=("float32",),
        timing=False,
    ).validated()
    told = []
    context = ProbeContext(sweep.prepare(plan), pd.DataFrame(), pd.DataFrame(), detail=told.append)
    rows = bounds.measure(context)["accuracy"]
    assert list(rows.columns) == ACCURACY.names
    assert not rows.duplicated(ACCURACY.key).any()
    assert set(rows["coverage"]) == {"certified"}
    assert len(rows) == 3 * 2 + 1  # three forms in two spaces, and Schlick; exact Phong has no model error
    assert (rows["max_abs"] == rows["model_max"]).all()
    assert rows["rounding_max"].isna().all()
    assert len(told) == 1  # the bit trick takes numbers apart, and is told to have no bound
    dot, difference = (
        rows.query(f"lambda_form == '{f}' and space == 'reflect'")["max_abs"].item() for f in ("dot", "difference")
    )
    assert dot == difference


def test_without_flint_there_are_no_rows_and_one_note(monkeypatch, small_plan):
    told = []
    monkeypatch.setattr(bounds, "find_spec", lambda name: None)
    context = ProbeContext(sweep.prepare(small_plan), pd.DataFrame(), pd.DataFrame(), note=told.append)
    assert bounds.measure(context) == {}
    assert told == [bounds.ABSENT]
    assert bounds.seconds(small_plan, 1) == 0


# the numbers themselves

OPERATIONS = {
    "sum": lambda x: 0.25 + x + x,
    "difference": lambda x: 1.0 - x - 0.5,
    "product": lambda x: -3.0 * x * (x - 0.5),
    "square": lambda x: (x - 0.3) * (x - 0.3),
    "quotient": lambda x: 1.0 / (x + 0.1) + x / 3.0,
    "power": lambda x: x**2.7 + x**0.5,
    "exponential": lambda x: 2.0**x,
    "choice": lambda x: x * x if x > 0.4 else x + 1.0,
    "clamp": lambda x: x if x < 0.6 else 0.6,
    "whole": lambda x: x * 3.0 - int(x * 3.0),
    "size": lambda x: abs(x - 0.5),
}


@pytest.mark.parametrize("name", OPERATIONS)
@pytest.mark.parametrize("box", [(0.1, 0.2), (0.35, 0.45), (0.0, 1.0), (0.55, 0.6), (0.25, 0.25)])
def test_a_set_holds_the_value_of_each_of_its_numbers(name, box):
    body = OPERATIONS[name]
    points = [body(float(x)) for x in np.linspace(*box, 57)]
    runs = [sets.ends(value) for value, _ in sets.every_path(lambda: body(ranges.Range(*box)))]
    assert all(any(low <= p <= high for low, high in runs) for p in points)
    middle, radius = sum(box) / 2, (box[1] - box[0]) / 2
    try:
        jets = [sets.ends(value) for value, _ in sets.every_path(lambda: body(balls.Jet.variable(middle, radius)))]
    except sets.TooWideError:
        return
    jets = [(low, high) for low, high in jets if low == low]
    assert not jets or all(any(low <= p <= high for low, high in jets) for p in points) or name == "power"


def test_an_open_comparison_is_answered_both_ways_and_narrows_the_interval():
    taken = [(sets.ends(v), path) for v, path in sets.every_path(lambda: OPERATIONS["clamp"](ranges.Range(0.0, 1.0)))]
    assert taken == [((0.0, 0.6), [1]), ((0.6, 0.6), [0])]


def test_functions_enclose_those_of_the_library():
    for x in (0.0, 0.2, 0.7, 1.0):
        for name in ("exp", "sqrt", "acos"):
            low, high = sets.ends(getattr(ranges.Range, name)(ranges.Range(x)))
            assert low <= getattr(math, name)(x) <= high
            assert high - low < 1e-14
    mantissa, exponent = ranges.Range.frexp(ranges.Range(0.3))
    assert (sets.ends(mantissa)[0], exponent) == pytest.approx((0.6, -1))


def test_a_pole_at_the_end_of_an_interval_gives_an_infinite_end_only():
    assert sets.ends(1.0 / ranges.Range(0.0, 2.0)) == pytest.approx((0.5, math.inf))
    assert sets.ends(1.0 / ranges.Range(-1.0, 2.0)) == (-math.inf, math.inf)
    with pytest.raises(sets.TooWideError):
        1.0 / balls.Jet.variable(0.0, 0.1)


def test_too_many_open_answers_ask_for_smaller_sets():
    def body(x):
        return sum((x if x > k / 20 else -x) for k in range(20))

    with pytest.raises(sets.TooWideError):
        list(sets.every_path(lambda: body(balls.Jet.variable(0.5, 0.5))))
