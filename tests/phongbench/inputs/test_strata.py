"""Strata: how far they reach, and which of them are measured when nobody says."""

import math

import pytest

from phongbench.inputs.plan import PRESETS
from phongbench.inputs.strata import HIGHLIGHT_REACH, LENGTH_ERRORS, STRATA, STRATUM_NAMES, USUAL_STRATA


def test_the_highlight_is_sampled_until_16_bits_are_dark_and_no_further() -> None:
    assert math.exp(-HIGHLIGHT_REACH) < 1 / (2**16 - 1) < math.exp(1 - HIGHLIGHT_REACH)


def test_lengths_err_by_a_tenth_at_most() -> None:
    assert list(LENGTH_ERRORS) == sorted(set(LENGTH_ERRORS))
    assert 0 < LENGTH_ERRORS[0] < LENGTH_ERRORS[-1] == 0.1
    # one estimate of a reciprocal root, of 12 bits; and one Newton step of the classic trick, whose error is known
    assert LENGTH_ERRORS[1] == pytest.approx(1.5 * 2**-12, rel=0.02)
    assert LENGTH_ERRORS[2] == pytest.approx(0.00175, rel=0.01)


def test_only_grazing_and_hostile_pairs_reach_behind_the_gate() -> None:
    assert {stratum.name for stratum in STRATA if stratum.reaches_back} == {"grazing", "hostile"}


def test_unit_vectors_are_those_of_these_strata() -> None:
    unit = [stratum.name for stratum in STRATA if not stratum.unnormalised]
    assert unit == ["uniform", "highlight", "peak", "cutoff", "grazing", "normalised", "configurations"]
    assert all(stratum.lengths == (1.0, 1.0) for stratum in STRATA if not stratum.unnormalised)


def test_all_but_what_is_proven_is_measured_where_nobody_says_what() -> None:
    assert set(STRATUM_NAMES) - set(USUAL_STRATA) == {"normalised"}
    assert set(PRESETS["full"].strata) == set(STRATUM_NAMES)
