"""Clocks that lie are not believed, and costs come out of whichever clock is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import pytest

from phongbench.targets.webgpu import clock, rounds
from phongbench.targets.webgpu.clock import Passes, fault
from phongbench.targets.webgpu.rounds import Timed

#: a device's stamps of a pass: (when it begins, ns that it takes) -> (begin, end)
Stamps = Callable[[int, int], tuple[int, int]]
THREADS, CALLS = 1000, (8, 32)


def honest(begin: int, lasts: int) -> tuple[int, int]:
    return begin, begin + lasts


LIARS: dict[str, Stamps] = {
    "run backwards": lambda begin, lasts: (begin + lasts, begin),
    "stand still": lambda begin, lasts: (7, 7),
    "stand still between": lambda begin, lasts: (7, 7 + lasts),
    "no longer": lambda begin, lasts: (begin, begin + 1000),
    "a nanosecond of the wall": lambda begin, lasts: (begin // 83, (begin + lasts) // 83),
}


@dataclass
class Device:
    """Programs of which each call takes so many nanoseconds a thread, and each pass some more for itself."""

    ns: float
    stamps: Stamps | None = honest
    now: int = 1 << 40
    overhead: int = 40_000
    noise: np.random.Generator = field(default_factory=partial(np.random.default_rng, 5))

    def run(self, repeats: int, places: Sequence[int]) -> Passes:
        lasted, stamps = 0, []
        for place in places:
            lasts = int(self.ns * THREADS * repeats * CALLS[place] * (1 + 1e-3 * self.noise.random())) + 3000
            stamps.append(self.stamps(self.now + lasted, lasts) if self.stamps else None)
            lasted += lasts
        self.now += lasted + self.overhead
        return Passes(tuple(one for one in stamps if one), lasted + self.overhead)


def times(stamps: Stamps | None) -> rounds.Times:
    pairs = [(Timed(name, ("", ""), CALLS), Device(ns, stamps)) for name, ns in (("slow", 0.4), ("fast", 0.1))]
    return rounds.measure(pairs, THREADS, clocks=stamps is not None, seconds=0.0, seed=1)


CLOCKS = {"honest": (honest, True), **{words: (liar, False) for words, liar in LIARS.items()}, "none": (None, False)}


@pytest.mark.parametrize(("stamps", "believed"), CLOCKS.values(), ids=CLOCKS)
def test_costs_come_out_of_the_clock_that_is_believed(stamps: Stamps | None, believed: bool) -> None:
    found = times(stamps)
    assert found.clock == (clock.TIMESTAMPS if believed else clock.WALL)
    assert (found.fault is None) == believed
    assert found.used.shape == (rounds.MIN_ROUNDS, 2)
    assert np.median(found.used, axis=0) == pytest.approx([0.4, 0.1], rel=2e-3)
    ratio = found.readings.ratio(1, 0)
    assert ratio.low <= ratio.middle <= ratio.high
    assert ratio.middle == pytest.approx(0.25, rel=4e-3)


@pytest.mark.parametrize("words", LIARS)
def test_each_lie_is_named(words: str) -> None:
    assert words in str(times(LIARS[words]).fault)


def test_a_device_without_timestamps_has_a_fault_of_its_own() -> None:
    one = Passes((), 1000)
    assert "has no timestamps" in str(fault([one], [one]))
    assert "has no timestamps" in str(times(None).fault)


def test_passes_are_long_enough_for_their_clock() -> None:
    for stamps, least in ((honest, rounds.LEAST_NS), (None, rounds.LEAST_WALL_NS)):
        device = Device(0.1, stamps)
        repeats = rounds._Reader(stamps is not None).repeats(device)
        assert 0.1 * THREADS * CALLS[0] * repeats >= 0.95 * least - device.overhead


def test_a_longer_program_that_takes_no_longer_has_no_cost() -> None:
    found = rounds.measure([(Timed("none", ("", ""), CALLS), Device(0.0))], THREADS, clocks=True, seconds=0.0, seed=1)
    assert not np.isfinite(found.used).any() or (found.used[np.isfinite(found.used)] > 0).all()
    assert found.marked[0] >= 0


def test_noise_that_only_adds_is_left_out_by_the_least_of_several_readings() -> None:
    class Disturbed(Device):
        def run(self, repeats: int, places: Sequence[int]) -> Passes:
            passes = super().run(repeats, places)
            late = int(self.noise.integers(len(places)))
            stamps = [(b, e + 5_000_000 * (i == late)) for i, (b, e) in enumerate(passes.stamps)]
            return Passes(tuple(stamps), passes.wall)

    device = Disturbed(0.4)
    more = rounds._Reader(True).more(device, 1000)
    assert more / ((CALLS[1] - CALLS[0]) * THREADS * 1000) == pytest.approx(0.4, rel=5e-3)


def test_a_copy_has_its_share_of_the_rounds_and_no_more() -> None:
    copy = Timed("copy", ("", ""), (1, 4), THREADS * rounds.MOVED)
    pairs = [(Timed("slow", ("", ""), CALLS), Device(0.4)), (copy, Device(5.0))]
    found = rounds.measure(pairs, THREADS, clocks=True, seconds=60.0, seed=1)
    assert len(found.used) == rounds.MOST_ROUNDS
    assert np.isfinite(found.used).sum(axis=0).tolist() == [rounds.MOST_ROUNDS, rounds.COPIES]
