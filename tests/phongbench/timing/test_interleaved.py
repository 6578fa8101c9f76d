"""Whole calls in turn: who is called when, who leaves, and that a ratio's interval means what it means everywhere."""

from collections.abc import Callable

import numpy as np
import pytest

from phongbench.timing.interleaved import Times, clocked, interleaved
from phongbench.timing.statistics import MIN_ROUNDS, ratio


def scripted(seconds: dict[str, float], heard: list[str], **options: object) -> Times[str]:
    """Calls of known durations, which note that they were called."""

    def call(name: str) -> Callable[[], float]:
        def taken() -> float:
            heard.append(name)
            return seconds[name]

        return taken

    return interleaved({name: call(name) for name in seconds}, **options)


def test_every_round_holds_every_call_once_in_orders_that_differ() -> None:
    heard: list[str] = []
    scripted({"a": 1.0, "b": 2.0, "c": 3.0, "d": 4.0}, heard)
    rounds = [heard[k : k + 4] for k in range(0, len(heard), 4)]
    assert len(rounds) == MIN_ROUNDS
    assert all(sorted(one) == ["a", "b", "c", "d"] for one in rounds)
    assert len({tuple(one) for one in rounds}) > 1
    assert {one[0] for one in rounds} == {"a", "b", "c", "d"}


def test_calls_that_warm_up_come_first_and_do_not_count() -> None:
    heard: list[str] = []
    steps: list[None] = []
    times = scripted({"a": 1.0, "b": 2.0}, heard, rounds=3, warm=2, step=lambda: steps.append(None))
    assert heard[:4] == ["a", "b", "a", "b"]
    assert len(heard) == len(steps) == 2 * (2 + 3)
    assert times.row("a", "a")["rounds"] == 3


def test_a_row_is_the_least_time_and_the_ratio_with_the_interval_of_all_timings() -> None:
    rng = np.random.default_rng(1)
    both = {"slow": rng.lognormal(1.0, 0.3, 12), "quick": rng.lognormal(0.0, 0.3, 12)}
    taken = {name: iter(values) for name, values in both.items()}
    times = interleaved({name: lambda values=values: float(next(values)) for name, values in taken.items()}, rounds=12)
    expected = ratio(both["slow"], both["quick"])
    row = times.row("slow", "quick")
    assert row == {
        "rounds": 12,
        "seconds": pytest.approx(both["slow"].min()),
        "ratio": pytest.approx(expected.middle),
        "ratio_low": pytest.approx(expected.low),
        "ratio_high": pytest.approx(expected.high),
    }
    assert times.median("quick") == pytest.approx(np.median(both["quick"]))


def test_too_few_rounds_give_a_ratio_without_an_interval() -> None:
    row = scripted({"a": 3.0, "b": 2.0}, [], rounds=MIN_ROUNDS - 1).row("a", "b")
    assert row["ratio"] == pytest.approx(1.5)
    assert row["ratio_low"] is row["ratio_high"] is None


def test_who_fails_leaves_and_the_others_go_on() -> None:
    heard: list[str] = []

    def fails() -> float:
        heard.append("fails")
        if heard.count("fails") == 3:
            raise OSError("gone")
        return 1.0

    def works() -> float:
        heard.append("works")
        return 2.0

    times = interleaved({"fails": fails, "works": works}, leaves_on=(OSError,))
    assert heard.count("fails") == 3
    assert heard.count("works") == MIN_ROUNDS
    assert str(times.failures["fails"]) == "gone"
    assert set(times.failures) == {"fails"}
    assert times.row("works", "works")["rounds"] == MIN_ROUNDS


def test_any_other_failure_ends_all_of_it() -> None:
    def fails() -> float:
        raise OSError("gone")

    with pytest.raises(OSError, match="gone"):
        interleaved({"fails": fails}, leaves_on=(ValueError,))


def test_a_clocked_call_returns_its_seconds() -> None:
    now = iter([10.0, 12.5])
    assert clocked(lambda: "its value", lambda: next(now))() == 2.5
