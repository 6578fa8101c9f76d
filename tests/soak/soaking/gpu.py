"""The bars of measuring on an adapter: the order of formulas, the twin, and costs that no unrolling moves."""

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from typing import Any

from soaking import unrolling

from phongbench.errors import MeasurementError
from phongbench.formulas.formula import Formula
from phongbench.results.schema import DOT
from phongbench.targets.code_shapes import Code, code
from phongbench.targets.webgpu.measure import LANGUAGE, GpuTimes, measure
from phongbench.targets.webgpu.programs import CONTEXTS
from phongbench.targets.webgpu.rounds import Timed, Times
from phongbench.targets.webgpu.session import Adapter, Session
from phongbench.timing.statistics import Interval

#: dearest first; exact Phong, which all are compared with, is before them, and the bare dot product after
ORDER = ("gaussian:dot", "lyon:dot:8")
#: what of the twins may be told apart
ALARMS = 0.01
#: seconds of the rounds of a measurement: what a study takes that asks for the adapter; of a twin's, which then has
#: about half of the rounds of a study; and of the programs of several lengths
SECONDS, TWIN_SECONDS, UNROLLED_SECONDS = 10.0, 4.0, 40.0
#: of what took no longer than its carrier by the device's clock
UNTIMED = Interval(math.nan, -math.inf, math.inf)
#: measures codes: (codes, seconds, seed)
Measure = Callable[[Sequence[Code], float, int], GpuTimes]
#: times programs: (things, seconds, seed)
Time = Callable[[Sequence[Timed], float, int], Times]


@dataclass
class Found:
    """What was seen; faults are the bars that were missed."""

    adapter: str = ""
    clock: str = ""
    ordered: int = 0
    runs: int = 0
    twins_resolved: int = 0
    twins: int = 0
    unrolled: unrolling.Unrolled = field(default_factory=dict)
    unrolled_cost: unrolling.Unrolled = field(default_factory=dict)
    ratios: list[dict[str, tuple[float, float, float]]] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def soak(runs: int, twins: int, taken: Measure, timed: Time, step: Callable[[int], None] = lambda done: None) -> Found:
    """Hold measurements against the bars: so many runs of the order, so many twins; the unrolling once."""
    found = Found()
    codes = [code(Formula.parse(name), 50.0, LANGUAGE) for name in ORDER]
    for seed in range(runs):
        if times := told(found, taken, codes, SECONDS, seed):
            found.adapter, found.clock = times.adapter.title, times.clock
            ordered(found, times, [one.name for one in codes])
        step(1)
    for seed in range(twins):
        if times := told(found, taken, [], TWIN_SECONDS, 1000 + seed):
            found.twins += 1
            found.twins_resolved += times.twin != "unresolved"
        step(1)
    if found.twins_resolved > ALARMS * found.twins:
        found.faults.append(f"{found.twins_resolved} of {found.twins} twins were told apart")
    unroll(found, timed, [code(Formula(), 50.0, LANGUAGE), *codes])
    step(1)
    return found


def told(found: Found, taken: Measure, codes: Sequence[Code], seconds: float, seed: int) -> GpuTimes | None:
    """The times; None, and a fault, where the device gives none: an hour's findings are not lost for one failure."""
    try:
        return taken(codes, seconds, seed)
    except MeasurementError as failure:
        found.faults.append(f"seed {seed}: {failure}")
        return None


def unroll(found: Found, timed: Time, codes: Sequence[Code]) -> None:
    """Whether costs depend on how many calls a program has; times of whole calls, carrier included, are told beside."""
    try:
        times = timed(unrolling.programs(codes), UNROLLED_SECONDS, 1)
    except MeasurementError as failure:
        found.faults.append(f"unrolled: {failure}")
        return
    found.unrolled, found.unrolled_cost = (unrolling.compared(times, carried=carried) for carried in (True, False))
    found.faults += [*unrolling.moved(found.unrolled_cost)]


def ordered(found: Found, times: GpuTimes, names: Sequence[str]) -> None:
    """Whether exact Phong, these and the dot product cost ever less, their intervals apart."""
    rows = {name: times.rows.get((name, CONTEXTS[0])) for name in ("phong", *names, DOT)}
    each = {name: UNTIMED if row is None else row.ratio for name, row in rows.items()}
    found.ratios.append({name: (ratio.low, ratio.middle, ratio.high) for name, ratio in each.items()})
    dear = list(each.values())
    found.runs += 1
    if all(one.low > other.high for one, other in pairwise(dear)):
        found.ordered += 1
    else:
        found.faults.append(f"run {found.runs}: the intervals do not lie in the order {', '.join(each)}")


def here(session: Session, adapter: Adapter) -> tuple[Measure, Time]:
    """Measuring, and timing programs, on the adapter that is here."""

    def taken(codes: Sequence[Code], seconds: float, seed: int) -> GpuTimes:
        return measure(session, adapter, codes, seconds=seconds, seed=seed)

    def timed(things: Sequence[Timed], seconds: float, seed: int) -> Times:
        times: Times = session.ask("timed", things=things, seconds=seconds, seed=seed)
        return times

    return taken, timed
