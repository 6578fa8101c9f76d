"""A real measurement: what it is given, its table, threads, skipping, two at once. Nothing looks at how fast it is."""

import os
import tempfile
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import filelock
import numpy as np
import pytest

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32
from phongbench.errors import BudgetError, InputError, LockedError, UnknownNameError
from phongbench.results.schema import TIMING
from phongbench.support.process import cores
from phongbench.timing import blocks, budget, rounds, skip_kernels, timed_kernels
from phongbench.timing.interference import Witness
from phongbench.timing.machine_lock import LOCK_NAME, machine_lock
from phongbench.timing.measure import Timing, measure
from phongbench.timing.statistics import MIN_ROUNDS
from phongbench.timing.timed_kernels import TimedFormula

#: as contract.md lists them
CONTRACT = [
    "approximation",
    "lambda_form",
    "space",
    "beta_policy",
    "gamma",
    "precision",
    "working_set",
    "elements",
    "threads",
    "ns_min",
    "ns_median",
    "ratio",
    "ratio_low",
    "ratio_high",
    "verdict",
    "dot_ratio",
    "bandwidth_fraction",
    "rounds",
    "contaminated",
]
LYON = TimedFormula.of("lyon:difference:8", FLOAT32)
compiled_only = pytest.mark.skipif(jit.DISABLED, reason="plain Python is not timed")


# what is asked


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("nan"), float("inf")])
def test_a_budget_that_is_no_time_is_refused(seconds: float) -> None:
    with pytest.raises(InputError, match="no time"):
        measure([LYON], budget_seconds=seconds)


@compiled_only
def test_a_budget_too_small_says_what_it_takes() -> None:
    with pytest.raises(InputError, match=r"0\.001 s are too short to time \d+ kernels in l1: it takes about \d"):
        measure([LYON], budget_seconds=0.001, working_sets=["l1"])


def test_an_unknown_working_set_lists_the_known_ones() -> None:
    with pytest.raises(UnknownNameError, match="l1, l2, memory"):
        measure([LYON], budget_seconds=1, working_sets=["l3"])


def test_no_working_set_and_impossible_thread_counts_are_refused() -> None:
    with pytest.raises(InputError, match="nothing to time"):
        measure([LYON], budget_seconds=1, working_sets=[])
    for threads in ((2,), (1, 1000), (0, 1)):
        with pytest.raises(InputError, match="cannot be timed on"):
            measure([LYON], budget_seconds=1, threads=threads)


@compiled_only
def test_a_study_of_float16_alone_has_an_empty_table() -> None:
    rows = measure([], budget_seconds=1).rows
    assert rows.empty
    assert list(rows.columns) == TIMING.names


# a real measurement


@pytest.fixture(scope="module")
def real(tmp_path_factory: pytest.TempPathFactory) -> tuple[Timing, list[tuple[int, int, str]]]:
    """The smallest there is: one formula in one cache."""
    told: list[tuple[int, int, str]] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tempfile, "tempdir", str(tmp_path_factory.mktemp("lock")))
        timing = measure(
            [LYON], budget_seconds=2.0, working_sets=["l1"], seed=1, progress=lambda *now: told.append(now)
        )
    return timing, told


@compiled_only
def test_the_columns_are_those_of_the_contract(real: Any) -> None:
    rows = real[0].rows
    assert list(rows.columns)[: len(CONTRACT)] == CONTRACT
    assert str(rows["gamma"].dtype) == "Int64"
    assert all(
        str(rows[c].dtype) == "float64"
        for c in ("ns_min", "ns_median", "ratio", "ratio_low", "ratio_high", "dot_ratio")
    )
    assert all(str(rows[c].dtype) == "int64" for c in ("elements", "threads", "rounds", "contaminated"))


@compiled_only
def test_every_kernel_has_a_row_and_every_column_a_value(real: Any) -> None:
    rows = real[0].rows
    assert real[0].problems == []
    assert {"phong", "aa-twin", "phong-libm", "copy", "triad", "dot", "lyon"} <= set(rows["approximation"])
    assert not rows.duplicated(TIMING.key).any()
    assert not rows.drop(columns=["gamma", "lit"]).isna().any().any()
    assert rows.loc[rows["approximation"] == "lyon", "gamma"].tolist() == [8]
    assert (rows["ns_min"] > 0).all()
    assert (rows["ns_min"] <= rows["ns_median"]).all()
    assert (rows["ratio_low"] <= rows["ratio"]).all()
    assert (rows["ratio"] <= rows["ratio_high"]).all()
    assert (rows["rounds"] >= MIN_ROUNDS).all()
    assert set(rows["verdict"]) <= {"faster", "slower", "unresolved"}


@compiled_only
def test_progress_only_grows(real: Any) -> None:
    done = [now[0] for now in real[1]]
    assert done == sorted(done)
    assert all(0 < now <= total and text == "l1, float32" for now, total, text in real[1])


@compiled_only
def test_epochs_are_long_enough(real: Any) -> None:
    rows = real[0].rows
    epoch = rows["ns_median"] * rows["elements"] * rows["repeats"]
    assert (epoch > 0.2 * rounds.EPOCH_NS).all()


