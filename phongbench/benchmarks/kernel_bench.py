"""Our kernels against other people's tools: the same work on the same vectors, interleaved in one run.

Everybody is called from Python, once a pass, and computes exact Phong and Lyon gamma 8 in float32 from two arrays of
vectors, on one thread: ours pays for its call like the others. Beside C, a Gaussian and Lyon's cross form are timed
too. Passes are repeated to fill epochs, epochs are taken in Latin squares, ratios are within rounds, and every result
is checked against float64.

Known biases: the arrays are laid out for us, components in rows, which suits everybody here; a peer that allocates its
result pays for that, because its users do; ours needs a gate on a.b > 0 that the others' formulas do not.
"""

import math
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from phongbench import __version__
from phongbench.benchmarks import bounds, kernel_peers, numpy_sweep, subnormals
from phongbench.benchmarks.arena import Arena
from phongbench.benchmarks.kernel_peers import ALL_WORKS, ALPHA, FORMULAS, GAMMA, WORKS, Peer, exact_values
from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32
from phongbench.errors import InputError
from phongbench.results.machine import machine
from phongbench.support.progress import Progress
from phongbench.timing import statistics, timed_kernels
from phongbench.timing.blocks import block_bytes
from phongbench.timing.budget import GOOD_ROUNDS, MOST_ROUNDS
from phongbench.timing.epoch_loop import tick
from phongbench.timing.interference import Witness, disturbed
from phongbench.timing.machine_lock import machine_lock
from phongbench.timing.rounds import Epoch, Readings, agreed, repeats_for, run_rounds
from phongbench.timing.statistics import LEVEL_TEXT, MIN_ROUNDS
from phongbench.timing.timed_kernels import TimedFormula, TimedKernel

OURS, TWIN = "phongbench", "phongbench again"
#: who runs the loops that show what the machine gives
_MACHINE = "machine"
#: in cache, yet large enough for the cost of a call from Python not to decide; and beyond cache
WORKING_SETS = ("l2", "memory")
#: an epoch of a call from Python: longer than a compiled one, since the clock is read by Python too
EPOCH_NS = 300_000
#: float32 rounding of a.b, magnified by the exponent
TOLERANCE = 8 * ALPHA * float(np.finfo(np.float32).eps)


@dataclass
class Entrant:
    """One tool doing one kind of work.

    once      one pass over all elements, returning its values
    repeats   passes of an epoch
    pass_ns   nanoseconds of a pass when calibrated
    cpu, wall nanoseconds of processor and of clock over all epochs: their quotient tells how many cores were used
    """

    work: str
    by: str
    version: str
    once: Callable[[], Any]
    repeats: int = 1
    pass_ns: float = 0.0
    error: float = math.nan
    cpu: int = 0
    wall: int = 0

    def epoch(self, repeats: int) -> int:
        """Nanoseconds of so many passes."""
        cpu, started = time.process_time_ns(), time.perf_counter_ns()
        for _ in range(repeats):
            self.once()
        took = time.perf_counter_ns() - started
        self.cpu += time.process_time_ns() - cpu
        self.wall += took
        return max(1, took)

    def calibrate(self, step: float) -> None:
        """Warm up, then choose the repeats that fill an epoch."""
        few = max(1, round(EPOCH_NS / self.epoch(1) / 4))
        self.pass_ns = agreed(lambda: self.epoch(few) / few)
        self.repeats = repeats_for(self.pass_ns, step, EPOCH_NS)
        self.cpu = self.wall = 0

    @property
    def epoch_seconds(self) -> float:
        """What an epoch is expected to take, its untimed pass included."""
        return self.pass_ns * (self.repeats + 1) / 1e9 + 1e-4


