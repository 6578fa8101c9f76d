"""One timing run: which blocks there are, what the budget affords, the rounds, and the rows they end in."""

import math
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from phongbench.compiler.lowering import FLOAT32, Precision
from phongbench.errors import BudgetError, MeasurementError
from phongbench.results.machine import cache_sizes
from phongbench.results.schema import BASELINE, CEILINGS, DOT, TWIN
from phongbench.timing import budget, skip_kernels, table, timed_kernels
from phongbench.timing.blocks import WORKING_SETS, Block, block_bytes, memory_sizes
from phongbench.timing.epoch_loop import tick
from phongbench.timing.interference import Witness
from phongbench.timing.rounds import Epoch, Readings, run_rounds
from phongbench.timing.statistics import MIN_ROUNDS, contested
from phongbench.timing.timed_kernels import TimedKernel

Progress = Callable[[int, int, str], None]
#: takes the refusal of a budget, and gives seconds to time for instead, or raises it
OnShort = Callable[[BudgetError], float]
#: working sets in which several threads are timed, and the one in which skipping is: large enough that branches are
#: not learnt by heart
THREADED_SETS, SKIPPED_SET = ("l1", "memory"), "l2"
#: share of the budget over which blocks may take it to get rounds enough for a good interval
_LATE = 1.15


def refused(short: BudgetError) -> float:
    """Raises it: the usual answer."""
    raise short


@dataclass
class Session:
    """One timing run after everything is compiled.

    groups    the kernels of each precision
    skips     the kernels of blocks about skipping, at the shares `lit`
    progress  is called with (epochs done, epochs planned, working set)
    problems  receives what made a kernel's row void
    notes     receives what the budget was too small for
    on_short  what follows where it is too small for any interval; what was calibrated stays
    """

    groups: list[tuple[Precision, list[TimedKernel]]]
    skips: list[TimedKernel]
    working_sets: Sequence[str]
    seconds: float
    seed: int
    threads: Sequence[int]
    lit: Sequence[float]
    progress: Progress | None
    problems: list[MeasurementError] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    on_short: OnShort = refused

    def run(self) -> list[dict[str, Any]]:
        """Calibrate, plan, verify, measure; the rows of timing.parquet."""
        self.started = time.perf_counter()
        large = memory_sizes(cache_sizes())
        blocks = self._blocks()
        try:
            step = tick()
            for block in blocks:
                block.calibrate(step)
            blocks = self._afforded(blocks)
            rounds, scale = self._planned(blocks, [size / large[-1] for size in large])
            for block in blocks:
                if not block.cached and scale > 1:
                    block.enlarge(scale, round(scale * large[-1]), self.seed)
                self.problems += block.verify()
            return self._measured(blocks, rounds)
        finally:
            for block in blocks:
                block.close()

    def _blocks(self) -> list[Block]:
        sizes, blocks = block_bytes(), []
        for name in (n for n in WORKING_SETS if n in self.working_sets):
            for precision, kernels in self.groups:
                mine = kernels if name == WORKING_SETS[0] else timed_kernels.in_every_set(kernels)
                more = timed_kernels.on_threads(mine, self.threads) if name in THREADED_SETS else []
                blocks.append(Block(name, precision, [*mine, *more], sizes[name], self.seed))
        where = SKIPPED_SET if SKIPPED_SET in self.working_sets else blocks[0].working_set
        for lit in self.lit:
            pairs = skip_kernels.inputs(lit)
            blocks.append(Block(where, FLOAT32, list(self.skips), sizes[where], self.seed, pairs, lit))
        return blocks

    def _seconds_left(self) -> float:
        return budget.PLANNED * (self.seconds - (time.perf_counter() - self.started))

    def _afforded(self, blocks: list[Block]) -> list[Block]:
        """The blocks without what the budget is too small for.

        Skipping goes first, then several threads beyond the caches, then several threads.
        """

        def enough() -> bool:
            return budget.fits([(b.working_set, b.round_seconds) for b in blocks], self._seconds_left())

        if self.lit and not enough():
            blocks = [b for b in blocks if b.lit is None]
            self.notes.append("skipping was not timed: the budget is too small")
        for name in reversed(THREADED_SETS):
            threaded = [b for b in blocks if b.working_set == name and b.threads > 1]
            if threaded and not enough():
                for block in threaded:
                    block.keep([i for i, kernel in enumerate(block.kernels) if kernel.threads == 1])
                self.notes.append(f"several threads were not timed in {name}: the budget is too small")
        return blocks

    def _planned(self, blocks: list[Block], scales: list[float]) -> tuple[list[int], float]:
        costs = [(b.working_set, b.round_seconds) for b in blocks]
        plan = budget.plan_rounds(costs, self._seconds_left(), scales)
        if not isinstance(plan, tuple):
            self.seconds = self.on_short(self._too_short(plan, blocks))
            plan = budget.plan_rounds(costs, self._seconds_left(), scales)
        if not isinstance(plan, tuple):
            raise self._too_short(plan, blocks)
        return plan

    def _too_short(self, rounds: float, blocks: list[Block]) -> BudgetError:
        """The refusal of the budget, where the fewest rounds take so many seconds."""
        spent = time.perf_counter() - self.started
        kernels = sum(len(group) for _, group in self.groups)
        needed = math.ceil(12 * (spent + rounds / budget.PLANNED)) / 10
        sets = ", ".join(dict.fromkeys(b.working_set for b in blocks))
        return BudgetError(
            f"{self.seconds:g} s are too short to time {kernels} kernels in {sets}: it takes about {needed:g} s",
            needed,
            "timing budget",
            "give that much, or fewer approximations or precisions, or leave timing out",
        )

    def _measured(self, blocks: list[Block], rounds: list[int]) -> list[dict[str, Any]]:
        rng = np.random.default_rng(self.seed & 0xFFFFFFFFFFFFFFFF)
        end, late = self.started + self.seconds, self.started + _LATE * self.seconds
        epochs = [len(b.kernels) * r for b, r in zip(blocks, rounds, strict=True)]
        costs = [b.round_seconds * r for b, r in zip(blocks, rounds, strict=True)]
        taken: list[Readings] = []
        with closing(Witness()) as witness:
            for at, block in enumerate(blocks):
                now = time.perf_counter()
                deadline = now + (end - now) * costs[at] / max(sum(costs[at:]), 1e-9)
                taken.append(
                    run_rounds(
                        partial(block.epoch, witness),
                        len(block.kernels),
                        rounds[at],
                        rng,
                        repeat=partial(_before, deadline),
                        go_on=partial(_goes_on, min(budget.GOOD_ROUNDS, rounds[at]), deadline, late),
                        after_round=partial(self._report, sum(epochs[:at]), sum(epochs), block),
                    )
                )
            _settle(blocks, taken, witness, rng, end)
        return table.withheld([row for at, block in enumerate(blocks) for row in self._rows(block, taken[at])])

    def _rows(self, block: Block, readings: Readings) -> list[dict[str, Any]]:
        """The rows of a block but those of void kernels; none where what they are compared with is void."""
        for i in sorted(block.differs):
            self.problems.append(block.void(block.kernels[i], "a timed output differs from the verified one"))
        missing = {BASELINE, TWIN, *CEILINGS} - {k.name for i, k in enumerate(block.kernels) if i not in block.differs}
        if missing:
            why = f"nothing to compare with: {', '.join(sorted(missing))} is void"
            self.problems.append(MeasurementError(why, block.where, "run again; if it stays, report it"))
            return []
        more: dict[str, Any] = {"working_set": block.working_set, "elements": block.elements}
        more |= {} if block.lit is None else {"lit": block.lit}
        rows = table.analyse(block.kernels, readings, block.elements)
        wanted = None if block.lit is None else skip_kernels.names()
        return [
            row | more | {"repeats": int(block.repeats[i])}
            for i, row in enumerate(rows)
            if i not in block.differs and (wanted is None or row["approximation"] in wanted)
        ]

    def _report(self, before: int, total: int, block: Block, rounds: int) -> None:
        if self.progress is not None:
            self.progress(before + rounds * len(block.kernels), total, block.where)


