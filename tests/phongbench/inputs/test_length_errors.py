"""Causes of wrong lengths: each errs as its own analysis says, and what is written down was found by running it."""

import math

import numpy as np
import pytest

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32, FLOAT64
from phongbench.formulas import reciprocal_roots
from phongbench.inputs import length_errors
from phongbench.inputs.length_errors import BY_NAME, CAUSES, spoil
from phongbench.inputs.pairs import pairs
from phongbench.inputs.strata import STRATA

ROOTS = [c for c in CAUSES if c.name.startswith("rsqrt")]


def spoiled(cause, count=1 << 16, seed=1):
    """Lengths of unit vectors after a cause."""
    rng = np.random.default_rng(seed)
    v = rng.normal(size=(3, count))
    v /= np.sqrt((v * v).sum(axis=0))
    spoil(cause, rng.random(count), v)
    return np.sqrt((v * v).sum(axis=0))


@pytest.mark.parametrize("cause", CAUSES, ids=lambda c: c.name)
def test_the_largest_error_is_the_largest_there_is(cause):
    """Random lengths come close to what the search over the range found, and hardly beyond it."""
    error = np.abs(spoiled(cause) - 1).max()
    assert 0.9 * abs(cause.length_error) <= error <= 1.06 * abs(cause.length_error)


def test_a_12_bit_root_keeps_to_the_bound_of_hardware():
    q = np.linspace(1, 4, 1 << 16, endpoint=False)
    error = [reciprocal_roots.twelve_bit_root(x) * math.sqrt(x) - 1 for x in q.tolist()]
    assert 2.0**-12 < np.abs(error).max() <= 1.5 * 2.0**-12
    entries = {reciprocal_roots.twelve_bit_root(x) for x in q.tolist()}
    assert all(4096 * entry == int(4096 * entry) for entry in entries)


def test_newton_squares_the_error_of_the_bit_trick():
    """One step takes a relative error e to -3/2 e^2, up to e^3 / 2."""
    first, second, third = (abs(BY_NAME[f"rsqrt-bits-{n}"].length_error) for n in range(3))
    assert first == pytest.approx(0.0344, rel=0.01)
    assert second == pytest.approx(1.5 * first**2, rel=0.02)
    assert third == pytest.approx(1.5 * second**2, rel=0.05)


@pytest.mark.parametrize("steps", [0, 1, 2])
def test_the_bit_trick_is_that_of_the_old_game(steps):
    q = np.float32(0.15625)
    i = np.int32(0x5F3759DF - (int(q.view(np.int32)) >> 1))
    y = i.view(np.float32)
    for _ in range(steps):
        y = y * (np.float32(1.5) - np.float32(0.5) * q * y * y)
    assert reciprocal_roots.bit_trick_root(q, steps) == y
    assert float(y) * math.sqrt(0.15625) == pytest.approx(1, abs=0.04)


def test_the_short_series_errs_by_three_eighths_of_the_square():
    for e in (1e-3, 1e-2, 0.05):
        assert reciprocal_roots.short_series(1 + e) * math.sqrt(1 + e) - 1 == pytest.approx(-3 / 8 * e * e, rel=0.1)
    largest = (1 + length_errors.NEARLY) ** 2 - 1
    assert abs(BY_NAME["series"].length_error) == pytest.approx(3 / 8 * largest**2, rel=0.1)


@pytest.mark.parametrize("degrees", [10.0, 30.0])
def test_interpolation_shortens_by_an_eighth_of_the_angles_square(degrees):
    """Law 10."""
    cause = BY_NAME[f"interpolated-{degrees:g}"]
    phi = math.radians(degrees)
    assert cause.length_error == pytest.approx(math.cos(phi / 2) - 1, rel=1e-3)
    assert cause.length_error == pytest.approx(-(phi**2) / 8, rel=0.03)
    a, b = np.array([0.0, 0.0, 1.0]), np.array([math.sin(phi), 0.0, math.cos(phi)])
    for t in (0.0, 0.2, 0.5, 1.0):
        assert length_errors.along_edge(t, degrees) == pytest.approx(np.linalg.norm((1 - t) * a + t * b), rel=1e-14)


def test_float16_rounds_each_component():
    v = np.array([[1 / 3, 0.6], [2 / 3, 0.0], [2 / 3, 0.8]])
    spoil(BY_NAME["half"], np.zeros(2), v)
    assert np.array_equal(v, v.astype(np.float16))
    assert abs(BY_NAME["half"].length_error) <= 2.0**-11


ROOTED = [s for s in STRATA if s.cause and s.name == "lengths"]


@pytest.mark.parametrize("stratum", ROOTED, ids=lambda s: s.perturbation)
def test_pairs_of_a_cause_are_wrong_in_length_only(stratum):
    plain = next(s for s in STRATA if s.name == "highlight")
    for precision, tolerance in ((FLOAT64, 1e-14), (FLOAT32, 1e-6)):
        exact = pairs(plain, precision, seed=3, start=100, count=3000, scale=0.02)
        wrong = pairs(stratum, precision, seed=3, start=100, count=3000, scale=0.02)
        ends = []
        for v, w in zip(exact, wrong, strict=True):
            v, w = v.astype(np.float64), w.astype(np.float64)  # noqa: PLW2901
            length = np.sqrt((w * w).sum(axis=0))
            ends.append(np.abs(length - 1).max())
            if stratum.perturbation != "half":
                assert np.abs(w / length - v / np.sqrt((v * v).sum(axis=0))).max() < tolerance
        assert ends[0] <= 1.06 * abs(stratum.largest_length_error)
        assert (ends[1] > 10 * tolerance) == bool(stratum.cause.both) or stratum.perturbation == "rsqrt-bits-2"


def test_lengths_of_the_two_vectors_are_independent():
    stratum = next(s for s in STRATA if s.perturbation == "rsqrt-bits-0")
    a, b = pairs(stratum, FLOAT64, seed=3, start=0, count=1 << 14, scale=0.02)
    lengths = [np.sqrt((v * v).sum(axis=0)) for v in (a, b)]
    assert abs(np.corrcoef(*lengths)[0, 1]) < 0.05


@pytest.mark.skipif(jit.DISABLED, reason="runs the search in plain Python")
def test_the_search_is_run_once():
    assert all(c.length_error == c.at_worst() for c in ROOTS)