def bench(
    names: tuple[str, ...] | None = None,
    *,
    budget_seconds: float = 10.0,
    working_sets: tuple[str, ...] = WORKING_SETS,
    seed: int = 1,
    progress: Progress | None = None,
    sweep: Callable[[], dict[str, float]] = numpy_sweep.throughput,
) -> dict[str, Any]:
    """Time our kernels beside every installed peer, then the sweep beside plain NumPy.

    names           peers, or None for all
    budget_seconds  for the rounds; compiling and the sweep come on top
    returns         machine, alpha, gamma, the level of intervals, `rows`, `bounds` of our own loops, `ours` and
                    `ceilings` for a ledger, `absent` {peer: why}, `notes`, `subnormals`, `sweep`, as plain data
    Raises UnknownNameError for an unknown peer, InputError where the budget is too short, saying what it takes,
    LockedError while another timing runs.
    """
    names, progress = kernel_peers.chosen(names), progress or Progress()
    if not (math.isfinite(budget_seconds) and budget_seconds > 0):
        raise InputError(f"{budget_seconds} s is no time", "budget", "give seconds above 0, 10 is a good start")
    if jit.DISABLED:
        raise InputError("kernels run as plain Python, whose time says nothing", "NUMBA_DISABLE_JIT", "unset it")
    absent, notes = dict[str, str](), list[str]()
    with machine_lock():
        progress.stage("compiling")
        ours = {work: timed_kernels.compiled(TimedFormula.of(spelling, FLOAT32)) for work, spelling in FORMULAS.items()}
        asked = {work: bounds.of_loop(kernel.kernel.loop) for work, kernel in ours.items()}
        contests = [_Contest(name, ours, names, seed, absent, notes) for name in working_sets]
        rounds = _affordable(budget_seconds, sum(contest.round_seconds for contest in contests))
        progress.stage("timing", rounds * len(contests))
        rows = [row for contest in contests for row in contest.measured(rounds, seed, progress)]
        progress.stage("timing subnormal numbers")
        limits = [row for contest in contests for row in bounds.rows(contest.working_set, contest.least, asked)]
        slow = subnormals.measure(seed=seed)
    progress.stage("sweeping")
    notes += bounds.excuses(limits) if limits else ["no bounds of our loops: they are counted in x86's code of vectors"]
    if rounds < GOOD_ROUNDS:
        notes.append(f"{rounds} rounds only, so intervals are wide: a larger --budget narrows them")
    return {
        "alpha": ALPHA,
        "gamma": GAMMA,
        "machine": machine().cpu,
        "interval": LEVEL_TEXT,
        "rows": rows,
        "bounds": limits,
        "ours": [row for contest in contests for row in contest.ours],
        "ceilings": {contest.working_set: bounds.rates(contest.least) for contest in contests},
        "absent": absent,
        "notes": notes,
        "subnormals": slow,
        "sweep": sweep(),
    }


def _affordable(budget_seconds: float, round_seconds: float) -> int:
    """How many rounds the budget allows; InputError, saying what it takes, where these give no interval."""
    share = budget_seconds / max(1e-9, round_seconds)
    rounds = min(MOST_ROUNDS, math.floor(share) - 1)
    if rounds < MIN_ROUNDS:
        needed = math.ceil((MIN_ROUNDS + 1) * budget_seconds / share)
        what = f"{budget_seconds:g} s are too short for this comparison: it takes {needed} s"
        raise InputError(what, "budget", "give that much, or name fewer --peers")
    return rounds


def _as_peer(ours: dict[str, TimedKernel], arena: Arena) -> Peer:
    arrays = arena.a, arena.b, arena.out
    return Peer(__version__, {work: bounds.passing(timed.kernel, *arrays) for work, timed in ours.items()})


