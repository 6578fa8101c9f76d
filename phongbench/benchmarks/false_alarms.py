"""How often does the timing tell identical code apart? The measurement of the twin, many times over."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from phongbench.compiler.lowering import FLOAT32, Precision
from phongbench.results.schema import BASELINE, LIBM, TWIN
from phongbench.timing import timed_kernels
from phongbench.timing.blocks import Block, block_bytes
from phongbench.timing.budget import GOOD_ROUNDS
from phongbench.timing.epoch_loop import tick
from phongbench.timing.interference import Witness
from phongbench.timing.machine_lock import machine_lock
from phongbench.timing.measure import check
from phongbench.timing.rounds import run_rounds
from phongbench.timing.statistics import Interval, verdict

#: the share of false alarms that the timing must stay within
ALLOWED = 0.01
#: rows left out here: they take most of a round's time, and change nothing for the twin
_SLOW = (LIBM, "integer-power-1000")


@dataclass(frozen=True)
class Alarms:
    """What repeating the measurement of identical code gave in one working set.

    resolved   repeats in which the twin was called faster or slower
    outside    repeats whose interval leaves out 1, whether or not the difference is large enough to be claimed
    spread     the middle 98 % of the repeats' ratios reach from 1 - spread to 1 + spread
    """

    working_set: str
    repeats: int
    rounds: int
    resolved: int
    outside: int
    spread: float
    seconds: float

    @property
    def share(self) -> float:
        """False alarms per repeat."""
        return self.resolved / self.repeats

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        rounded = {"spread": round(self.spread, 4), "seconds": round(self.seconds, 1), "share": self.share}
        return {**asdict(self), **rounded, "allowed": ALLOWED, "good": self.share <= ALLOWED}


def count(
    repeats: int = 200,
    *,
    working_sets: Sequence[str] = ("l1",),
    rounds: int = GOOD_ROUNDS,
    seed: int = 1,
    precision: Precision = FLOAT32,
    progress: Callable[[int, int, str], None] = lambda done, total, text: None,
) -> list[Alarms]:
    """Time exact Phong beside its twin, with what every block holds, `repeats` times over."""
    check(1.0, working_sets, (1,))
    with machine_lock():
        kernels = [k for k in timed_kernels.companions(precision) if k.name not in _SLOW]
        Block.prepare(precision, kernels)
        results = []
        for name in working_sets:
            started = time.perf_counter()
            block = Block(name, precision, list(kernels), block_bytes()[name], seed)
            ratios = list(_ratios(block, repeats, rounds, seed, progress))
            results.append(_alarms(name, ratios, rounds, time.perf_counter() - started))
    return results


def _ratios(
    block: Block, repeats: int, rounds: int, seed: int, progress: Callable[[int, int, str], None]
) -> Iterator[Interval]:
    """The twin's time over the baseline's, measured anew each time."""
    block.calibrate(tick())
    block.verify()
    names = [kernel.name for kernel in block.kernels]
    with closing(Witness()) as witness:
        for repeat in range(repeats):
            rng = np.random.default_rng([seed, repeat])
            readings = run_rounds(partial(block.epoch, witness), len(names), rounds, rng)
            yield readings.ratio(names.index(TWIN), names.index(BASELINE))
            progress(repeat + 1, repeats, block.working_set)


def _alarms(working_set: str, ratios: list[Interval], rounds: int, seconds: float) -> Alarms:
    return Alarms(
        working_set,
        len(ratios),
        rounds,
        resolved=sum(verdict(ratio) != "unresolved" for ratio in ratios),
        outside=sum(not ratio.low <= 1 <= ratio.high for ratio in ratios),
        spread=float(np.quantile(np.abs(np.log([ratio.middle for ratio in ratios])), 0.98)),
        seconds=seconds,
    )
