"""Pairs: addressable, seeded, distributed as their stratum says, exact in the working precision."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from phongbench.compiler.lowering import FLOAT16, FLOAT32, FLOAT64, PRECISIONS
from phongbench.formulas.lambda_forms import cutoff_deficit
from phongbench.inputs.pairs import HOSTILE_PAIRS, pairs
from phongbench.inputs.strata import LENGTH_ERRORS, STRATA

#: the strata of pairs; configurations have tests of their own
PAIRS = [s for s in STRATA if s.name != "configurations"]
BY_NAME = {s.name: s for s in PAIRS}


def cosine(a, b):
    a, b = a.astype(np.float64), b.astype(np.float64)
    return (a * b).sum(axis=0) / np.sqrt((a * a).sum(axis=0) * (b * b).sum(axis=0))


@settings(max_examples=20, deadline=None)
@given(
    start=st.integers(0, 2**40),
    count=st.integers(1, 200),
    seed=st.integers(0, 2**64),
    which=st.sampled_from([s for s in PAIRS if s.name != "hostile"]),
)
def test_a_pair_is_the_same_wherever_it_is_computed(start, count, seed, which):
    whole = pairs(which, FLOAT32, seed=seed, start=start, count=count + 50, scale=0.02)
    part = pairs(which, FLOAT32, seed=seed, start=start + 50, count=count, scale=0.02)
    assert np.array_equal(whole[0][:, 50:], part[0])
    assert np.array_equal(whole[1][:, 50:], part[1])


def test_seeds_give_different_pairs():
    first, second = (pairs(STRATA[0], FLOAT64, seed=s, start=0, count=100)[0] for s in (1, 2))
    assert not np.any(first == second)


@pytest.mark.parametrize("name", ["uniform", "highlight", "peak", "grazing"])
def test_float64_pairs_are_unit_vectors(name):
    for v in pairs(BY_NAME[name], FLOAT64, seed=3, start=0, count=5000, scale=0.1):
        assert np.abs(np.sqrt((v * v).sum(axis=0)) - 1).max() < 1e-15


def test_directions_are_uniform_on_the_sphere():
    a, b = pairs(BY_NAME["uniform"], FLOAT64, seed=5, start=0, count=1 << 17)
    for v in (a, b):
        assert np.abs(v.mean(axis=1)).max() < 0.01
        assert np.abs(v @ v.T / v.shape[1] - np.eye(3) / 3).max() < 0.01
    counts, _ = np.histogram(cosine(a, b), bins=16, range=(-1, 1))
    assert np.abs(counts / counts.mean() - 1).max() < 0.05


def test_azimuths_around_a_are_uniform():
    a, b = pairs(BY_NAME["highlight"], FLOAT64, seed=5, start=0, count=1 << 16, scale=1 / 50)
    across = b - cosine(a, b) * a
    across /= np.sqrt((across**2).sum(axis=0))
    assert np.abs(across.mean(axis=1)).max() < 0.015


@pytest.mark.parametrize("alpha", [1.0, 10.0, 200.0, 1e4])
def test_highlight_fills_alpha_lambda_evenly(alpha):
    a, b = pairs(BY_NAME["highlight"], FLOAT64, seed=1, start=0, count=1 << 15, scale=1 / alpha)
    u = alpha * (((a - b) ** 2).sum(axis=0) / 2)
    reach = min(12.0, 2 * alpha)
    counts, _ = np.histogram(u, bins=12, range=(0, reach))
    assert u.max() <= reach * (1 + 1e-9)
    assert np.abs(counts / counts.mean() - 1).max() < 0.1


def test_half_space_pairs_stand_at_half_the_angle():
    whole = pairs(BY_NAME["highlight"], FLOAT64, seed=1, start=0, count=1000, scale=0.1)
    half = pairs(BY_NAME["highlight"], FLOAT64, seed=1, start=0, count=1000, scale=0.1, half_space=True)
    assert np.allclose(np.arccos(cosine(*whole)), 2 * np.arccos(cosine(*half)), rtol=1e-6, atol=1e-7)


def test_peak_holds_equal_vectors_and_neighbours():
    a, b = pairs(BY_NAME["peak"], FLOAT32, seed=1, start=0, count=4000)
    equal = (a == b).all(axis=0)
    assert 0.1 < equal.mean() < 0.9
    assert cosine(a, b).min() > 1 - 3e-5


@pytest.mark.parametrize("precision", PRECISIONS.values(), ids=PRECISIONS)
def test_cutoff_stays_within_a_few_ulp(precision):
    a, b = pairs(BY_NAME["cutoff"], precision, seed=1, start=0, count=4000, scale=0.16)
    deficit = ((a.astype(float) - b.astype(float)) ** 2).sum(axis=0) / 2
    assert np.abs(deficit / 0.16 - 1).max() < 20 * precision.eps


def test_grazing_reaches_the_antipode():
    x = cosine(*pairs(BY_NAME["grazing"], FLOAT64, seed=1, start=0, count=8000))
    assert x.min() == -1
    assert x.max() <= np.cos(np.radians(80)) + 1e-12


def test_every_length_error_of_the_notes_is_there():
    found = {(s.perturbation, s.length_error) for s in STRATA if s.name == "lengths"}
    for size in LENGTH_ERRORS:
        assert {("a", size), ("a", -size), ("both", size), ("both", -size), ("opposite", size)} <= found


@pytest.mark.parametrize("stratum", [s for s in STRATA if s.name == "lengths" and not s.cause], ids=str)
def test_lengths_are_what_the_stratum_says(stratum):
    for v, wanted in zip(pairs(stratum, FLOAT64, seed=1, start=0, count=100, scale=0.02), stratum.lengths, strict=True):
        assert np.allclose(np.sqrt((v * v).sum(axis=0)), wanted, rtol=1e-14)


def test_float16_pairs_are_float16_numbers():
    for stratum in PAIRS:
        with np.errstate(over="ignore"):
            for v in pairs(stratum, FLOAT16, seed=1, start=0, count=500, scale=0.02):
                assert np.array_equal(v, v.astype(np.float16).astype(np.float32), equal_nan=True)


def test_hostile_pairs_meet_every_special_vector_with_every_other():
    a, b = pairs(BY_NAME["hostile"], FLOAT32, seed=1, start=0, count=HOSTILE_PAIRS)
    both = np.concatenate([a, b]).T
    assert np.isnan(both).any()
    assert np.isinf(both).any()
    assert (both == 0).all(axis=1).any()
    assert len({row.tobytes() for row in both}) > 0.8 * HOSTILE_PAIRS


@pytest.mark.parametrize(("form", "deficit"), [("dot", 0.3), ("difference", 1.7), ("cross", 0.3), ("tan2", 0.3)])
def test_cutoff_deficit_inverts_the_lambda_forms(form, deficit):
    x = 1 - deficit
    value = {"dot": 1 - x, "difference": 1 - x, "cross": (1 - x * x) / 2, "tan2": (1 - x * x) / (2 * x * x)}[form]
    assert cutoff_deficit(form, value) == pytest.approx(deficit, rel=1e-12)


def test_a_cutoff_out_of_reach_has_no_deficit():
    assert cutoff_deficit("cross", 0.51) is None
    assert cutoff_deficit("dot", 2.1) is None


def test_a_changed_length_changes_nothing_else():
    base = BY_NAME["highlight"]
    longer = replace(base, perturbation="a", length_error=0.1)
    (a, b), (c, d) = (pairs(s, FLOAT64, seed=1, start=0, count=50, scale=0.02) for s in (base, longer))
    assert np.allclose(c, 1.1 * a, rtol=1e-15)
    assert np.array_equal(b, d)