@compiled_only
def test_epochs_of_fast_and_slow_kernels_are_equally_long_and_read_as_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    passes = {"phong": 400.0, "aa-twin": 399.0, "phong-libm": 6400.0, "dot": 30.0}
    kernels = [kernel for kernel in timed_kernels.companions(FLOAT32) if kernel.name in passes]
    kernels.append(replace(kernels[0], threads=2))  # what is told of two threads is half of what passes
    expected = [*(passes[kernel.name] for kernel in kernels[:-1]), 200.0]
    block = blocks.Block("l1", FLOAT32, kernels, 4096, 1)
    assert block.verify() == []
    epochs: list[float] = []

    def clock(block: blocks.Block, index: int, repeats: int) -> float:
        epochs.append(expected[index] * repeats * block.kernels[index].threads)
        return expected[index] * repeats

    monkeypatch.setattr(blocks.Block, "nanoseconds", clock)
    block.calibrate(20.0)
    assert block.pass_ns.tolist() == expected
    epochs.clear()
    with closing(Witness()) as witness:
        readings = [block.epoch(witness, index).nanoseconds for index in range(len(kernels))]
    block.close()
    assert readings == expected
    assert all(rounds.EPOCH_NS <= epoch < 1.1 * rounds.EPOCH_NS for epoch in epochs)


@compiled_only
def test_where_a_budget_gives_way_what_was_calibrated_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    calibrate, calibrated = blocks.Block.calibrate, []
    monkeypatch.setattr(blocks.Block, "calibrate", lambda b, step: (calibrated.append(b), calibrate(b, step)))
    short: list[BudgetError] = []

    def enough(refusal: BudgetError) -> float:
        short.append(refusal)
        return 2 * refusal.needed

    rows = measure([LYON], budget_seconds=0.001, working_sets=["l1"], on_short=enough).rows
    assert (rows["rounds"] >= MIN_ROUNDS).all()
    assert (len(calibrated), len(short)) == (1, 1)
    with pytest.raises(BudgetError, match=r"0\.002 s are too short"):
        measure([LYON], budget_seconds=0.001, working_sets=["l1"], on_short=lambda refusal: 0.002)


# several threads, skipping, further rounds


@compiled_only
@pytest.mark.skipif(cores() < 2, reason="one core")
def test_two_threads_time_phong_dot_and_lyon_8_on_buffers_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    # where other processes have the cores, two threads seldom meet, and no budget would be foreseen to suffice
    monkeypatch.setattr(budget, "fits", lambda costs, seconds: True)
    monkeypatch.setattr(budget, "plan_rounds", lambda costs, seconds, scales: ([MIN_ROUNDS] * len(costs), 1.0))
    timing = measure([LYON], budget_seconds=1.0, working_sets=["l1", "l2"], threads=(1, 2))
    two = timing.rows[timing.rows["threads"] == 2]
    assert timing.notes == []
    assert set(two["approximation"]) == {"phong", "dot", "lyon"}
    assert set(two["working_set"]) == {"l1"}
    assert (two["ns_min"] > 0).all()


@compiled_only
def test_threads_share_neither_inputs_nor_outputs() -> None:
    (phong, *_) = timed_kernels.companions(FLOAT32)
    block = blocks.Block("l1", FLOAT32, [phong, replace(phong, threads=2)], 4096, 1)
    try:
        assert block.nanoseconds(1, 3) > 0
        first, second = block.shares
        assert not any(np.shares_memory(x, y) for x in (first.a, first.out) for y in (second.a, second.out))
        assert first.digest() == second.digest()
    finally:
        block.close()


@compiled_only
def test_skipping_has_rows_of_its_own_at_each_share_of_lit_pairs() -> None:
    rows = measure([LYON], budget_seconds=4.0, working_sets=["l2"], lit=(0.1, 1.0)).rows
    lit = rows[rows["lit"].notna()]
    assert set(lit["approximation"]) == skip_kernels.names()
    assert sorted(lit["lit"].unique()) == [0.1, 1.0]
    assert rows[rows["lit"].isna()]["approximation"].isin(skip_kernels.names()).sum() == 0


@compiled_only
def test_a_small_budget_leaves_out_skipping_first_and_then_several_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budget, "fits", lambda costs, seconds: False)
    threads = (1, 2) if cores() > 1 else (1,)
    timing = measure([LYON], budget_seconds=2.0, working_sets=["l1"], lit=(0.5,), threads=threads)
    assert timing.rows["lit"].isna().all()
    assert (timing.rows["threads"] == 1).all()
    told = ["skipping was not timed", "several threads were not timed in l1"][: len(threads)]
    assert [note.partition(":")[0] for note in timing.notes] == told


@compiled_only
def test_what_is_left_of_the_budget_goes_to_kernels_whose_order_is_not_decided(real: Any) -> None:
    rows = real[0].rows.set_index("approximation")
    assert rows.loc["phong", "rounds"] >= rows.loc["aa-twin", "rounds"]
    assert (rows.loc[["copy", "triad", "fma"], "rounds"] <= 24).all()


# two at once


def test_two_timing_runs_never_overlap_and_the_second_learns_whom_to_wait_for() -> None:
    with machine_lock(), pytest.raises(LockedError, match=rf"process {os.getpid()}\) is timing"), machine_lock():
        pass
    with machine_lock():  # and it is free again afterwards
        pass


def test_an_unknown_holder_is_still_a_holder(tmp_path: Path) -> None:
    held = filelock.FileLock(tmp_path / LOCK_NAME)
    with held, pytest.raises(LockedError, match="another phongbench is timing"), machine_lock():
        pass
