"""The bars of measuring on an adapter: the order of formulas, the twin, and costs that no unrolling moves."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from typing import Any

from phongbench.formulas.formula import Formula
from phongbench.results.schema import DOT
from phongbench.targets.code_shapes import Code, code
from phongbench.targets.webgpu.measure import LANGUAGE, GpuTimes, measure
from phongbench.targets.webgpu.programs import CONTEXTS
from phongbench.targets.webgpu.session import Adapter, Session

#: dearest first; exact Phong, which all are compared with, is before them, and the bare dot product after
ORDER = ("gaussian:dot", "lyon:dot:8")
#: calls of the shorter program, and how far costs may be from those of the first
UNROLLED, WITHIN = (8, 4, 16), 0.05
#: what of the twins may be told apart
ALARMS = 0.01
SECONDS = 4.0
#: measures codes: (codes, seconds, seed, calls)
Measure = Callable[[Sequence[Code], float, int, int | None], GpuTimes]


@dataclass
class Found:
    """What was seen; faults are the bars that were missed."""

    adapter: str = ""
    clock: str = ""
    ordered: int = 0
    runs: int = 0
    twins_resolved: int = 0
    twins: int = 0
    unrolled: dict[str, dict[int, float]] = field(default_factory=dict)
    ratios: list[dict[str, tuple[float, float, float]]] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def soak(runs: int, twins: int, taken: Measure, step: Callable[[int], None] = lambda done: None) -> Found:
    """Hold measurements against the bars: so many runs of the order, so many twins; the unrolling once."""
    found = Found()
    codes = [code(Formula.parse(name), 50.0, LANGUAGE) for name in ORDER]
    for seed in range(runs):
        times = taken(codes, SECONDS, seed, None)
        found.adapter, found.clock = times.adapter.title, times.clock
        ordered(found, times, [one.name for one in codes])
        step(1)
    for seed in range(twins):
        found.twins += 1
        found.twins_resolved += taken([], 0.0, 1000 + seed, None).twin != "unresolved"
        step(1)
    if found.twins_resolved > ALARMS * found.twins:
        found.faults.append(f"{found.twins_resolved} of {found.twins} twins were told apart")
    for calls in UNROLLED:
        times = taken(codes, SECONDS, 1, calls)
        for name in ("phong", DOT, *(one.name for one in codes)):
            found.unrolled.setdefault(name, {})[calls] = times.rows[name, CONTEXTS[0]].ns
        step(1)
    found.faults += moved(found.unrolled)
    return found


def ordered(found: Found, times: GpuTimes, names: Sequence[str]) -> None:
    """Whether exact Phong, these and the dot product cost ever less, their intervals apart."""
    each = {name: times.rows[name, CONTEXTS[0]].ratio for name in ("phong", *names, DOT)}
    found.ratios.append({name: (ratio.low, ratio.middle, ratio.high) for name, ratio in each.items()})
    dear = list(each.values())
    found.runs += 1
    if all(one.low > other.high for one, other in pairwise(dear)):
        found.ordered += 1
    else:
        found.faults.append(f"run {found.runs}: the intervals do not lie in the order {', '.join(each)}")


def moved(unrolled: dict[str, dict[int, float]]) -> Iterable[str]:
    """Costs that the unrolling moves by more than WITHIN."""
    for name, costs in unrolled.items():
        first = costs[UNROLLED[0]]
        for calls, cost in costs.items():
            if abs(cost / first - 1) > WITHIN:
                yield f"{name}: {cost:.4g} ns by {calls} calls, {first:.4g} by {UNROLLED[0]}"


def here(session: Session, adapter: Adapter) -> Measure:
    """Measuring on the adapter that is here."""

    def taken(codes: Sequence[Code], seconds: float, seed: int, calls: int | None) -> GpuTimes:
        return measure(session, adapter, codes, seconds=seconds, seed=seed, calls=calls)

    return taken
