"""Timing: what is timed, what a row says, and when it says nothing. No test here looks at how fast anything is."""

import os
import tempfile
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import filelock
import numpy as np
import pytest

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT16, FLOAT32, FLOAT64
from phongbench.errors import InputError, LockedError, MeasurementError, UnknownNameError
from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import Kernel
from phongbench.formulas.registry import REGISTRY
from phongbench.inputs.plan import Cell
from phongbench.results.machine import Caches
from phongbench.results.schema import TIMING
from phongbench.support.process import cores
from phongbench.timing import blocks, budget, rounds, session, skip_kernels, table, timed_kernels
from phongbench.timing.machine_lock import LOCK_NAME, machine_lock
from phongbench.timing.measure import Timing, measure
from phongbench.timing.rounds import Epoch
from phongbench.timing.statistics import MIN_ROUNDS
from phongbench.timing.timed_kernels import TimedFormula, TimedKernel, timed_formulas

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
MIB = 1 << 20
LYON = TimedFormula.of("lyon:difference:8", FLOAT32)
compiled_only = pytest.mark.skipif(jit.DISABLED, reason="plain Python is not timed")


@pytest.fixture(autouse=True)
def own_lock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests neither wait for a real timing run nor hinder one."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))


# what is timed


def cells(
    approximation: str = "lyon",
    forms: tuple[str, ...] = ("dot",),
    alphas: tuple[float, ...] = (50.0,),
    gammas: tuple[int | None, ...] = (8,),
    slopes: tuple[str, ...] = ("taylor",),
    spaces: tuple[str, ...] = ("reflect",),
    precisions: tuple[str, ...] = ("float32",),
) -> list[Cell]:
    axes = product(forms, alphas, gammas, slopes, spaces, precisions)
    return [Cell(Formula(approximation, form, g, slope, space), a, p) for form, a, g, slope, space, p in axes]


def test_cells_that_differ_in_alpha_or_slope_only_are_timed_once() -> None:
    (only,) = timed_formulas(cells(alphas=(10.0, 20.0), slopes=("taylor", "minimax")))
    assert only.key == ("lyon", "dot", "reflect", 8, "float32")
    assert only.alpha == timed_kernels.ALPHA
    assert only.formula == Formula.parse("lyon:dot:8")


def test_form_space_gamma_and_precision_are_timed_apart() -> None:
    axes = {"forms": ("dot", "cross"), "gammas": (4, 8), "spaces": ("reflect", "half")}
    assert len(timed_formulas(cells(**axes, precisions=("float32", "float64")))) == 16
    assert len(timed_formulas(cells("phong", ("none",), alphas=(10.0, 50.0), gammas=(None,)))) == 1


def test_float16_is_emulated_and_therefore_not_timed() -> None:
    assert timed_formulas(cells(precisions=("float16",))) == ()
    with pytest.raises(InputError, match="emulated"):
        timed_kernels.compiled(replace(LYON, precision=FLOAT16))


def test_a_formula_that_is_not_accepted_at_the_usual_alpha_keeps_its_own() -> None:
    picky = replace(REGISTRY["phong"], name="picky", accepts=lambda s: s.alpha == 7.0)
    (timed,) = timed_formulas(cells("picky", ("none",), alphas=(7.0,), gammas=(None,)), {"picky": picky})
    assert timed.alpha == 7.0


@compiled_only
def test_every_block_holds_the_exact_powers_and_the_ceilings() -> None:
    names = [c.name for c in timed_kernels.companions(FLOAT32)]
    assert {"phong", "aa-twin", "phong-libm", "copy", "triad", "dot", "fma"} <= set(names)
    assert ("integer-power" in names) == ("integer-power" in REGISTRY)
    twin, phong = (next(c for c in timed_kernels.companions(FLOAT32) if c.name == n) for n in ("aa-twin", "phong"))
    assert twin.kernel.loop is phong.kernel.loop


# where it is timed


@pytest.mark.parametrize("precision", [FLOAT32, FLOAT64])
@pytest.mark.parametrize("total", [1, 24 << 10, MIB, 32 * MIB])
def test_rows_do_not_alias_and_fill_the_working_set(precision: Any, total: int) -> None:
    row = blocks.elements_of(total, precision) * precision.carrier.itemsize
    assert row // 512 % 2 == 1
    assert row % 512 == 0
    assert abs(timed_kernels.ROWS * row - total) <= timed_kernels.ROWS * 512


