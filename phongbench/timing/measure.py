"""Interleaved, calibrated measurement of run time, with the evidence of what disturbed it.

A block is one working set in one precision: all its kernels run over the same buffers, each for as long as the others,
once in every round, in the order of a Latin square. What is reported are quotients within rounds; nanoseconds stand
beside them.

Known biases, written against ourselves: all kernels share one placement of their arrays in memory (chosen so that rows
do not alias; further processes have others); kernels run hot, on values of the highlight stratum at alpha = 50, and in
l1 few enough of them for the branch predictor to learn by heart, which flatters kernels that branch; beyond the caches
a pass is an epoch, so that those of slow kernels are longer and more often disturbed; ceilings count bytes as STREAM
does, without the read that a store to a cold line costs, so a formula reading six rows per store can pass 100 % of a
copy's bandwidth; kernels whose order is undecided get further rounds, and stopping when it is decided makes their
intervals a little too narrow.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field

import pandas as pd

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32, Precision
from phongbench.errors import InputError, MeasurementError, UnknownNameError
from phongbench.results.schema import TIMING
from phongbench.support.process import cores
from phongbench.timing import skip_kernels, timed_kernels
from phongbench.timing.blocks import WORKING_SETS, Block
from phongbench.timing.machine_lock import machine_lock
from phongbench.timing.session import OnShort, Progress, Session, refused
from phongbench.timing.timed_kernels import Key, TimedFormula, TimedKernel


@dataclass(frozen=True)
class Timing:
    """What a measurement gives.

    rows      the table TIMING, one row per kernel and working set; void kernels have none
    problems  what made a kernel's row void
    notes     what the budget was too small for
    """

    rows: pd.DataFrame
    problems: list[MeasurementError] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def measure(
    timed: Sequence[TimedFormula],
    *,
    budget_seconds: float,
    working_sets: Sequence[str] = WORKING_SETS,
    seed: int = 0,
    progress: Progress | None = None,
    threads: Sequence[int] = (1,),
    lit: Sequence[float] = (),
    locked: bool = False,
    on_short: OnShort = refused,
) -> Timing:
    """Time the formulas beside the exact powers and the ceilings.

    timed           float32 or float64; see `timed_formulas`. None gives no rows
    budget_seconds  for everything but compilation, which comes first and is a column of its own
    working_sets    which of l1, l2, memory
    seed            of inputs and orders
    progress        is called with (epochs done, epochs planned, working set)
    threads         1, and numbers of threads on which `timed_kernels.THREADED` are timed too
    lit             shares of lit pairs at which skipping is timed, in float32; see skip_kernels.py
    locked          True if the caller holds the machine's lock
    on_short        what gives another budget where this one cannot give the rounds an interval needs, as is known only
                    after calibration
    Raises BudgetError where the budget, or the other one, cannot, saying what can; LockedError while another timing
    runs.
    """
    check(budget_seconds, working_sets, threads)
    if not timed:
        return Timing(TIMING.frame())
    problems: list[MeasurementError] = []
    with nullcontext() if locked else machine_lock():
        groups = list(_compile_all(timed, problems))
        skips = skip_kernels.kernels(FLOAT32) if lit else []
        with jit.compilations() as late:
            session = Session(
                groups, skips, working_sets, budget_seconds, seed, threads, lit, progress, problems, on_short=on_short
            )
            rows = session.run()
        if late and not jit.DISABLED:
            raise MeasurementError("something was compiled while timing", "timing", "run again; if it stays, report it")
    return Timing(TIMING.frame(rows), problems, session.notes)


def check(budget: float, working_sets: Sequence[str], threads: Sequence[int]) -> None:
    """InputError or UnknownNameError where a measurement of these cannot be."""
    if not (math.isfinite(budget) and budget > 0):
        raise InputError(f"{budget} s is no time", "timing budget", "give seconds above 0, or leave timing out")
    if not working_sets:
        raise InputError("nothing to time", "working sets", f"name some of {', '.join(WORKING_SETS)}")
    for name in working_sets:
        if name not in WORKING_SETS:
            raise UnknownNameError("working set", name, WORKING_SETS)
    if 1 not in threads or not all(1 <= count <= cores() for count in threads):
        why = f"threads {tuple(threads)} cannot be timed on {cores()} cores"
        raise InputError(why, "timing", "give 1, and numbers up to the cores there are")
    if jit.DISABLED:
        why = "kernels run as plain Python, whose time says nothing"
        raise InputError(why, "NUMBA_DISABLE_JIT", "unset it, or leave timing out")


def compile_all(timed: Iterable[TimedFormula], *, lit: Sequence[float] = ()) -> None:
    """Compile, or load from the cache, everything a measurement of these formulas runs."""
    for _ in _compile_all(timed, []):
        pass
    if lit:
        skip_kernels.kernels(FLOAT32)


def _compile_all(
    timed: Iterable[TimedFormula], problems: list[MeasurementError]
) -> Iterator[tuple[Precision, list[TimedKernel]]]:
    """The kernels of each precision; formulas that do not compile become problems."""
    by_precision: dict[Precision, list[TimedFormula]] = {}
    for formula in timed:
        by_precision.setdefault(formula.precision, []).append(formula)
    for precision, formulas in by_precision.items():
        kernels: dict[Key, TimedKernel] = {k.key: k for k in timed_kernels.companions(precision)}
        for formula in formulas:
            try:
                if formula.key not in kernels:
                    kernels[formula.key] = timed_kernels.compiled(formula)
            except MeasurementError as problem:
                problems.append(problem)
        Block.prepare(precision, list(kernels.values()))
        yield precision, list(kernels.values())
