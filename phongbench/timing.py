"""Interleaved, calibrated measurement of run time, with the evidence of what disturbed it.

A block is one working set in one precision: all its kernels run over the same buffers, with the same number of
repeats, once in every round, in the order of a Latin square. What is reported are quotients within rounds; nanoseconds
stand beside them.

Known biases, written against ourselves: all kernels share one placement of their arrays in memory (chosen so that rows
do not alias); kernels run hot, on values of the highlight stratum at alpha = 50, and in l1 few enough of them for the
branch predictor to learn by heart, which flatters kernels that branch; slow kernels have longer epochs, which are more
often disturbed; ceilings count bytes as STREAM does, without the read that a store to a cold line costs, so a formula
reading six rows per store can pass 100 % of a copy's bandwidth.
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
from phongbench.blocks import WORKING_SETS, Block, memory_sizes, tick
from phongbench.clock import Readings
from phongbench.contenders import Contender, Subject, subjects
from phongbench.errors import InputError, LockedError, MeasurementError, StorageError, UnknownNameError
from phongbench.lowering import PRECISIONS, Precision
from phongbench.provenance import cache_sizes

__all__ = ["COLUMNS", "WORKING_SETS", "Subject", "measure", "subjects"]

Progress = Callable[[int, int, str], None]

#: rounds a block should have, and rounds beyond which more teach nothing; below clock.MIN_ROUNDS there is no interval
GOOD_ROUNDS, MOST_ROUNDS = 24, 64
#: columns of timing.parquet as contract.md fixes them, then ours
COLUMNS = [
    "approximation", "lambda_form", "space", "beta_policy", "gamma", "precision", "working_set", "elements", "threads",
    "ns_min", "ns_median", "ratio", "ratio_low", "ratio_high", "verdict", "dot_ratio", "bandwidth_fraction", "rounds",
    "contaminated", "repeats", "compile_ms",
]  # fmt: skip
#: share of the budget that is planned with; the rest is for repeating disturbed epochs
PLANNED = 0.85
LOCK_NAME = "phongbench-timing.lock"
_NUMBERS = ("ns_min", "ns_median", "ratio", "ratio_low", "ratio_high", "dot_ratio", "bandwidth_fraction", "compile_ms")
_COUNTS = ("elements", "threads", "rounds", "contaminated", "repeats")
TYPES = dict.fromkeys(COLUMNS, "str") | dict.fromkeys(_NUMBERS, "float64") | dict.fromkeys(_COUNTS, "int64")
TYPES["gamma"] = "Int64"


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

    timed           subjects, float32 or float64; see `subjects`. None gives no rows
    budget_seconds  for everything but compilation, which comes first and is a column of its own
    working_sets    which of l1, l2, memory
    seed            of inputs and orders
    progress        told (epochs done, epochs planned, working set)
    problems        receives what made a kernel's row void; without it the first problem is raised at the end
    returns         DataFrame with COLUMNS, one row per kernel and working set; void kernels have none
    Raises InputError where the budget cannot give the rounds an interval needs, saying what can; LockedError while
    another timing runs.
    """
    _check(budget_seconds, working_sets, threads)
    if not timed:
        return _frame([])
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


def _check(budget: float, working_sets: Sequence[str], threads: Sequence[int]) -> None:
    if not (math.isfinite(budget) and budget > 0):
        raise InputError(f"{budget} s is no time", "timing budget", "give seconds above 0, or leave timing out")
    if not working_sets:
        raise InputError("nothing to time", "working sets", f"name some of {', '.join(WORKING_SETS)}")
    for name in working_sets:
        if name not in WORKING_SETS:
            raise UnknownNameError("working set", name, WORKING_SETS)
    if tuple(threads) != (1,):
        raise InputError(f"threads {tuple(threads)}: only one thread is timed", "timing", "use threads=(1,)")
    if jit.DISABLED:
        why = "kernels run as plain Python, whose time says nothing"
        raise InputError(why, "NUMBA_DISABLE_JIT", "unset it, or leave timing out")


