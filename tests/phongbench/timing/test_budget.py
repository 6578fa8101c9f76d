"""Rounds within a budget: who gives way, and when it is too little."""

import numpy as np
import pytest

from phongbench.timing import budget
from phongbench.timing.statistics import MIN_ROUNDS


def test_a_generous_budget_takes_the_largest_memory_and_leaves_the_rest_to_contested_kernels() -> None:
    assert budget.plan_rounds([("l1", 0.01), ("memory", 0.1)], 1e4, [8.0, 4.0, 2.0, 1.0]) == ([24, 24], 8.0)


def test_a_budget_that_is_just_enough_gives_24_rounds_everywhere() -> None:
    rounds, scale = budget.plan_rounds([("l1", 0.01), ("l2", 0.01), ("memory", 0.1)], 3.1, [8.0, 1.0])
    assert (rounds, scale) == ([24, 24, 24], 1.0)


def test_memory_gives_way_first() -> None:
    rounds, scale = budget.plan_rounds([("l1", 0.01), ("l2", 0.01), ("memory", 0.1)], 2.0, [8.0, 1.0])
    assert (rounds, scale) == ([24, 24, 13], 1.0)


def test_a_plan_stays_within_its_seconds() -> None:
    costs = [("l1", 0.013), ("l2", 0.017), ("memory", 0.11), ("memory", 0.2)]
    for seconds in np.geomspace(3.3, 400.0, 60):
        plan = budget.plan_rounds(costs, seconds, [8.0, 4.0, 2.0, 1.0])
        assert isinstance(plan, tuple)
        rounds, scale = plan
        spent = sum(
            r * cost * (scale if name == "memory" else 1) for r, (name, cost) in zip(rounds, costs, strict=True)
        )
        assert spent <= seconds
        assert all(r >= MIN_ROUNDS for r in rounds)


def test_too_little_tells_what_is_needed() -> None:
    needed = budget.plan_rounds([("l1", 0.01), ("memory", 0.1)], 1.0, [1.0])
    assert needed == pytest.approx(0.095 + 0.95)


@pytest.mark.parametrize(
    ("sets", "rounds"), [(["l1", "l2"], [13, 13]), (["l1", "memory"], [19, 8]), (["memory"], [24])]
)
def test_a_small_budget_gives_fewer_rounds_rather_than_nothing(sets: list[str], rounds: list[int]) -> None:
    costs = [(name, {"l1": 0.01, "l2": 0.01, "memory": 0.01}[name]) for name in sets]
    assert budget.plan_rounds(costs, 0.3, [1.0]) == (rounds, 1.0)


def test_all_blocks_fit_where_each_can_have_24_rounds() -> None:
    costs = [("l1", 0.01), ("memory", 0.1)]
    assert budget.fits(costs, 2.81)
    assert not budget.fits(costs, 2.80)
