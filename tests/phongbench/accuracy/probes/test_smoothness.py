"""Smoothness: lobes fall from their peak, and their edge is as hard as the law of their gamma says."""

import math
from dataclasses import replace

import numpy as np
import pytest

from phongbench.accuracy import sweep
from phongbench.accuracy.probes import smoothness
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.compiler.lowering import FLOAT16, FLOAT32, FLOAT64, precision_named
from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import Kernel
from phongbench.inputs.plan import Cell, preset
from phongbench.results.schema import SMOOTHNESS


def cut_kink(alpha: float, gamma: int, beta: float, step: float) -> float:
    """Second difference of Lyon's lobe at its cut over step^2, as a share of exact Phong's largest; reflect, dot.

    alpha    float > 1   exact exponent; its largest second derivative over the angle is alpha, at the peak
    gamma    int >= 1    exponent of the approximation
    beta     float > 1/2 slope; the cut lies at cos(c) = 1 - 1/beta
    step     float > 0   radians, below c
    returns  float       (beta (cos(c - step) - cos(c)))^gamma / (alpha step^2), to leading order
                         (beta sin(c))^gamma step^(gamma - 2) / alpha with (beta sin(c))^2 = 2 beta - 1

    So it grows without bound as steps shrink for gamma = 1 (a kink: the slope jumps), stays at 1 - 1/alpha for
    gamma = 2 and the Taylor slope (the curvature jumps: a Mach band), and vanishes like step^(gamma - 2) from 4 on.
    """
    cut = math.acos(1.0 - 1.0 / beta)
    return float((beta * (math.cos(cut - step) - math.cos(cut))) ** gamma / step**2 / alpha)


@pytest.fixture(scope="module")
def rows():
    plan = replace(
        preset("quick"),
        alphas=(10.0, 50.0, 200.0),
        gammas=(1, 2, 4, 8, 16),
        slopes=("taylor", "minimax"),
        timing=False,
        approximations=("phong", "lyon", "gaussian", "integer-power", "table-u"),
        precisions=("float16", "float32", "float64", "q1.15"),
    ).validated()
    prepared = sweep.prepare(plan)
    sweep.compile_kernels(prepared)
    return smoothness.measure(ProbeContext(prepared, None, None))["smoothness"]


def lyon(rows, **wanted):
    mine = rows[rows["approximation"] == "lyon"]
    for column, value in ({"space": "reflect", "gated": True} | wanted).items():
        mine = mine[mine[column] == value]
    return mine


def test_one_row_for_every_cell(rows):
    assert list(rows.columns) == SMOOTHNESS.names
    assert not rows.duplicated([c for c in SMOOTHNESS.names[:9] if c != "beta"]).any()
    assert (rows["samples"] == smoothness.FINE + smoothness.COARSE).all()


def test_the_edge_is_as_hard_as_the_law_says(rows):
    checked = 0
    for row in lyon(rows, lambda_form="dot", precision="float32").itertuples():
        step = smoothness.STEP / math.sqrt(row.alpha)
        if row.beta > 1 and math.degrees(step) < 90 - row.kink_degrees:  # it ends before the gate does
            law = cut_kink(row.alpha, row.gamma, row.beta, step)
            assert row.kink == pytest.approx(law, rel=1e-6, abs=1e-9)
            checked += 1
    assert checked >= 20


@pytest.mark.parametrize("alpha", [10.0, 50.0, 200.0, 1e4])
def test_gamma_1_kinks_2_bands_and_4_is_smooth(alpha):
    """Halving the step doubles the kink of gamma 1, leaves the band of gamma 2, quarters what is left of gamma 4."""
    step = 1e-3 / math.sqrt(alpha)
    coarse, fine = ([cut_kink(alpha, g, alpha / g, h) for g in (1, 2, 4)] for h in (step, step / 2))
    assert np.divide(fine, coarse) == pytest.approx([2, 1, 1 / 4], rel=2e-3)
    assert coarse[1] == pytest.approx(1 - 1 / alpha, rel=2e-3)


def test_the_law_of_the_edge_is_the_leading_order_it_tells():
    for alpha, gamma in ((50.0, 1), (50.0, 2), (100.0, 4), (128.0, 8)):
        beta, step = alpha / gamma, 1e-4
        leading = (2 * beta - 1) ** (gamma / 2) * step ** (gamma - 2) / alpha
        assert cut_kink(alpha, gamma, beta, step) == pytest.approx(leading, rel=5e-3)


