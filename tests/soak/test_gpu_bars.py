"""The judge of an adapter's bars sees each that is missed; `python -m soaking gpu` asks the adapter itself."""

from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from soaking import unrolling
from soaking.gpu import ORDER, Measure, Time, soak

from phongbench.errors import MeasurementError
from phongbench.results.schema import DOT, TWIN
from phongbench.targets.code_shapes import Code
from phongbench.targets.webgpu.measure import GpuTimes, Measured
from phongbench.targets.webgpu.programs import CONTEXTS
from phongbench.targets.webgpu.rounds import Timed, Times
from phongbench.targets.webgpu.session import Adapter
from phongbench.timing.statistics import Interval

NS = {"phong": 0.4, f"{ORDER[0]} 50": 0.2, f"{ORDER[1]} 50": 0.13, DOT: 0.1}
ADAPTER = Adapter("made up", "1", "Vulkan", False, (), "1")
#: nanoseconds of what carries a call
CARRIED = 0.2
ROUNDS = 12


def device(ns: Mapping[str, float] = NS, spread: float = 0.05, alarms: int = 0) -> Measure:
    """A device that takes so long, with intervals so wide, and tells some twins apart."""
    told = iter([*["faster"] * alarms, *["unresolved"] * 10_000])

    def taken(codes: Sequence[Code], seconds: float, seed: int) -> GpuTimes:
        rows = {}
        for name, cost in ns.items():
            ratio = cost / ns["phong"]
            wide = spread if name != "phong" else 0.0
            interval = Interval(ratio, ratio * (1 - wide), ratio * (1 + wide))
            rows[name, CONTEXTS[0]] = Measured(cost, interval, "faster", cost / ns.get(DOT, 0.1))
        verdict = next(told) if not codes else "unresolved"
        rows[TWIN, CONTEXTS[0]] = Measured(0.4, Interval(1, 1, 1), verdict, 4)
        return GpuTimes(ADAPTER, "timestamps", 24, rows, {})

    return taken


def clock(by_calls: float = 0.0) -> Time:
    """A device whose pace changes from round to round, and whose calls cost more among more of them."""

    def timed(things: Sequence[Timed], seconds: float, seed: int) -> Times:
        pace = np.random.default_rng(seed).uniform(1, 3, size=ROUNDS)
        calls = np.array([one.calls[0] for one in things])
        carrier = np.array([one.name.startswith(unrolling.CARRIER) for one in things])
        costs = CARRIED + np.where(carrier, 0.0, 0.3 * (1 + by_calls * (calls - unrolling.COUNTS[0])))
        used = pace[:, None] * costs
        return Times(tuple(one.name for one in things), used, (0,) * len(things), "timestamps", None, {})

    return timed


def test_a_device_within_the_bars_has_no_fault() -> None:
    found = soak(10, 100, device(alarms=1), clock())
    assert found.faults == []
    assert (found.ordered, found.runs, found.twins_resolved, found.twins) == (10, 10, 1, 100)
    assert len(found.unrolled) == len(found.unrolled_cost) == len(ORDER) + 3  # exact Phong, dot product, carrier


def test_each_bar_that_is_missed_is_a_fault() -> None:
    assert len(soak(3, 1, device(spread=0.2), clock()).faults) == 3
    assert len(soak(3, 1, device({**NS, DOT: 0.15}), clock()).faults) == 3
    assert soak(1, 100, device(alarms=2), clock()).faults == ["2 of 100 twins were told apart"]


def test_a_pace_that_changes_moves_no_cost_and_calls_that_cost_more_among_more_do() -> None:
    assert soak(1, 1, device(), clock(by_calls=0.005)).faults == []
    found = soak(1, 1, device(), clock(by_calls=0.02))
    assert len(found.faults) == 2 * (len(ORDER) + 2)  # never the carrier
    for name in (ORDER[0], DOT):
        whole, cost = (
            next(v for k, v in u.items() if k.startswith(name)) for u in (found.unrolled, found.unrolled_cost)
        )
        assert cost[16].middle == pytest.approx(1 + 0.02 * 8)
        assert whole[16].middle == pytest.approx((CARRIED + 0.3 * (1 + 0.02 * 8)) / (CARRIED + 0.3))


def test_what_a_device_does_not_tell_is_a_fault_and_the_rest_is_kept() -> None:
    untold = soak(1, 1, device({name: cost for name, cost in NS.items() if name != DOT}), clock())
    assert [fault.partition(":")[0] for fault in untold.faults] == ["run 1"]

    def failing(things: Sequence[Timed], seconds: float, seed: int) -> Times:
        raise MeasurementError("the device is lost", "gpu", "try again")

    found = soak(2, 2, device(), failing)
    assert (found.ordered, found.twins) == (2, 2)
    assert len(found.faults) == 1
    assert "the device is lost" in found.faults[0]

    def silent(things: Sequence[Timed], seconds: float, seed: int) -> Times:
        times = clock()(things, seconds, seed)
        times.used[:, [one.name == f"{DOT} by 4" for one in things]] = np.nan
        return times

    assert [fault.partition(":")[0] for fault in soak(1, 1, device(), silent).faults] == [DOT]
