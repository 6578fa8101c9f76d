"""The yardstick measures something, and says it as plain data."""

import pytest

from phongbench.benchmarks import numpy_sweep


def test_throughput_is_told_for_both_and_as_their_ratio():
    told = numpy_sweep.throughput(samples=4096, repeats=1)
    assert told["evaluations_per_second"] > 0
    ratio = told["evaluations_per_second"] / told["numpy_evaluations_per_second"]
    assert told["ratio"] == pytest.approx(ratio)  # of one round, whose times are the least
    assert (told["ratio_low"], told["ratio_high"], told["rounds"]) == (None, None, 1)


def test_the_bench_covers_the_formulas_that_numpy_knows():
    assert set(numpy_sweep.plan_of_bench().approximations) == set(numpy_sweep.FORMULAS)
