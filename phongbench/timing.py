"""Interleaved, calibrated measurement of run time, with the evidence of what disturbed it. The rules are those of measuring.md.

A block is one working set in one precision: all its kernels run over the same buffers, with the same number of repeats, once in every
round, in the order of a Latin square. What is reported are quotients within rounds; nanoseconds stand beside them.

Known biases, written against ourselves: all kernels share one placement of their arrays in memory (chosen so that rows do not alias);
kernels run hot, with their predictor trained, on values of the highlight stratum at alpha = 50; ceilings count bytes as STREAM does,
without the read that a store to a cold line costs, so a formula reading six rows per store can pass 100 % of a copy's bandwidth.
"""

import math
import os
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import filelock
import numpy as np
import pandas as pd

from phongbench import clock, contenders, jit
from phongbench.bench import WORKING_SETS, Bench, memory_sizes
from phongbench.bench import tick as bench_tick
from phongbench.clock import Readings
from phongbench.contenders import Contender, Subject, subjects
from phongbench.errors import InputError, LockedError, MeasurementError, StorageError, UnknownNameError
from phongbench.lowering import PRECISIONS, Precision
from phongbench.provenance import cache_sizes

__all__ = ["COLUMNS", "WORKING_SETS", "Subject", "measure", "subjects"]

Progress = Callable[[int, int, str], None]

#: rounds a block needs, rounds it should have, rounds beyond which more teach nothing
LEAST_ROUNDS = {"l1": 24, "l2": 24, "memory": clock.MIN_ROUNDS}
GOOD_ROUNDS, MOST_ROUNDS = 24, 64
#: columns of timing.parquet as contract.md fixes them, then ours
COLUMNS = [
    "approximation", "lambda_form", "space", "beta_policy", "gamma", "precision", "working_set", "elements", "threads", "ns_min",
    "ns_median", "ratio", "ratio_low", "ratio_high", "verdict", "dot_ratio", "bandwidth_fraction", "rounds", "contaminated", "repeats",
    "compile_ms",
]  # fmt: skip
#: share of the budget that is planned with; the rest is for repeating disturbed epochs
PLANNED = 0.85
LOCK_NAME = "phongbench-timing.lock"
_NUMBERS = ("ns_min", "ns_median", "ratio", "ratio_low", "ratio_high", "dot_ratio", "bandwidth_fraction", "compile_ms")
_COUNTS = ("elements", "threads", "rounds", "contaminated", "repeats")
TYPES = {c: "float64" if c in _NUMBERS else "int64" if c in _COUNTS else "Int64" if c == "gamma" else "str" for c in COLUMNS}


def measure(
    timed: Sequence[Subject],
    *,
    budget_seconds: float,
    working_sets: Sequence[str] = WORKING_SETS,
    seed: int = 0,
    progress: Progress | None = None,
    threads: Sequence[int] = (1,),
    problems: list[MeasurementError] | None = None,
) -> pd.DataFrame:
    """Time the subjects beside the exact powers and the ceilings.

    timed           subjects, float32 or float64; see `subjects`
    budget_seconds  for everything but compilation, which comes first and is a column of its own
    working_sets    which of l1, l2, memory
    seed            of inputs and orders
    progress        told (epochs done, epochs planned, working set)
    problems        receives what made a kernel's row void; without it the first problem is raised at the end
    returns         DataFrame with COLUMNS, one row per kernel and working set; void kernels have none
    Raises InputError where the budget cannot give the rounds an interval needs, saying what can; LockedError while another timing runs.
    """
    _check(timed, budget_seconds, working_sets, threads)
    found: list[MeasurementError] = []
    with machine_lock():
        groups = list(_compile_all(timed, found))
        with jit.compilations() as compiled:
            laboratory = _Laboratory(groups, working_sets, budget_seconds, seed, progress, found)
            rows = laboratory.run()
        if compiled and not jit.DISABLED:
            raise MeasurementError("something was compiled while timing", "timing", "run again; if it stays, report it")
    if problems is None and found:
        raise found[0]
    if problems is not None:
        problems.extend(found)
    return _frame(rows)


def _check(timed: Sequence[Subject], budget: float, working_sets: Sequence[str], threads: Sequence[int]) -> None:
    if not (math.isfinite(budget) and budget > 0):
        raise InputError(f"{budget} s is no time", "timing budget", "give seconds above 0, or leave timing out")
    if not timed or not working_sets:
        raise InputError("nothing to time", "timing", "name at least one approximation and one working set")
    for name in working_sets:
        if name not in WORKING_SETS:
            raise UnknownNameError("working set", name, WORKING_SETS)
    if tuple(threads) != (1,):
        raise InputError(f"threads {tuple(threads)}: only one thread is timed", "timing", "use threads=(1,)")
    if jit.DISABLED:
        raise InputError("kernels run as plain Python, whose time says nothing", "NUMBA_DISABLE_JIT", "unset it, or leave timing out")