def _settle(blocks: list[Block], taken: list[Readings], witness: Witness, rng: np.random.Generator, end: float) -> None:
    """Spend what is left of the budget on kernels whose order in time is not decided, block by block in turn."""

    def epoch(number: int) -> Epoch:
        return block.epoch(witness, members[number])

    undecided = [at for at, block in enumerate(blocks) if block.lit is None]
    while undecided:
        for at in list(undecided):
            block, members = blocks[at], _undecided(blocks[at], taken[at])
            needed = budget.FURTHER_ROUNDS * block.seconds_of(members)
            if not members or len(taken[at].used) >= budget.MOST_ROUNDS or time.perf_counter() + needed > end:
                undecided.remove(at)
                continue
            further = run_rounds(epoch, len(members), budget.FURTHER_ROUNDS, rng, repeat=partial(_before, end))
            taken[at] = taken[at].with_further(further, members)


def _undecided(block: Block, readings: Readings) -> list[int]:
    """The formulas whose intervals overlap a neighbour's, with the baseline and the dot product; or none."""
    place = {kernel.name: i for i, kernel in reversed(list(enumerate(block.kernels)))}
    formulas = [i for i, k in enumerate(block.kernels) if k.threads == 1 and k.name not in (TWIN, *CEILINGS)]
    intervals = [readings.ratio(i, place[BASELINE]) for i in formulas]
    unsure = {formulas[k] for k in contested(intervals)}
    return sorted(unsure | {place[BASELINE], place[DOT]}) if unsure else []


def _before(deadline: float) -> bool:
    return time.perf_counter() < deadline


def _goes_on(least: int, deadline: float, late: float, done: int) -> bool:
    """Always take enough rounds for an interval, until late enough for a good one, and more while there is time."""
    return done < MIN_ROUNDS or time.perf_counter() < (late if done < least else deadline)
