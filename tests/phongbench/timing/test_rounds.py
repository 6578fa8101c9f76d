"""Believable timing is arithmetic, tested on made-up clocks: orders, calibration, intervals, verdicts, evidence."""

import math
from collections.abc import Iterator
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest

from phongbench.errors import MeasurementError
from phongbench.timing import rounds, statistics
from phongbench.timing.interference import Evidence, Witness, disturbed
from phongbench.timing.rounds import Epoch
from phongbench.timing.statistics import LEVEL, MIN_ROUNDS, Interval, contested, ratio, sign_interval, sign_test_rank


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


# orders


@pytest.mark.parametrize("size", range(1, 12))
def test_a_latin_square_has_every_kernel_once_in_each_row_and_column(size: int) -> None:
    square = rounds.latin_square(size, rng(size))
    everyone = list(range(size))
    assert all(sorted(row) == everyone for row in square.tolist())
    assert all(sorted(column) == everyone for column in square.T.tolist())


@pytest.mark.parametrize(("size", "most"), [(2, 1), (4, 1), (10, 1), (5, 2), (9, 2)])
def test_no_kernel_follows_another_too_often(size: int, most: int) -> None:
    follows = [pair for row in rounds.latin_square(size, rng()).tolist() for pair in pairwise(row)]
    assert max(follows.count(pair) for pair in follows) == most


def test_every_block_is_shuffled_afresh_and_a_seed_gives_the_same_orders() -> None:
    first, again, other = (list(rounds.orders(6, 15, rng(seed))) for seed in (1, 1, 2))
    assert [row.tolist() for row in first] == [row.tolist() for row in again] != [row.tolist() for row in other]
    assert len(first) == 15
    assert [row.tolist() for row in first[:6]] != [row.tolist() for row in first[6:12]]


# calibration


def test_calibration_accepts_two_readings_that_agree() -> None:
    readings = iter([100.0, 50.0, 52.0, 10.0])
    assert rounds.agreed(lambda: next(readings)) == 50.0
    assert next(readings) == 10.0


def test_readings_a_tenth_apart_agree() -> None:
    readings = iter([100.0, 110.0, 10.0, 10.0])
    assert rounds.agreed(lambda: next(readings)) == 100.0


def test_a_clock_that_never_agrees_gives_its_smallest_reading() -> None:
    readings = iter([100.0, 10.0, 90.0, 9.0, 80.0, 8.0, 70.0, 7.0])
    assert rounds.agreed(lambda: next(readings)) == 7.0


@pytest.mark.parametrize(
    ("nanoseconds", "tick", "repeats"), [(100, 1, 1000), (100, 500, 5000), (3e6, 1, 1), (0, 1, 10**8)]
)
def test_an_epoch_is_long_enough_in_time_and_in_ticks(nanoseconds: float, tick: float, repeats: int) -> None:
    assert rounds.repeats_for(nanoseconds, tick) == repeats


def test_the_tick_is_the_smallest_step() -> None:
    assert rounds.tick(np.array([0, 0, 40, 40, 60, 1000])) == 20
    with pytest.raises(MeasurementError, match="does not advance"):
        rounds.tick(np.zeros(5, np.int64))


# statistics


def coverage(count: int, rank: int) -> float:
    """How often the median lies between those order statistics, counted over all signs that `count` values can have."""
    inside = [rank <= sum(signs) <= count - rank for signs in product((0, 1), repeat=count)]
    return float(np.mean(inside))


@pytest.mark.parametrize("count", range(1, 15))
def test_the_sign_test_is_exact(count: int) -> None:
    rank = sign_test_rank(count)
    assert rank == 0 or coverage(count, rank) >= LEVEL
    assert coverage(count, rank + 1) < LEVEL or rank + 1 > count / 2