def _compile_all(timed: Iterable[Subject], found: list[MeasurementError]) -> Iterator[tuple[Precision, list[Contender]]]:
    """The contenders of each precision; subjects that do not compile become problems."""
    by_precision: dict[str, list[Subject]] = {}
    for subject in timed:
        by_precision.setdefault(subject.precision.name, []).append(subject)
    for name, mine in by_precision.items():
        precision = PRECISIONS[name]
        group = {c.key: c for c in contenders.companions(precision)}
        for subject in mine:
            try:
                if subject.key not in group:
                    group[subject.key] = contenders.compiled(subject)
            except MeasurementError as problem:
                found.append(problem)
        Bench.prepare(precision, group[_key(contenders.BASELINE, precision)])
        yield precision, list(group.values())


def _key(name: str, precision: Precision) -> tuple[str, str, str, int | None, str]:
    return name, "none", "reflect", None, precision.name


# rounds within the budget


def plan_rounds(
    costs: Sequence[tuple[str, float]], seconds: float, scales: Sequence[float]
) -> tuple[list[int], float] | float:
    """How many rounds each block gets, and how large the working set "memory" becomes.

    costs    (working set, seconds of a round) of each block, "memory" at its smallest size
    scales   sizes "memory" may have, relative to the smallest, largest first
    returns  rounds of each block, and the size chosen; or the seconds needed where there are too few

    First every block gets GOOD_ROUNDS, then "memory" grows, then all blocks get more rounds. Where even GOOD_ROUNDS are too many,
    "memory" gets fewer. Verifying outputs counts as half as much again as a round.
    """
    rows = [(LEAST_ROUNDS[name], cost, name == "memory") for name, cost in costs]
    needed = sum((least + 1.5) * cost for least, cost, _ in rows)
    if needed > seconds:
        return needed

    def total(scale: float) -> float:
        return sum((GOOD_ROUNDS + 1.5) * cost * (scale if large else 1.0) for _, cost, large in rows)

    if total(1.0) > seconds:
        cached = sum((GOOD_ROUNDS + 1.5) * cost for _, cost, large in rows if not large)
        spare = (seconds - cached) / sum(cost for _, cost, large in rows if large) - 1.5
        return [max(least, math.floor(spare)) if large else least for least, _, large in rows], 1.0
    scale = next(s for s in scales if total(s) <= seconds)
    return [min(MOST_ROUNDS, math.floor(GOOD_ROUNDS * seconds / total(scale)))] * len(rows), scale


