"""What formulas cost on the adapter of this machine: times of whole highlights, beside exact Phong and its twin.

Each formula is a pair of programs (`programs.timed`), clocked in shuffled rounds with all others. What the vectors'
changing and the sum take is timed as well, in a program without a formula, and is no part of a cost: so costs add up as
those of compiled targets do.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from phongbench.errors import MeasurementError
from phongbench.formulas.formula import Formula
from phongbench.results.schema import BASELINE, COPY, DOT, TWIN
from phongbench.targets.code_shapes import Code, code
from phongbench.targets.measure import bare
from phongbench.targets.webgpu import programs
from phongbench.targets.webgpu.programs import CONTEXTS, LONGER, Context
from phongbench.targets.webgpu.rounds import Timed, Times
from phongbench.targets.webgpu.session import Adapter, Session
from phongbench.timing.rounds import Readings
from phongbench.timing.statistics import Interval, ratio, verdict

LANGUAGE = "wgsl"
#: bytes that the copy moves: more than the caches of most GPUs hold
COPIED = 1 << 26
#: nanoseconds of a formula that takes no longer than what carries it: it counts as next to nothing
NO_TIME = 1e-6
#: of what has no round in common with what it is compared with
UNTOLD = Interval(math.nan, -math.inf, math.inf)
_ALPHA = 50.0
_NOTHING = "nothing"


class Measured(NamedTuple):
    """The time of one highlight.

    ns       of the whole highlight, dot product included: the ratio times exact Phong's median
    ratio    to exact Phong in the same context
    verdict  faster, slower or unresolved
    over_dot ratio to the bare dot product
    """

    ns: float
    ratio: Interval
    verdict: str
    over_dot: float


@dataclass(frozen=True)
class GpuTimes:
    """What an adapter takes.

    clock    timestamps, or wall time and why
    rounds   that were taken
    rows     (name, context) -> its time; formulas by the name of their code, beside DOT, TWIN and COPY
    refused  name of a code -> what the device says of it
    """

    adapter: Adapter
    clock: str
    rounds: int
    rows: Mapping[tuple[str, Context], Measured]
    refused: Mapping[str, str]

    @property
    def tool(self) -> str:
        """What measured, on what, by which clock."""
        return f"WebGPU on {self.adapter.title}; {self.clock}"

    @property
    def tool_version(self) -> str:
        """Of wgpu and the driver."""
        return f"wgpu {self.adapter.version}, {self.adapter.driver}, {self.adapter.backend}"

    @property
    def twin(self) -> str:
        """The verdict on exact Phong timed again under another name; unresolved too where it has no time."""
        timed = self.rows.get((TWIN, CONTEXTS[0]))
        return "unresolved" if timed is None else timed.verdict


def measure(
    session: Session,
    adapter: Adapter,
    codes: Sequence[Code],
    around: Sequence[Code] = (),
    *,
    seconds: float,
    seed: int = 1,
) -> GpuTimes:
    """Time codes, written in LANGUAGE, and exact Phong, on the device.

    around   of the codes, those that are timed inside other work too: in every context
    seconds  that the rounds may take
    Raises MeasurementError where the device fails, or too little of its times can be used.
    """
    work = _work(codes, around)
    things = [_thing(key, one) for key, one in work.items()]
    things.append(Timed(COPY, (programs.copying(),) * 2, (1, LONGER), COPIED))
    found: Times = session.ask("timed", things=things, seconds=seconds, seed=seed)
    keys: dict[str, _Key] = {_label(*key): key for key in work} | {COPY: (COPY, CONTEXTS[0], 0)}
    clock = found.clock if found.fault is None else f"{found.clock}, since {found.fault}"
    refused = {keys[name][0]: why for name, why in found.refused.items()}
    rows = _compared(found, [keys[name] for name in found.names])
    return GpuTimes(adapter, clock, len(found.used), rows, refused)


#: name of a code, context, and how many directions its carrier moves
_Key = tuple[str, Context, int]


def _work(codes: Sequence[Code], around: Sequence[Code]) -> dict[_Key, Code]:
    """All that is timed: references first, of which exact Phong is one, then the codes, each in its contexts."""
    phong = code(Formula(), _ALPHA, LANGUAGE)
    work: dict[_Key, Code] = {(BASELINE, CONTEXTS[0], 2): phong, (TWIN, CONTEXTS[0], 2): phong}
    for place, context in enumerate(CONTEXTS if around else CONTEXTS[:1]):
        work[BASELINE, context, 2] = phong
        work[DOT, context, 2] = bare(LANGUAGE, 2, dot=True)
        for one in codes if place == 0 else around:
            work[one.name, context, one.vectors] = one
    for vectors, context in {(key[2], key[1]) for key in work}:
        work[_NOTHING, context, vectors] = bare(LANGUAGE, vectors, dot=False)
    return work


def _label(name: str, context: Context, vectors: int) -> str:
    return f"{name}, {context.multiply_adds} around, {context.reads} read, of {vectors}"


def _thing(key: _Key, one: Code) -> Timed:
    few = key[1].calls(one)
    texts = (programs.timed(one, few, key[1]), programs.timed(one, LONGER * few, key[1]))
    return Timed(_label(*key), texts, (few, LONGER * few))


def _compared(found: Times, keys: Sequence[_Key]) -> dict[tuple[str, Context], Measured]:
    """Every time beside exact Phong's and the dot product's in the same context, less what carries them."""
    place = {key: i for i, key in enumerate(keys)}
    needed = {(name, context, 2) for _, context, _ in keys for name in (BASELINE, DOT)}
    if not needed <= place.keys():
        why = next(iter(found.refused.values()), "it says nothing")
        raise MeasurementError(f"the device refuses what formulas are compared with: {why}", "gpu", "update the driver")
    used = found.used.copy()
    for (name, context, vectors), i in place.items():
        carrier = place.get((_NOTHING, context, vectors))
        if name not in (_NOTHING, COPY) and carrier is not None:
            used[:, i] -= found.used[:, carrier]
    # Without the rounds in which a formula seems to take no time, those that are left would make it too dear.
    used = np.maximum(used, NO_TIME)
    readings = Readings(used, np.isfinite(used), np.array(found.marked, np.int64))
    if not _takes_time(readings, place[BASELINE, CONTEXTS[0], 2]):
        what = "exact Phong takes no longer than nothing by the clock of this device"
        raise MeasurementError(what, "gpu", "let nothing else run, and try again; the others go on")
    rows: dict[tuple[str, Context], Measured] = {}
    for (name, context, _), i in place.items():
        exact, dot = place[BASELINE, context, 2], place[DOT, context, 2]
        if name != _NOTHING and _takes_time(readings, i) and _takes_time(readings, exact):
            over_exact = _ratio(readings, i, exact)
            ns = over_exact.middle * readings.median(exact)
            rows[name, context] = Measured(ns, over_exact, verdict(over_exact), _ratio(readings, i, dot).middle)
    return rows


def _takes_time(readings: Readings, one: int) -> bool:
    return readings.rounds(one) > 0 and readings.median(one) > NO_TIME


def _ratio(readings: Readings, one: int, other: int) -> Interval:
    """From the rounds in which the other took time: nothing can be held against none."""
    both = np.isfinite(readings.used[:, one]) & (readings.used[:, other] > NO_TIME)
    return ratio(readings.used[both, one], readings.used[both, other]) if both.any() else UNTOLD