@pytest.mark.parametrize(("count", "rank"), [(7, 0), (8, 1), (12, 2), (24, 6), (50, 16)])
def test_the_sign_test_agrees_with_printed_tables(count: int, rank: int) -> None:
    assert sign_test_rank(count) == rank
    assert (rank > 0) == (count >= MIN_ROUNDS)


def test_an_interval_holds_the_median_and_is_unbounded_for_few_values() -> None:
    found = sign_interval(np.arange(24.0)[::-1])
    assert found == Interval(11.5, 5.0, 18.0)
    assert sign_interval(np.arange(7.0)) == Interval(3.0, -math.inf, math.inf)


def test_a_ratio_is_paired_by_round() -> None:
    times = rng().lognormal(sigma=1.0, size=30)  # rounds differ wildly, quotients do not
    found = ratio(1.5 * times, times)
    assert found.low == pytest.approx(1.5)
    assert found.high == pytest.approx(1.5)
    assert ratio(times[:5], times[:5]) == Interval(1.0, 0.0, math.inf)


def test_the_columns_of_a_ratio_have_no_ends_where_there_is_no_interval() -> None:
    times = np.ones(MIN_ROUNDS)
    assert ratio(times, times).columns() == {"ratio": 1.0, "ratio_low": 1.0, "ratio_high": 1.0}
    assert ratio(times[1:], times[1:]).columns() == {"ratio": 1.0, "ratio_low": None, "ratio_high": None}
    assert statistics.LEVEL_TEXT == "99 %"


def test_the_interval_covers_as_promised() -> None:
    generator, misses = rng(5), 0
    for _ in range(1000):
        found = ratio(generator.lognormal(sigma=0.1, size=24), np.ones(24))
        misses += not found.low <= 1 <= found.high
    assert misses <= 20  # 1 % expected; 20 or more would come once in some hundred seeds


@pytest.mark.parametrize(
    ("interval", "verdict"),
    [
        (Interval(0.9, 0.89, 0.91), "faster"),
        (Interval(1.1, 1.09, 1.11), "slower"),
        (Interval(0.9, 0.8, 1.01), "unresolved"),
        (Interval(1.0, 1.0, 1.0), "unresolved"),
        (Interval(0.99, 0.985, 0.995), "unresolved"),
        (Interval(1.015, 1.01, 1.019), "unresolved"),
        (Interval(0.5, 0.0, math.inf), "unresolved"),
        (Interval(0.98, 0.97, 0.99), "faster"),
        (Interval(1.02, 1.01, 1.03), "slower"),
        (Interval(0.9, 0.8, 1.0), "unresolved"),
        (Interval(1.1, 1.0, 1.2), "unresolved"),
    ],
)
def test_a_verdict_needs_a_resolved_difference_worth_claiming(interval: Interval, verdict: str) -> None:
    assert statistics.verdict(interval) == verdict


# evidence


@pytest.mark.parametrize(
    ("after", "marked"),
    [
        (Evidence(3, 7, 1200.0), False),
        (Evidence(3, 7, 1250.0), False),
        (Evidence(4, 7, 1000.0), True),
        (Evidence(3, 8, 1000.0), True),
        (Evidence(3, 7, 1300.0), True),
    ],
)
def test_only_evidence_marks_an_epoch(after: Evidence, marked: bool) -> None:
    assert disturbed(Evidence(3, 7, 0.0), after, usual_spin=1000.0) is marked


def test_the_witness_reads_stolen_time(tmp_path: Path) -> None:
    stat = tmp_path / "stat"
    stat.write_text("cpu  1 2 3 4 5 6 7 42 9 10\ncpu0 1 2 3 4 5 6 7 8 9 10\n")
    witness = Witness(stat)
    assert witness.see(5.0).stolen == 42
    assert witness.see(5.0).spin == 5.0
    witness.close()
    assert witness.see(0.0).stolen == 0