@dataclass
class _Laboratory:
    """One timing run after everything is compiled."""

    groups: list[tuple[Precision, list[Contender]]]
    working_sets: Sequence[str]
    budget: float
    seed: int
    progress: Progress | None
    found: list[MeasurementError]

    def run(self) -> list[dict[str, Any]]:
        self.started = time.perf_counter()
        caches = cache_sizes()
        large = memory_sizes(caches)
        sizes = {"l1": caches.l1 // 2, "l2": caches.l2 // 2, "memory": large[-1]}
        names = [name for name in WORKING_SETS if name in self.working_sets]
        benches = [Bench(name, precision, list(group), sizes[name], self.seed) for name in names for precision, group in self.groups]
        tick = bench_tick()
        for bench in benches:
            bench.calibrate(tick)
        rounds, scale = self._planned(benches, [size / large[-1] for size in large])
        for bench in benches:
            if not bench.cached and scale > 1:
                bench.enlarge(scale, round(scale * large[-1]), self.seed)
            bench.verify(self.found)
        return self._measured(benches, rounds)

    def _planned(self, benches: list[Bench], scales: list[float]) -> tuple[list[int], float]:
        spent = time.perf_counter() - self.started
        plan = plan_rounds([(b.working_set, b.round_seconds) for b in benches], PLANNED * (self.budget - spent), scales)
        if isinstance(plan, tuple):
            return plan
        kernels, needed = sum(len(group) for _, group in self.groups), math.ceil(12 * (spent + plan / PLANNED)) / 10
        sets = ", ".join(dict.fromkeys(b.working_set for b in benches))
        raise InputError(
            f"{self.budget:g} s are too short to time {kernels} kernels in {sets}: this machine needs about {needed:g} s",
            "timing budget", "give that much, or fewer approximations or precisions, or leave timing out",
        )  # fmt: skip

    def _measured(self, benches: list[Bench], rounds: list[int]) -> list[dict[str, Any]]:
        rng = np.random.default_rng(self.seed)
        end, late = self.started + self.budget, self.started + 1.15 * self.budget
        epochs = [len(b.contenders) * r for b, r in zip(benches, rounds, strict=True)]
        costs = [b.round_seconds * r for b, r in zip(benches, rounds, strict=True)]
        rows: list[dict[str, Any]] = []
        with closing(clock.Witness()) as witness:
            for at, bench in enumerate(benches):
                now = time.perf_counter()
                deadline = now + (end - now) * costs[at] / sum(costs[at:])
                lying: set[int] = set()
                readings = clock.run_rounds(
                    partial(bench.epoch, witness, lying), len(bench.contenders), rounds[at], rng,
                    repeat=partial(_before, deadline),
                    go_on=partial(_goes_on, LEAST_ROUNDS[bench.working_set], deadline, late),
                    after_round=partial(self._tell, sum(epochs[:at]), sum(epochs), bench),
                )  # fmt: skip
                self.found += [bench.void(bench.contenders[i], "a timed output differs from the verified one") for i in sorted(lying)]
                rows += self._analysed(bench, readings, lying)
        return withheld(rows)

    def _analysed(self, bench: Bench, readings: Readings, lying: set[int]) -> list[dict[str, Any]]:
        believed = {c.name for i, c in enumerate(bench.contenders) if i not in lying}
        missing = {contenders.BASELINE, contenders.TWIN, *contenders.CEILINGS} - believed
        if missing:
            self.found.append(MeasurementError(f"no rows without {', '.join(sorted(missing))}", bench.where, "run again"))
            return []
        rows = analyse(bench.contenders, readings, bench.elements * bench.repeats)
        more = {"working_set": bench.working_set, "elements": bench.elements, "repeats": bench.repeats}
        return [{**row, **more} for i, row in enumerate(rows) if i not in lying]

    def _tell(self, before: int, total: int, bench: Bench, rounds: int) -> None:
        if self.progress is not None:
            self.progress(before + rounds * len(bench.contenders), total, bench.where)


def _before(deadline: float) -> bool:
    return time.perf_counter() < deadline


def _goes_on(least: int, deadline: float, late: float, done: int) -> bool:
    """Take another round: too few for an interval always, too few for a good one until late, else while there is time."""
    return done < clock.MIN_ROUNDS or time.perf_counter() < (late if done < least else deadline)


# rows


def analyse(timed: Sequence[Contender], readings: Readings, per_epoch: int) -> list[dict[str, Any]]:
    """One row for each contender of a block: nanoseconds, ratios and verdict, from the epochs' readings.

    per_epoch  elements times repeats: what an epoch's nanoseconds are divided by
    """
    place = {c.name: i for i, c in reversed(list(enumerate(timed)))}
    used, baseline, dot = readings.used, readings.used[:, place[contenders.BASELINE]], readings.used[:, place[contenders.DOT]]
    ceiling = max(timed[place[n]].rows / readings.least(place[n]) for n in (contenders.COPY, contenders.TRIAD))
    rows = []
    for i, c in enumerate(timed):
        name, form, space, gamma, precision = c.key
        ratio = clock.ratio(used[:, i], baseline)
        rows.append({
            "approximation": name, "lambda_form": form, "space": space, "beta_policy": "none", "gamma": gamma, "precision": precision,
            "threads": 1, "ns_min": readings.least(i) / per_epoch, "ns_median": readings.median(i) / per_epoch,
            "ratio": ratio.middle, "ratio_low": ratio.low, "ratio_high": ratio.high, "verdict": clock.verdict(ratio),
            "dot_ratio": clock.ratio(used[:, i], dot).middle, "bandwidth_fraction": c.rows / readings.least(i) / ceiling,
            "rounds": len(used), "contaminated": int(readings.marked[i]), "compile_ms": c.compile_ms,
        })  # fmt: skip
    return rows


def withheld(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows; if the twin was told apart from itself anywhere, no other row claims to be faster or slower."""
    if all(row["verdict"] == "unresolved" for row in rows if row["approximation"] == contenders.TWIN):
        return rows
    return [row if row["approximation"] == contenders.TWIN else {**row, "verdict": "unresolved"} for row in rows]


def _frame(rows: list[dict[str, Any]]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=COLUMNS).astype(TYPES)


@contextmanager
def machine_lock() -> Iterator[None]:
    """Held while timing: two timings at once would measure each other. Lets go when the process dies."""
    path = Path(tempfile.gettempdir()) / LOCK_NAME
    lock, note = filelock.FileLock(path, mode=0o666, timeout=0), path.with_suffix(".pid")
    try:
        lock.acquire()
    except filelock.Timeout as problem:
        holder = ""
        with suppress(OSError):
            holder = f" (process {note.read_text().strip()})"
        raise LockedError(f"another phongbench{holder} is timing on this machine", str(path.name), "wait for it, or use --no-timing") from problem
    except OSError as problem:
        raise StorageError(f"the lock of timing runs cannot be opened: {problem.strerror}", str(path), "delete it, or set TMPDIR") from problem
    try:
        with suppress(OSError):
            note.write_text(str(os.getpid()))
        yield
    finally:
        with suppress(OSError):
            note.unlink()
        lock.release()
