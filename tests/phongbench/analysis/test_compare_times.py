"""Times of two runs: ratios of ratios, with intervals, on one machine only."""

from collections.abc import Callable
from typing import Any

import pytest

from phongbench.analysis.compare_times import compare_times
from phongbench.results.runs import Run

FIRST, SECOND = "20260101-000000-0123abcd", "20260102-000000-0123abcd"
HERE = {"provenance": {"machine_fingerprint": "this one"}}


def slower_by(factor: float) -> Callable[[Any], float]:
    """Times of runs in which lyon alone takes so many times as long."""
    return lambda row: 0.4 * factor if row.approximation == "lyon" else 1.0


@pytest.mark.parametrize(
    ("factor", "said"), [(1.0, "unresolved"), (1.5, "slower"), (0.5, "faster"), (1.01, "unresolved")]
)
def test_a_change_beyond_both_intervals_is_told(stored: Callable[..., Run], factor: float, said: str) -> None:
    found = compare_times(stored(FIRST, ratio=slower_by(1.0), **HERE), stored(SECOND, ratio=slower_by(factor), **HERE))
    assert found["why_not"] is None
    lyon = [row for row in found["rows"] if row["name"].startswith("lyon:")]
    assert lyon
    for row in lyon:
        assert row["verdict"] == said
        assert row["ratio"] == pytest.approx(factor)
        # each interval is 1 % wide to both sides
        assert row["ratio_low"] == pytest.approx(factor * 0.99 / 1.01)
        assert row["ratio_high"] == pytest.approx(factor * 1.01 / 0.99)
    others = [row for row in found["rows"] if not row["name"].startswith("lyon:")]
    assert {row["verdict"] for row in others} == {"unresolved"}


def test_what_changed_most_comes_first_and_what_did_not_change_last(stored: Callable[..., Run]) -> None:
    def changed(row: Any) -> float:
        return {"lyon": 1.5, "gaussian": 0.5}.get(row.approximation, 1.0)

    rows = compare_times(stored(FIRST, ratio=lambda row: 1.0, **HERE), stored(SECOND, ratio=changed, **HERE))["rows"]
    verdicts = [row["verdict"] for row in rows]
    assert list(dict.fromkeys(verdicts)) == ["faster", "slower", "unresolved"]  # twice as fast, then by a half slower


def test_both_ways_round_the_same_is_found(stored: Callable[..., Run]) -> None:
    runs = stored(FIRST, ratio=slower_by(1.0), **HERE), stored(SECOND, ratio=slower_by(1.5), **HERE)
    there, back = compare_times(*runs)["rows"], compare_times(*reversed(runs))["rows"]
    key = ("name", "precision", "working_set", "threads")
    theirs = {tuple(row[name] for name in key): row for row in back}
    assert len(theirs) == len(there)
    for row in there:
        other = theirs[tuple(row[name] for name in key)]
        assert row["ratio"] * other["ratio"] == pytest.approx(1)
        assert row["ratio_low"] * other["ratio_high"] == pytest.approx(1)


@pytest.mark.parametrize(
    ("first", "second", "why"),
    [
        (HERE, {"provenance": {"machine_fingerprint": "another"}}, "different machines"),
        (HERE, {"provenance": {}}, "do not say which machine"),
        (HERE, {**HERE, "timed": False}, f"{SECOND} has no times"),
    ],
)
def test_times_of_other_machines_and_of_none_are_not_compared(
    stored: Callable[..., Run], first: dict[str, Any], second: dict[str, Any], why: str
) -> None:
    found = compare_times(stored(FIRST, **first), stored(SECOND, **second))
    assert why in found["why_not"]
    assert found["rows"] == []
