"""Whether a cost depends on how many calls a program unrolls: programs of several lengths in the rounds of one run.

Times of two runs differ by more than the bar where the machine's pace changes between them, so each program is held
against that of the first count round by round.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import product

import numpy as np

from phongbench.results.schema import DOT
from phongbench.targets.code_shapes import Code
from phongbench.targets.measure import bare
from phongbench.targets.webgpu.measure import LANGUAGE
from phongbench.targets.webgpu.programs import CONTEXTS, LONGER, timed
from phongbench.targets.webgpu.rounds import Timed, Times
from phongbench.timing.statistics import Interval, ratio

#: calls of the shorter program, and how far a call's time may be from that by the first of them
COUNTS, WITHIN = (8, 4, 16), 0.05
#: what carries the calls, and is no part of a cost
CARRIER = "nothing"
#: name of what is timed -> calls -> its time over that by the first count
Unrolled = dict[str, dict[int, Interval]]


def programs(codes: Sequence[Code]) -> list[Timed]:
    """Programs of these, of the dot product and of what carries them, by every count."""
    work = {one.name: one for one in codes}
    work |= {DOT: bare(LANGUAGE, 2, dot=True), CARRIER: bare(LANGUAGE, 2, dot=False)}
    return [_timed(name, one, calls) for (name, one), calls in product(work.items(), COUNTS)]


def _timed(name: str, one: Code, calls: int) -> Timed:
    texts = (timed(one, calls, CONTEXTS[0]), timed(one, LONGER * calls, CONTEXTS[0]))
    return Timed(_label(name, calls), texts, (calls, LONGER * calls))


def _label(name: str, calls: int) -> str:
    return f"{name} by {calls}"


def compared(found: Times, *, carried: bool) -> Unrolled:
    """Times of a call over those by the first count; with what carries the call, or less that, as costs are told."""
    used = dict(zip(found.names, found.used.T, strict=True))
    names = dict.fromkeys(label.rpartition(" by ")[0] for label in found.names)

    def time(name: str, calls: int) -> np.ndarray:
        less = 0.0 if carried or name == CARRIER else used[_label(CARRIER, calls)]
        return np.asarray(used[_label(name, calls)] - less)

    return {name: {c: _ratio(time(name, c), time(name, COUNTS[0])) for c in COUNTS[1:]} for name in names}


def _ratio(one: np.ndarray, first: np.ndarray) -> Interval:
    """From the rounds in which both took time."""
    both = (one > 0) & (first > 0)  # NaN is neither
    return ratio(one[both], first[both]) if both.any() else Interval(math.nan, -math.inf, math.inf)


def moved(unrolled: Mapping[str, Mapping[int, Interval]]) -> Iterator[str]:
    """What the count moves by more than WITHIN; so is what could not be read."""
    for name, times in unrolled.items():
        for calls, one in times.items():
            if not abs(one.middle - 1) <= WITHIN:
                told = f"{one.middle:.3f} ({one.low:.3f} to {one.high:.3f})"
                yield f"{name}: a call among {calls} takes {told} of one among {COUNTS[0]}"