def test_a_system_without_counters_has_no_evidence(tmp_path: Path) -> None:
    assert Witness(tmp_path / "absent").see(1.0).stolen == 0
    (tmp_path / "old").write_text("cpu  1 2 3 4 5 6 7\n")
    witness = Witness(tmp_path / "old")
    assert witness.see(1.0).stolen == 0
    witness.close()


# rounds


def scripted(readings: dict[int, Iterator[Epoch]]) -> rounds.Readings:
    return rounds.run_rounds(lambda kernel: next(readings[kernel]), len(readings), 3, rng())


def test_a_disturbed_epoch_is_repeated_once_and_both_are_counted() -> None:
    quiet, noisy = Epoch(10.0, False), Epoch(99.0, True)
    last = iter([noisy, quiet, quiet, noisy, noisy])
    found = scripted({0: iter([quiet] * 3), 1: last})
    assert found.used.tolist() == [[10, 10], [10, 10], [10, 99]]
    assert found.clean.tolist() == [[True, True], [True, True], [True, False]]
    assert found.marked.tolist() == [0, 3]
    assert next(last, None) is None
    assert found.least(1) == found.median(1) == 10.0


def test_a_slow_epoch_without_evidence_stays() -> None:
    found = scripted({0: iter([Epoch(t, False) for t in (10.0, 500.0, 12.0)])})
    assert found.used[:, 0].tolist() == [10, 500, 12]
    assert (found.least(0), found.median(0), found.marked[0]) == (10, 12, 0)


def test_where_nothing_is_undisturbed_everything_counts() -> None:
    found = scripted({0: iter([Epoch(float(t), True) for t in range(1, 7)])})
    assert found.used[:, 0].tolist() == [2, 4, 6]
    assert (found.least(0), found.median(0), found.marked[0]) == (2, 4, 6)


def test_rounds_end_when_told_and_repeat_only_while_there_is_time() -> None:
    told: list[int] = []
    taken: list[int] = []

    def noisy(kernel: int) -> Epoch:
        taken.append(kernel)
        return Epoch(1.0, True)

    found = rounds.run_rounds(
        noisy, 4, 100, rng(), repeat=lambda: False, go_on=lambda done: done < 9, after_round=told.append
    )
    assert found.used.shape == (9, 4)
    assert len(taken) == 36
    assert told == list(range(1, 10))


# further rounds


def test_intervals_that_overlap_a_neighbour_in_the_order_of_medians_are_contested() -> None:
    spans = [(1.0, 0.9, 1.1), (5.0, 4.9, 5.1), (1.15, 1.05, 1.3), (2.0, 1.9, 2.1)]
    assert contested([statistics.Interval(*span) for span in spans]) == [0, 2]
    assert contested([Interval(1.0, 0.9, 1.1), Interval(1.2, 1.1, 1.3)]) == [0, 1]  # they touch
    assert contested([]) == contested([statistics.Interval(1.0, 0.5, 2.0)]) == []


def test_further_rounds_of_some_kernels_leave_the_others_as_they_were() -> None:
    first = rounds.Readings(np.array([[1.0, 2.0, 4.0]] * 9), np.ones((9, 3), np.bool_), np.array([0, 1, 2]))
    more = rounds.Readings(np.array([[8.0, 1.0]] * 3), np.ones((3, 2), np.bool_), np.array([5, 0]))
    joined = first.with_further(more, [2, 0])
    assert [joined.rounds(k) for k in range(3)] == [12, 9, 12]
    assert joined.marked.tolist() == [0, 1, 7]
    assert joined.least(2) == 4.0
    assert joined.median(1) == 2.0
    assert joined.ratio(1, 0).middle == pytest.approx(2.0)


def test_a_round_may_leave_a_kernel_out() -> None:
    absent, there = Epoch(math.nan), Epoch(2.0)
    found = scripted({0: iter([there] * 3), 1: iter([there, absent, absent])})
    assert (found.rounds(0), found.rounds(1)) == (3, 1)
    assert found.least(1) == found.median(1) == 2.0
    assert found.ratio(1, 0).middle == 1.0
