"""The yardstick measures something, and says it as plain data."""

from phongbench.benchmarks import numpy_sweep


def test_throughput_is_told_for_both_and_as_their_ratio():
    told = numpy_sweep.throughput(samples=4096, repeats=1)
    assert told["evaluations_per_second"] > 0
    assert told["ratio"] == told["evaluations_per_second"] / told["numpy_evaluations_per_second"]


def test_the_bench_covers_the_formulas_that_numpy_knows():
    assert set(numpy_sweep.plan_of_bench().approximations) == set(numpy_sweep.FORMULAS)