def compile_all(timed: Iterable[Subject]) -> None:
    """Compile, or load from the cache, everything a measurement of these subjects runs."""
    for _ in _compile_all(timed, []):
        pass


def _compile_all(
    timed: Iterable[Subject], found: list[MeasurementError]
) -> Iterator[tuple[Precision, list[Contender]]]:
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
        Block.prepare(precision, group[_key(contenders.BASELINE, precision)])
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

    First every block gets GOOD_ROUNDS, then "memory" grows, then all blocks get more rounds. Where even GOOD_ROUNDS
    are too many, "memory" gets fewer, then all do, down to MIN_ROUNDS: intervals widen and stay true, and the column
    `rounds` says why. Verifying outputs counts as half as much again as a round.
    """
    cached = sum(cost for name, cost in costs if name != "memory")
    memory = sum(cost for name, cost in costs if name == "memory")

    def total(rounds: float, large: float, scale: float = 1.0) -> float:
        return cached * (rounds + 1.5) + memory * scale * (large + 1.5)

    if total(clock.MIN_ROUNDS, clock.MIN_ROUNDS) > seconds:
        return total(clock.MIN_ROUNDS, clock.MIN_ROUNDS)
    if total(GOOD_ROUNDS, GOOD_ROUNDS) <= seconds:
        scale = next(s for s in scales if total(GOOD_ROUNDS, GOOD_ROUNDS, s) <= seconds)
        most = min(MOST_ROUNDS, math.floor(GOOD_ROUNDS * seconds / total(GOOD_ROUNDS, GOOD_ROUNDS, scale)))
        return [most] * len(costs), scale
    large = few = GOOD_ROUNDS
    if memory:
        large = max(clock.MIN_ROUNDS, math.floor((seconds - total(few, -1.5)) / memory - 1.5))
    if cached:
        few = min(GOOD_ROUNDS, max(clock.MIN_ROUNDS, math.floor((seconds - total(-1.5, large)) / cached - 1.5)))
    return [large if name == "memory" else few for name, _ in costs], 1.0


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
        blocks = [Block(name, p, list(group), sizes[name], self.seed) for name in names for p, group in self.groups]
        step = tick()
        for block in blocks:
            block.calibrate(step)
        rounds, scale = self._planned(blocks, [size / large[-1] for size in large])
        for block in blocks:
            if not block.cached and scale > 1:
                block.enlarge(scale, round(scale * large[-1]), self.seed)
            block.verify(self.found)
        return self._measured(blocks, rounds)

    def _planned(self, blocks: list[Block], scales: list[float]) -> tuple[list[int], float]:
        spent = time.perf_counter() - self.started
        plan = plan_rounds([(b.working_set, b.round_seconds) for b in blocks], PLANNED * (self.budget - spent), scales)
        if isinstance(plan, tuple):
            return plan
        kernels, needed = sum(len(group) for _, group in self.groups), math.ceil(12 * (spent + plan / PLANNED)) / 10
        sets = ", ".join(dict.fromkeys(b.working_set for b in blocks))
        raise InputError(
            f"{self.budget:g} s are too short to time {kernels} kernels in {sets}: it takes about {needed:g} s",
            "timing budget",
            "give that much, or fewer approximations or precisions, or leave timing out",
        )

    def _measured(self, blocks: list[Block], rounds: list[int]) -> list[dict[str, Any]]:
        rng = np.random.default_rng(self.seed & 0xFFFFFFFFFFFFFFFF)
        end, late = self.started + self.budget, self.started + 1.15 * self.budget
        epochs = [len(b.contenders) * r for b, r in zip(blocks, rounds, strict=True)]
        costs = [b.round_seconds * r for b, r in zip(blocks, rounds, strict=True)]
        rows: list[dict[str, Any]] = []
        with closing(clock.Witness()) as witness:
            for at, block in enumerate(blocks):
                now = time.perf_counter()
                deadline = now + (end - now) * costs[at] / max(sum(costs[at:]), 1e-9)
                lying: set[int] = set()
                readings = clock.run_rounds(
                    partial(block.epoch, witness, lying), len(block.contenders), rounds[at], rng,
                    repeat=partial(_before, deadline),
                    go_on=partial(_goes_on, min(GOOD_ROUNDS, rounds[at]), deadline, late),
                    after_round=partial(self._tell, sum(epochs[:at]), sum(epochs), block),
                )  # fmt: skip
                for i in sorted(lying):
                    self.found.append(block.void(block.contenders[i], "a timed output differs from the verified one"))
                rows += self._analysed(block, readings, lying)
        return withheld(rows)

    def _analysed(self, block: Block, readings: Readings, lying: set[int]) -> list[dict[str, Any]]:
        believed = {c.name for i, c in enumerate(block.contenders) if i not in lying}
        missing = {contenders.BASELINE, contenders.TWIN, *contenders.CEILINGS} - believed
        if missing:
            why = f"nothing to compare with: {', '.join(sorted(missing))} is void"
            self.found.append(MeasurementError(why, block.where, "run again; if it stays, report it"))
            return []
        rows = analyse(block.contenders, readings, block.elements * block.repeats)
        more = {"working_set": block.working_set, "elements": block.elements, "repeats": block.repeats}
        return [{**row, **more} for i, row in enumerate(rows) if i not in lying]

    def _tell(self, before: int, total: int, block: Block, rounds: int) -> None:
        if self.progress is not None:
            self.progress(before + rounds * len(block.contenders), total, block.where)


def _before(deadline: float) -> bool:
    return time.perf_counter() < deadline


def _goes_on(least: int, deadline: float, late: float, done: int) -> bool:
    """Always take enough rounds for an interval, until late enough for a good one, and more while there is time."""
    return done < clock.MIN_ROUNDS or time.perf_counter() < (late if done < least else deadline)


# rows


def analyse(timed: Sequence[Contender], readings: Readings, per_epoch: int) -> list[dict[str, Any]]:
    """One row for each contender of a block: nanoseconds, ratios and verdict, from the epochs' readings.

    per_epoch  elements times repeats: what an epoch's nanoseconds are divided by
    """
    place = {c.name: i for i, c in reversed(list(enumerate(timed)))}
    used = readings.used
    baseline, dot = used[:, place[contenders.BASELINE]], used[:, place[contenders.DOT]]
    ceiling = max(timed[place[n]].rows / readings.least(place[n]) for n in (contenders.COPY, contenders.TRIAD))
    rows = []
    for i, c in enumerate(timed):
        name, form, space, gamma, precision = c.key
        ratio = clock.ratio(used[:, i], baseline)
        rows.append({
            "approximation": name, "lambda_form": form, "space": space, "beta_policy": "none", "gamma": gamma,
            "precision": precision, "threads": 1,
            "ns_min": readings.least(i) / per_epoch, "ns_median": readings.median(i) / per_epoch,
            "ratio": ratio.middle, "ratio_low": ratio.low, "ratio_high": ratio.high, "verdict": clock.verdict(ratio),
            "dot_ratio": clock.ratio(used[:, i], dot).middle,
            "bandwidth_fraction": c.rows / readings.least(i) / ceiling,
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


def _holder(note: Path) -> str:
    try:
        return f" (process {int(note.read_text())})"
    except (OSError, ValueError):
        return ""


@contextmanager
def machine_lock() -> Iterator[None]:
    """Held while timing: two timings at once would measure each other. Lets go when the process dies."""
    path = Path(tempfile.gettempdir()) / LOCK_NAME
    lock, note = filelock.FileLock(path, mode=0o666, timeout=0), path.with_suffix(".pid")
    try:
        lock.acquire()
    except filelock.Timeout as problem:
        raise LockedError(
            f"another phongbench{_holder(note)} is timing on this machine",
            path.name,
            "wait for it, or leave timing out",
        ) from problem
    except OSError as problem:
        raise StorageError(
            f"the lock of timing runs cannot be opened: {problem.strerror}", path.name, "delete it, or set TMPDIR"
        ) from problem
    try:
        with suppress(OSError):
            note.write_text(str(os.getpid()))
        yield
    finally:
        with suppress(OSError):
            note.unlink()
        lock.release()