class _Contest:
    """Everybody over the buffers of one working set.

    absent, notes  receive why a peer cannot take part, and what else there is to say
    """

    def __init__(
        self,
        working_set: str,
        ours: dict[str, TimedKernel],
        names: tuple[str, ...],
        seed: int,
        absent: dict[str, str],
        notes: list[str],
    ) -> None:
        self.working_set, self.arena = working_set, Arena(block_bytes()[working_set], seed)
        self.notes = notes
        us = _as_peer(ours, self.arena)
        peers: dict[str, Peer] = {OURS: us, TWIN: us}
        for name in names:
            peer = kernel_peers.prepared(name, self.arena.a, self.arena.b, self.arena.out)
            if isinstance(peer, str):
                absent[name] = peer
            else:
                peers[name] = peer
        others = {work for by, peer in peers.items() if peer is not us for work in peer.passes}
        entrants = [
            Entrant(work, by, peer.version, peer.passes[work])
            for work in ALL_WORKS
            for by, peer in peers.items()
            if work in peer.passes and (work in others or work in WORKS)
        ]
        self.entrants = [entrant for entrant in entrants if self._right(entrant)]
        arrays = self.arena.a, self.arena.b, self.arena.out
        self.entrants += [Entrant(unit, _MACHINE, "", bounds.calibrating(unit, *arrays)) for unit in bounds.CALIBRATED]
        step = tick()
        for entrant in self.entrants:
            entrant.calibrate(step)
        self.usual_spin = float(np.percentile([self.arena.spin() for _ in range(51)], 25))

    def _right(self, entrant: Entrant) -> bool:
        """Whether its values are right to float32's rounding; a wrong one gets no row, but a note."""
        self.arena.out.fill(np.nan)
        values = np.asarray(entrant.once())
        exact = exact_values(entrant.work, self.arena.a, self.arena.b)
        entrant.error = float(np.abs(values - exact).max()) if values.shape == exact.shape else math.nan
        if values.dtype == np.float32 and entrant.error <= TOLERANCE:
            return True
        self.notes.append(
            f"{entrant.by}, {entrant.work}, {self.working_set}: left out, its values are wrong (largest error "
            f"{entrant.error:.3g}, allowed {TOLERANCE:.3g}, {values.dtype})"
        )
        return False

    @property
    def round_seconds(self) -> float:
        """What a round is expected to take."""
        return sum(entrant.epoch_seconds for entrant in self.entrants)

    def measured(self, rounds: int, seed: int, progress: Progress) -> list[dict[str, Any]]:
        """The rows of this working set."""
        end = time.perf_counter() + 1.3 * rounds * self.round_seconds
        with closing(Witness()) as witness:
            readings = run_rounds(
                partial(self._epoch, witness),
                len(self.entrants),
                rounds,
                np.random.default_rng(seed),
                repeat=lambda: time.perf_counter() < end,
                after_round=lambda done: progress.advance(),
            )
        shown = [(e.work, readings.least(i)) for i, e in enumerate(self.entrants) if e.by in (OURS, _MACHINE)]
        self.least = {work: ns / self.arena.elements for work, ns in shown}
        self.ours = self._over_sums(readings)
        competing = [(i, entrant) for i, entrant in enumerate(self.entrants) if entrant.by != _MACHINE]
        rows = [self._row(i, readings) for i, entrant in competing if self._right(entrant)]
        twins = [row for row in rows if row["by"] == TWIN]
        if any(row["verdict"] != "unresolved" for row in twins):
            self.notes.append(f"{self.working_set}: identical code was told apart, so no verdict is given here")
            rows = [row if row["by"] == OURS else row | {"verdict": "unresolved"} for row in rows]
        for row in rows:
            if row["cores"] > 1.2:
                self.notes.append(f"{row['by']} used {row['cores']:.1f} cores, not one ({self.working_set})")
        return rows

    def _over_sums(self, readings: Readings) -> list[dict[str, Any]]:
        """Our loops and the calibrating ones, over the one of these that only reads and adds: what a ledger keeps."""
        sums = next(i for i, e in enumerate(self.entrants) if (e.by, e.work) == (_MACHINE, bounds.BYTES))
        return [
            {
                "part": "kernel" if e.by == OURS else "ceiling",
                "name": e.work,
                "place": self.working_set,
                "ns": readings.least(i) / self.arena.elements,
                **readings.ratio(i, sums).columns(),
                "rounds": readings.rounds(i),
            }
            for i, e in enumerate(self.entrants)
            if e.by in (OURS, _MACHINE)
        ]

    def _epoch(self, witness: Witness, index: int) -> Epoch:
        entrant = self.entrants[index]
        before = witness.see(self.arena.spin())
        entrant.once()
        nanoseconds = entrant.epoch(entrant.repeats) / entrant.repeats
        after = witness.see(self.arena.spin())
        return Epoch(nanoseconds, disturbed(before, after, self.usual_spin))

    def _row(self, index: int, readings: Readings) -> dict[str, Any]:
        entrant, n = self.entrants[index], self.arena.elements
        base = next(i for i, e in enumerate(self.entrants) if (e.by, e.work) == (OURS, entrant.work))
        ratio = readings.ratio(index, base)
        return {
            "work": entrant.work,
            "by": entrant.by,
            "version": entrant.version,
            "working_set": self.working_set,
            "elements": n,
            "ns": readings.least(index) / n,
            "ns_median": readings.median(index) / n,
            **ratio.columns(),
            "verdict": "baseline" if index == base else statistics.verdict(ratio),
            "cores": entrant.cpu / max(1, entrant.wall),
            "error": entrant.error,
            "rounds": readings.rounds(index),
            "contaminated": int(readings.marked[index]),
        }
