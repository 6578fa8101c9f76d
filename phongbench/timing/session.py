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
from phongbench.timing import budget as pacing
from phongbench.timing import rounds as clock
from phongbench.timing import skip_kernels, table, timed_kernels
from phongbench.timing.blocks import WORKING_SETS, Block, memory_sizes
from phongbench.timing.epoch_loop import tick
from phongbench.timing.interference import Witness
from phongbench.timing.rounds import Readings
from phongbench.timing.statistics import MIN_ROUNDS, contested
from phongbench.timing.timed_kernels import Contender

Progress = Callable[[int, int, str], None]
#: working sets in which several threads are timed, and the one in which skipping is: large enough that branches are
#: not learnt by heart
THREADED_SETS, SKIPPED_SET = ("l1", "memory"), "l2"


@dataclass
class Laboratory:
    """One timing run after everything is compiled.

    groups  the contenders of each precision
    skips   the contenders of blocks about skipping, at the shares `lit`
    found   receives what made a kernel's row void
    notes   what the budget was too small for
    """

    groups: list[tuple[Precision, list[Contender]]]
    working_sets: Sequence[str]
    budget: float
    seed: int
    progress: Progress | None
    found: list[MeasurementError]
    threads: Sequence[int]
    lit: Sequence[float]
    skips: list[Contender]
    notes: list[str] = field(default_factory=list)

    def run(self) -> list[dict[str, Any]]:
        """Calibrate, plan, verify, measure; the rows of timing.parquet."""
        self.started = time.perf_counter()
        large = memory_sizes(cache_sizes())
        blocks = self._blocks(large[-1])
        try:
            step = tick()
            for block in blocks:
                block.calibrate(step)
            blocks = self._afforded(blocks)
            rounds, scale = self._planned(blocks, [size / large[-1] for size in large])
            for block in blocks:
                if not block.cached and scale > 1:
                    block.enlarge(scale, round(scale * large[-1]), self.seed)
                block.verify(self.found)
            return self._measured(blocks, rounds)
        finally:
            for block in blocks:
                block.close()

    def _blocks(self, smallest: int) -> list[Block]:
        caches = cache_sizes()
        sizes = {"l1": caches.l1 // 2, "l2": caches.l2 // 2, "memory": smallest}
        blocks = []
        for name in (n for n in WORKING_SETS if n in self.working_sets):
            for precision, group in self.groups:
                more = timed_kernels.on_threads(group, self.threads) if name in THREADED_SETS else []
                blocks.append(Block(name, precision, [*group, *more], sizes[name], self.seed))
        where = SKIPPED_SET if SKIPPED_SET in self.working_sets else blocks[0].working_set
        for lit in self.lit:
            made = skip_kernels.inputs(lit)
            blocks.append(Block(where, FLOAT32, list(self.skips), sizes[where], self.seed, made, lit))
        return blocks

    def _seconds(self) -> float:
        return pacing.PLANNED * (self.budget - (time.perf_counter() - self.started))

    def _afforded(self, blocks: list[Block]) -> list[Block]:
        """The blocks without what the budget is too small for.

        Skipping goes first, then several threads beyond the caches, then several threads.
        """

        def enough() -> bool:
            return pacing.fits([(b.working_set, b.round_seconds) for b in blocks], self._seconds())

        if self.lit and not enough():
            blocks = [b for b in blocks if b.lit is None]
            self.notes.append("skipping was not timed: the budget is too small")
        for name in reversed(THREADED_SETS):
            mine = [b for b in blocks if b.working_set == name and b.threads > 1]
            if mine and not enough():
                for block in mine:
                    block.keep([i for i, c in enumerate(block.contenders) if c.threads == 1])
                self.notes.append(f"several threads were not timed in {name}: the budget is too small")
        return blocks

    def _planned(self, blocks: list[Block], scales: list[float]) -> tuple[list[int], float]:
        plan = pacing.plan_rounds([(b.working_set, b.round_seconds) for b in blocks], self._seconds(), scales)
        if isinstance(plan, tuple):
            return plan
        spent = time.perf_counter() - self.started
        kernels = sum(len(group) for _, group in self.groups)
        needed = math.ceil(12 * (spent + plan / pacing.PLANNED)) / 10
        sets = ", ".join(dict.fromkeys(b.working_set for b in blocks))
        raise BudgetError(
            f"{self.budget:g} s are too short to time {kernels} kernels in {sets}: it takes about {needed:g} s",
            needed,
            "timing budget",
            "give that much, or fewer approximations or precisions, or leave timing out",
        )

    def _measured(self, blocks: list[Block], rounds: list[int]) -> list[dict[str, Any]]:
        rng = np.random.default_rng(self.seed & 0xFFFFFFFFFFFFFFFF)
        end, late = self.started + self.budget, self.started + 1.15 * self.budget
        epochs = [len(b.contenders) * r for b, r in zip(blocks, rounds, strict=True)]
        costs = [b.round_seconds * r for b, r in zip(blocks, rounds, strict=True)]
        taken: list[Readings] = []
        lying: list[set[int]] = [set() for _ in blocks]
        with closing(Witness()) as witness:
            for at, block in enumerate(blocks):
                now = time.perf_counter()
                deadline = now + (end - now) * costs[at] / max(sum(costs[at:]), 1e-9)
                taken.append(
                    clock.run_rounds(
                        partial(block.epoch, witness, lying[at]),
                        len(block.contenders),
                        rounds[at],
                        rng,
                        repeat=partial(_before, deadline),
                        go_on=partial(_goes_on, min(pacing.GOOD_ROUNDS, rounds[at]), deadline, late),
                        after_round=partial(self._tell, sum(epochs[:at]), sum(epochs), block),
                    )
                )
            self._settle(blocks, taken, lying, witness, rng, end)
        rows = [row for at, block in enumerate(blocks) for row in self._analysed(block, taken[at], lying[at])]
        return table.withheld(rows)

    def _settle(
        self,
        blocks: list[Block],
        taken: list[Readings],
        lying: list[set[int]],
        witness: Witness,
        rng: np.random.Generator,
        end: float,
    ) -> None:
        """Spend what is left of the budget on kernels whose order in time is not decided, block by block in turn."""
        open_blocks = [at for at, block in enumerate(blocks) if block.lit is None]
        while open_blocks:
            for at in list(open_blocks):
                block = blocks[at]
                members = _undecided(block, taken[at])
                needed = pacing.FURTHER_ROUNDS * block.seconds_of(members)
                if not members or len(taken[at].used) >= pacing.MOST_ROUNDS or time.perf_counter() + needed > end:
                    open_blocks.remove(at)
                    continue
                further = clock.run_rounds(
                    partial(_member, block, witness, lying[at], members),
                    len(members),
                    pacing.FURTHER_ROUNDS,
                    rng,
                    repeat=partial(_before, end),
                )
                taken[at] = taken[at].with_further(further, members)

    def _analysed(self, block: Block, readings: Readings, lying: set[int]) -> list[dict[str, Any]]:
        for i in sorted(lying):
            self.found.append(block.void(block.contenders[i], "a timed output differs from the verified one"))
        believed = {c.name for i, c in enumerate(block.contenders) if i not in lying}
        missing = {BASELINE, TWIN, *CEILINGS} - believed
        if missing:
            why = f"nothing to compare with: {', '.join(sorted(missing))} is void"
            self.found.append(MeasurementError(why, block.where, "run again; if it stays, report it"))
            return []
        rows = table.analyse(block.contenders, readings, block.elements * block.repeats)
        more: dict[str, Any] = {"working_set": block.working_set, "elements": block.elements, "repeats": block.repeats}
        wanted = None if block.lit is None else skip_kernels.names()
        if block.lit is not None:
            more["lit"] = block.lit
        return [
            {**row, **more}
            for i, row in enumerate(rows)
            if i not in lying and (wanted is None or row["approximation"] in wanted)
        ]

    def _tell(self, before: int, total: int, block: Block, rounds: int) -> None:
        if self.progress is not None:
            self.progress(before + rounds * len(block.contenders), total, block.where)


def _undecided(block: Block, readings: Readings) -> list[int]:
    """The formulas whose intervals overlap a neighbour's, with the baseline and the dot product; or none."""
    place = {c.name: i for i, c in reversed(list(enumerate(block.contenders)))}
    aside = {TWIN, *CEILINGS}
    formulas = [i for i, c in enumerate(block.contenders) if c.threads == 1 and c.name not in aside]
    intervals = [readings.ratio(i, place[BASELINE]) for i in formulas]
    unsure = {formulas[k] for k in contested(intervals)}
    return sorted(unsure | {place[BASELINE], place[DOT]}) if unsure else []


def _member(block: Block, witness: Witness, lying: set[int], members: list[int], number: int) -> clock.Epoch:
    return block.epoch(witness, lying, members[number])


def _before(deadline: float) -> bool:
    return time.perf_counter() < deadline


def _goes_on(least: int, deadline: float, late: float, done: int) -> bool:
    """Always take enough rounds for an interval, until late enough for a good one, and more while there is time."""
    return done < MIN_ROUNDS or time.perf_counter() < (late if done < least else deadline)