def test_a_lobe_that_the_gate_cuts_off_ends_at_90_degrees(rows):
    """alpha < gamma: the support reaches past 90 degrees, and the edge is a step of the value."""
    row = lyon(rows, lambda_form="dot", precision="float32", alpha=10.0, gamma=16, beta_policy="taylor").iloc[0]
    step = smoothness.STEP / math.sqrt(10)
    beta = 10 / 16
    value = (1 - beta * (1 - math.sin(step))) ** 16
    assert row["kink_degrees"] == 90
    # at 90 degrees itself a.b rounds to one side of 0 or the other
    jumps = [abs(value - 2 * at) / step**2 / 10 for at in (0.0, (1 - beta) ** 16)]
    assert min(abs(row["kink"] - jump) for jump in jumps) < 1e-12


def test_the_cut_in_degrees_is_where_lambda_reaches_1_over_beta(rows):
    mine = lyon(rows, precision="float32", alpha=200.0, gamma=4, beta_policy="taylor").set_index("lambda_form")
    deficit = 4 / 200
    assert mine.loc["dot", "kink_degrees"] == pytest.approx(math.degrees(math.acos(1 - deficit)))
    assert mine.loc["cross", "kink_degrees"] == pytest.approx(math.degrees(math.asin(math.sqrt(2 * deficit))))


def test_what_never_ends_has_no_edge():
    cell = Cell(Formula("gaussian", "difference", slope="taylor"), 50.0, "float32", gated=False)
    from phongbench.formulas.registry import REGISTRY

    kernel = Kernel.of(REGISTRY["gaussian"], cell.setting, FLOAT64)
    assert all(math.isnan(x) for x in smoothness.kink(REGISTRY["gaussian"], cell, kernel))


def test_lobes_in_float64_fall_from_their_peak(rows):
    mine = rows[(rows["precision"] == "float64") & rows["gated"]]
    # what rounding a coordinate near the peak can do, at the largest slope there is
    assert (mine["largest_rise"] <= 1e-13 * mine["alpha"]).all()


def test_the_open_cross_form_rises_to_a_second_highlight(rows):
    mine = lyon(rows, lambda_form="cross", gated=False, precision="float32")
    assert (mine["largest_rise"] > 0.99).all()
    assert (lyon(rows, lambda_form="cross", precision="float32")["largest_rise"] < 1e-5).all()


def test_in_float16_the_dot_form_draws_bands_where_difference_draws_none(rows):
    """Its lambda near the peak has steps of 2^-11: rises of codes, not of last bits."""
    at = {"precision": "float16", "alpha": 200.0, "gamma": 8, "beta_policy": "taylor"}
    dot, difference = (lyon(rows, lambda_form=form, **at).iloc[0] for form in ("dot", "difference"))
    assert dot["largest_rise"] > 1 / 255 > 10 * difference["largest_rise"]
    assert dot["rises"] > 10 * max(1, difference["rises"])


def test_strained_numbers_are_counted(rows):
    at = {"lambda_form": "difference", "alpha": 50.0, "beta_policy": "taylor"}
    plain = lyon(rows, precision="float32", gamma=8, **at).iloc[0]
    assert (plain["overflows"], plain["subnormals"]) == (0, 0)
    assert lyon(rows, precision="float16", gamma=16, **at).iloc[0]["subnormals"] > 20
    # at 180 degrees half of |a - b|^2 reaches 2, just beyond the end of q1.15; its double saturates from 90 degrees on
    assert lyon(rows, precision="q1.15", gamma=8, **at).iloc[0]["overflows"] == 0
    gaussian = rows[(rows["approximation"] == "gaussian") & (rows["precision"] == "float16") & rows["gated"]]
    assert (gaussian["subnormals"] >= 10).all()


@pytest.mark.parametrize(
    ("precision", "numbers", "over", "under"),
    [
        (FLOAT16, [0.0, 1e-7, 1.0, np.inf, np.nan], 1, 1),
        (FLOAT32, [1e-7, 1e-40, -np.inf, -1e-39], 1, 2),
        (precision_named("q0.8"), [0.0, 2.0**-8, 1 - 2.0**-8, -1.0], 2, 0),
    ],
)
def test_what_counts_as_strained(precision, numbers, over, under):
    given = np.array(numbers, precision.carrier)
    assert smoothness.strained(precision, given, np.zeros_like(given)) == (over, under)
    assert smoothness.strained(precision, given, given) == (over, under)


@pytest.mark.parametrize(
    ("values", "count", "largest"),
    [([3, 2, 1, 0], 0, 0), ([3, 1, 2, 1.5, 2.5], 2, 1.5), ([1, np.nan, 0.25], 1, 0.25), ([0, np.inf], 1, np.inf)],
)
def test_rises_are_counted_and_measured_above_the_lowest_before(values, count, largest):
    assert smoothness.rises(np.array(values, float)) == (count, largest)
