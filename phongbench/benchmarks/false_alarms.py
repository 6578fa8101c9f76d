"""How often does the timing tell identical code apart? The measurement of the twin, many times over."""

import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from phongbench.compiler.lowering import FLOAT32, Precision
from phongbench.results.machine import cache_sizes
from phongbench.results.schema import BASELINE, LIBM, TWIN
from phongbench.timing import budget, measure, timed_kernels
from phongbench.timing import rounds as clock
from phongbench.timing.blocks import Block, memory_sizes
from phongbench.timing.epoch_loop import tick
from phongbench.timing.interference import Witness
from phongbench.timing.machine_lock import machine_lock
from phongbench.timing.statistics import verdict

#: the share of false alarms that the timing must stay within
ALLOWED = 0.01
#: rows left out here: they take most of a round's time, and change nothing for the twin
_SLOW = (LIBM, "integer-power-1000")


@dataclass(frozen=True)
class Alarms:
    """What repeating the measurement of identical code found in one working set.

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
    rounds: int = budget.GOOD_ROUNDS,
    seed: int = 1,
    precision: Precision = FLOAT32,
    progress: Callable[[int, int, str], None] = lambda done, total, text: None,
) -> list[Alarms]:
    """Time exact Phong beside its twin, with what every block holds, `repeats` times over."""
    measure.check(1.0, working_sets, (1,))
    found = []
    with machine_lock(), closing(Witness()) as witness:
        group = [c for c in timed_kernels.companions(precision) if c.name not in _SLOW]
        place = {c.name: i for i, c in enumerate(group)}
        caches = cache_sizes()
        sizes = {"l1": caches.l1 // 2, "l2": caches.l2 // 2, "memory": memory_sizes(caches)[-1]}
        Block.prepare(precision, group[0])
        for name in working_sets:
            started = time.perf_counter()
            block = Block(name, precision, list(group), sizes[name], seed)
            block.calibrate(tick())
            block.verify([])
            ratios = []
            for repeat in range(repeats):
                rng = np.random.default_rng([seed, repeat])
                readings = clock.run_rounds(partial(block.epoch, witness, set()), len(group), rounds, rng)
                ratios.append(readings.ratio(place[TWIN], place[BASELINE]))
                progress(repeat + 1, repeats, name)
            logs = np.abs(np.log([r.middle for r in ratios]))
            found.append(
                Alarms(
                    name,
                    repeats,
                    rounds,
                    sum(verdict(r) != "unresolved" for r in ratios),
                    sum(not r.low <= 1 <= r.high for r in ratios),
                    float(np.quantile(logs, 0.98)),
                    time.perf_counter() - started,
                )
            )
    return found
