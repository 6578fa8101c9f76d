"""Subnormal numbers: the bare chain meets them, ours does not, and nothing visible differs."""

import numpy as np
import pytest

from phongbench.benchmarks import subnormals
from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32
from phongbench.testing import over


def test_the_bare_chain_passes_through_subnormal_numbers_and_ours_does_not():
    deficit = np.linspace(0.0, 0.5, 4001)
    beta = np.full_like(deficit, 2.0)
    bare = over(subnormals.chain, FLOAT32, deficit, beta, n=6)
    kernel = subnormals.REGISTRY["lyon"].kernel
    ours = over(kernel, FLOAT32, deficit, beta, n=6)
    small = (bare > 0) & (bare < FLOAT32.tiny)
    assert small.any()
    assert not ((ours > 0) & (ours < FLOAT32.tiny)).any()
    assert np.abs(bare - ours).max() < 1e-6
    assert np.array_equal(bare[bare > 1e-30], ours[bare > 1e-30])


@pytest.mark.parametrize(("name", "reach"), subnormals.REACHES.items())
def test_pairs_reach_as_far_as_they_say(name, reach):
    a, b = subnormals.inputs(reach, FLOAT32, 1, 4096)
    deficit = ((a.astype(float) - b) ** 2).sum(axis=0) / 2
    assert deficit.max() == pytest.approx(reach * 0.5, rel=0.01), name


@pytest.mark.skipif(jit.DISABLED, reason="times compiled kernels")
def test_a_measurement_has_a_row_for_each_kind_of_pairs():
    near, whole = subnormals.measure(rounds=8)
    assert (near["pairs"], whole["pairs"]) == tuple(subnormals.REACHES)
    assert near["subnormal"] == 0
    assert 0.02 < whole["subnormal"] < 0.1
    for row in (near, whole):
        assert row["ratio_low"] <= row["ratio"] <= row["ratio_high"]
        assert row["chain_ns"] > 0
        assert row["ours_ns"] > 0
        assert row["rounds"] == 8