@pytest.mark.parametrize(
    ("caches", "sizes"),
    [
        (Caches(32 << 10, MIB, 8 * MIB), [32, 16]),
        (Caches(32 << 10, MIB, 32 * MIB), [128, 64]),
        (Caches(32 << 10, MIB, 100 * MIB), [256]),
        (Caches(48 << 10, 2 * MIB, 480 * MIB), [256, 128, 64, 32, 16]),
    ],
)
def test_memory_is_beyond_the_last_cache_where_the_cap_allows_it(caches: Caches, sizes: list[int]) -> None:
    assert [size / MIB for size in blocks.memory_sizes(caches)] == sizes


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


# what a row says, from kernels of known duration


def made_up(name: str, rows: int = 7) -> TimedKernel:
    nothing = Kernel(None, np.zeros(1), np.zeros(1))
    return TimedKernel((name, "none", "reflect", None, "float32"), nothing, lambda a, b: a[0], 0.0, rows)


def analysed(durations: dict[str, float], *, noise: float = 0.02, seed: int = 3) -> dict[str, dict[str, Any]]:
    """Rows of made-up kernels whose epochs take known times, in rounds that are slow or quick as a whole."""
    rng = np.random.default_rng(seed)
    everyone = {"phong": 100.0, "aa-twin": 100.0, "copy": 20.0, "triad": 30.0, "dot": 40.0, **durations}
    timed = [made_up(name, {"copy": 2, "triad": 3}.get(name, 7)) for name in everyone]
    times, pace = list(everyone.values()), {"now": 1.0}

    def epoch(kernel: int) -> Epoch:
        return Epoch(times[kernel] * pace["now"] * rng.lognormal(sigma=noise), False)

    def next_round(done: int) -> None:
        pace["now"] = float(rng.uniform(1.0, 3.0))

    readings = rounds.run_rounds(epoch, len(timed), 24, rng, after_round=next_round)
    return {row["approximation"]: row for row in table.withheld(table.analyse(timed, readings, 10))}


def test_known_durations_give_the_right_verdicts() -> None:
    rows = analysed({"quick": 60.0, "slow": 150.0, "alike": 101.0})
    assert {name: rows[name]["verdict"] for name in ("quick", "slow", "alike", "aa-twin", "phong")} == {
        "quick": "faster",
        "slow": "slower",
        "alike": "unresolved",
        "aa-twin": "unresolved",
        "phong": "unresolved",
    }
    assert rows["quick"]["ratio"] == pytest.approx(0.6, rel=0.02)
    assert rows["quick"]["ratio_low"] < rows["quick"]["ratio"] < rows["quick"]["ratio_high"]
    assert rows["quick"]["dot_ratio"] == pytest.approx(1.5, rel=0.02)
    assert rows["quick"]["ns_min"] == pytest.approx(6.0, rel=0.1)
    assert rows["quick"]["ns_median"] > rows["quick"]["ns_min"]


def test_a_difference_too_small_to_claim_is_unresolved_however_sure() -> None:
    assert analysed({"one-percent": 99.0}, noise=1e-5)["one-percent"]["verdict"] == "unresolved"


def test_a_bandwidth_fraction_is_against_the_better_ceiling() -> None:
    rows = analysed({"streaming": 70.0}, noise=1e-9)
    assert rows["streaming"]["bandwidth_fraction"] == pytest.approx(1.0, rel=0.01)
    assert rows["phong"]["bandwidth_fraction"] == pytest.approx(0.7, rel=0.01)


def test_a_twin_that_is_told_apart_withholds_every_other_claim() -> None:
    rows = analysed({"quick": 60.0, "aa-twin": 105.0}, noise=1e-3)
    assert rows["aa-twin"]["verdict"] == "slower"
    assert {row["verdict"] for name, row in rows.items() if name != "aa-twin"} == {"unresolved"}
    assert rows["quick"]["ratio"] == pytest.approx(0.6, rel=0.01)


