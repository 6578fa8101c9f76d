"""Interleaved, calibrated measurement of run time, with the evidence of what disturbed it.

A block is one working set in one precision: all its kernels run over the same buffers, with the same number of
repeats, once in every round, in the order of a Latin square. What is reported are quotients within rounds; nanoseconds
stand beside them.

Known biases, written against ourselves: all kernels share one placement of their arrays in memory (chosen so that rows
do not alias; further processes have others); kernels run hot, on values of the highlight stratum at alpha = 50, and in
l1 few enough of them for the branch predictor to learn by heart, which flatters kernels that branch; slow kernels have
longer epochs, which are more often disturbed; ceilings count bytes as STREAM does, without the read that a store to a
cold line costs, so a formula reading six rows per store can pass 100 % of a copy's bandwidth; kernels whose order is
undecided get further rounds, and stopping when it is decided makes their intervals a little too narrow.
"""

import math
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import nullcontext

import pandas as pd

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32, Precision, precision_named
from phongbench.errors import InputError, MeasurementError, UnknownNameError
from phongbench.results.schema import BASELINE, TIMING
from phongbench.timing import skip_kernels, timed_kernels
from phongbench.timing.blocks import WORKING_SETS, Block
from phongbench.timing.machine_lock import machine_lock
from phongbench.timing.session import Laboratory, Progress
from phongbench.timing.timed_kernels import Contender, Subject, subjects

__all__ = ["WORKING_SETS", "Progress", "Subject", "check", "compile_all", "cores", "measure", "subjects"]


def cores() -> int:
    """The cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def measure(
    timed: Sequence[Subject],
    *,
    budget_seconds: float,
    working_sets: Sequence[str] = WORKING_SETS,
    seed: int = 0,
    progress: Progress | None = None,
    threads: Sequence[int] = (1,),
    lit: Sequence[float] = (),
    problems: list[MeasurementError] | None = None,
    notes: list[str] | None = None,
    locked: bool = False,
) -> pd.DataFrame:
    """Time the subjects beside the exact powers and the ceilings.

    timed           subjects, float32 or float64; see `subjects`. None gives no rows
    budget_seconds  for everything but compilation, which comes first and is a column of its own
    working_sets    which of l1, l2, memory
    seed            of inputs and orders
    progress        told (epochs done, epochs planned, working set)
    threads         1, and numbers of threads on which `contenders.THREADED` are timed too
    lit             shares of lit pairs at which skipping is timed, in float32; see skipping.py
    problems        receives what made a kernel's row void; without it the first problem is raised at the end
    notes           receives what the budget was too small for
    locked          True if the caller holds the machine's lock
    returns         the table TIMING, one row per kernel and working set; void kernels have none
    Raises InputError where the budget cannot give the rounds an interval needs, saying what can; LockedError while
    another timing runs.
    """
    check(budget_seconds, working_sets, threads)
    if not timed:
        return TIMING.frame()
    found: list[MeasurementError] = []
    with nullcontext() if locked else machine_lock():
        groups = list(_compile_all(timed, found))
        skips = skip_kernels.group(FLOAT32) if lit else []
        with jit.compilations() as compiled:
            laboratory = Laboratory(groups, working_sets, budget_seconds, seed, progress, found, threads, lit, skips)
            rows = laboratory.run()
        if compiled and not jit.DISABLED:
            raise MeasurementError("something was compiled while timing", "timing", "run again; if it stays, report it")
    if problems is None and found:
        raise found[0]
    if problems is not None:
        problems.extend(found)
    if notes is not None:
        notes.extend(laboratory.notes)
    return TIMING.frame(rows)


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


def compile_all(timed: Iterable[Subject], *, lit: Sequence[float] = ()) -> None:
    """Compile, or load from the cache, everything a measurement of these subjects runs."""
    for _ in _compile_all(timed, []):
        pass
    if lit:
        skip_kernels.group(FLOAT32)


def _compile_all(
    timed: Iterable[Subject], found: list[MeasurementError]
) -> Iterator[tuple[Precision, list[Contender]]]:
    """The contenders of each precision; subjects that do not compile become problems."""
    by_precision: dict[str, list[Subject]] = {}
    for subject in timed:
        by_precision.setdefault(subject.precision.name, []).append(subject)
    for name, mine in by_precision.items():
        precision = precision_named(name)
        group = {c.key: c for c in timed_kernels.companions(precision)}
        for subject in mine:
            try:
                if subject.key not in group:
                    group[subject.key] = timed_kernels.compiled(subject)
            except MeasurementError as problem:
                found.append(problem)
        Block.prepare(precision, next(c for c in group.values() if c.name == BASELINE))
        yield precision, list(group.values())
