"""The judge of an adapter's bars sees each that is missed; `python -m soaking gpu` asks the adapter itself."""

from collections.abc import Sequence

from soaking.gpu import ORDER, UNROLLED, Measure, soak

from phongbench.errors import MeasurementError
from phongbench.results.schema import DOT, TWIN
from phongbench.targets.code_shapes import Code
from phongbench.targets.webgpu.measure import GpuTimes, Measured
from phongbench.targets.webgpu.programs import CONTEXTS
from phongbench.targets.webgpu.session import Adapter
from phongbench.timing.statistics import Interval

NS = {"phong": 0.4, f"{ORDER[0]} 50": 0.2, f"{ORDER[1]} 50": 0.13, DOT: 0.1}
ADAPTER = Adapter("made up", "1", "Vulkan", False, (), "1")


def device(ns: dict[str, float] = NS, spread: float = 0.05, alarms: int = 0, by_calls: float = 0.0) -> Measure:
    """A device that takes so long, with intervals so wide, that tells some twins apart, or depends on the calls."""
    told = iter([*["faster"] * alarms, *["unresolved"] * 10_000])

    def taken(codes: Sequence[Code], seconds: float, seed: int, calls: int | None) -> GpuTimes:
        rows = {}
        for name, cost in ns.items():
            ratio = cost / ns["phong"]
            wide = spread if name != "phong" else 0.0
            interval = Interval(ratio, ratio * (1 - wide), ratio * (1 + wide))
            here = cost * (1 + by_calls * ((calls or UNROLLED[0]) - UNROLLED[0]))
            rows[name, CONTEXTS[0]] = Measured(here, interval, "faster", cost / ns.get(DOT, 0.1))
        verdict = next(told) if not codes else "unresolved"
        rows[TWIN, CONTEXTS[0]] = Measured(0.4, Interval(1, 1, 1), verdict, 4)
        return GpuTimes(ADAPTER, "timestamps", 24, rows, {})

    return taken


def test_a_device_within_the_bars_has_no_fault() -> None:
    found = soak(10, 100, device(alarms=1))
    assert found.faults == []
    assert (found.ordered, found.runs, found.twins_resolved, found.twins) == (10, 10, 1, 100)
    assert set(found.unrolled) == set(NS)


def test_each_bar_that_is_missed_is_a_fault() -> None:
    assert len(soak(3, 1, device(spread=0.2)).faults) == 3
    assert len(soak(3, 1, device({**NS, DOT: 0.15})).faults) == 3
    assert soak(1, 100, device(alarms=2)).faults == ["2 of 100 twins were told apart"]
    assert len(soak(1, 1, device(by_calls=0.02)).faults) == 2 * len(NS)


def test_what_a_device_does_not_tell_is_a_fault_and_the_rest_is_kept() -> None:
    untold = soak(1, 1, device({name: cost for name, cost in NS.items() if name != DOT}))
    assert [fault.partition(":")[0] for fault in untold.faults] == ["run 1", *[DOT] * len(UNROLLED)]

    def failing(codes: Sequence[Code], seconds: float, seed: int, calls: int | None) -> GpuTimes:
        if calls == UNROLLED[1]:
            raise MeasurementError("the device is lost", "gpu", "try again")
        return device()(codes, seconds, seed, calls)

    found = soak(2, 2, failing)
    assert (found.ordered, found.twins) == (2, 2)
    assert len(found.faults) == 1
    assert "the device is lost" in found.faults[0]