def test_identical_code_is_hardly_ever_told_apart() -> None:
    alarms = [analysed({}, noise=0.05, seed=seed)["aa-twin"]["verdict"] != "unresolved" for seed in range(200)]
    assert sum(alarms) <= 2 + 3  # measuring.md wants 1 % of 200; three more for an unlucky set of seeds


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
    assert (epoch[~rows["approximation"].isin(["copy", "triad"])] > 0.2 * rounds.EPOCH_NS).all()


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


def test_undecided_are_the_formulas_that_overlap_with_baseline_and_dot() -> None:
    timed = [made_up(name) for name in ("phong", "aa-twin", "copy", "triad", "dot", "near", "far", "nearer")]
    block = blocks.Block.__new__(blocks.Block)
    block.kernels = timed
    times = np.array([100.0, 100.0, 20.0, 30.0, 40.0, 60.0, 80.0, 60.1])
    rng = np.random.default_rng(0)
    used = times * rng.lognormal(sigma=0.01, size=(24, 8))
    readings = rounds.Readings(used, np.ones(used.shape, np.bool_), np.zeros(8, np.int64))
    assert [timed[i].name for i in session._undecided(block, readings)] == ["phong", "dot", "near", "nearer"]


# when it says nothing


def measured(formula: TimedFormula) -> tuple[set[str], list[str]]:
    timing = measure([formula], budget_seconds=2.0, working_sets=["l1"])
    return set(timing.rows["approximation"]), [str(problem) for problem in timing.problems]


LIAR = TimedFormula.of("liar", FLOAT32, registry={"liar": replace(REGISTRY["phong"], name="liar")})


@compiled_only
def test_a_kernel_that_computes_something_else_is_void(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = timed_kernels._plain
    monkeypatch.setattr(
        timed_kernels, "_plain", lambda t: (lambda a, b: plain(t)(a, b) + 0.01) if t.name == "liar" else plain(t)
    )
    names, problems = measured(LIAR)
    assert "liar" not in names
    assert "lyon" not in names
    assert "phong" in names
    assert len(problems) == 1
    assert "liar none reflect float32, l1: 100% of its values differ" in problems[0]


@compiled_only
def test_a_timed_output_that_differs_from_the_verified_one_voids_its_row(monkeypatch: pytest.MonkeyPatch) -> None:
    honest = blocks.Block.digest
    calls: list[str] = []

    def digest(block: blocks.Block, share: int = 0) -> int:
        value = honest(block, share)
        calls.append("")
        # the first look at each kernel's output is the verification; lyon's later outputs come out wrong
        return value ^ 1 if value == known.get("lyon") and len(calls) > len(block.kernels) else value

    known: dict[str, int] = {}
    verify = blocks.Block.verify

    def remember(block: blocks.Block) -> list[MeasurementError]:
        problems = verify(block)
        known.update({kernel.name: d for kernel, d in zip(block.kernels, block.digests, strict=True)})
        return problems

    monkeypatch.setattr(blocks.Block, "digest", digest)
    monkeypatch.setattr(blocks.Block, "verify", remember)
    names, problems = measured(LYON)
    assert "lyon" not in names
    assert "phong" in names
    assert [p.splitlines()[0] for p in problems] == [
        "lyon difference reflect 8 float32, l1: a timed output differs from the verified one; its row is left out"
    ]


@compiled_only
def test_a_kernel_that_does_not_compile_fails_alone() -> None:
    broken = replace(REGISTRY["phong"], name="broken", coefficients=lambda s: {"alpha": 1 / 0})
    names, problems = measured(replace(LIAR, spec=broken))
    assert "phong" in names
    assert "broken: cannot be compiled: division by zero" in problems[0]


@compiled_only
def test_compiling_while_timing_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    import numba

    def late(block: blocks.Block, step: float) -> None:
        numba.njit(lambda x: x + 1)(1)
        calibrate(block, step)

    calibrate = blocks.Block.calibrate
    monkeypatch.setattr(blocks.Block, "calibrate", late)
    with pytest.raises(MeasurementError, match="compiled while timing"):
        measure([LYON], budget_seconds=2.0, working_sets=["l1"])


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
