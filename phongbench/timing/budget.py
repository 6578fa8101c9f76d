"""How long a timing takes: rounds within a budget, and what is left out where the budget is small."""

import math
from collections.abc import Sequence

from phongbench.timing.statistics import MIN_ROUNDS

#: rounds a block should have, and rounds beyond which more teach nothing; below clock.MIN_ROUNDS there is no interval
GOOD_ROUNDS, MOST_ROUNDS = 24, 192
#: rounds that contested kernels get at a time
FURTHER_ROUNDS = 8
#: share of the budget that is planned with; the rest is for repeating disturbed epochs
PLANNED = 0.85


def seconds_of(costs: Sequence[tuple[str, float]], rounds: float, large: float, scale: float = 1.0) -> float:
    """Seconds of so many rounds in caches and `large` ones in "memory", enlarged by `scale`.

    Verifying outputs counts as half as much again as a round.
    """
    cached = sum(cost for name, cost in costs if name != "memory")
    memory = sum(cost for name, cost in costs if name == "memory")
    return cached * (rounds + 1.5) + memory * scale * (large + 1.5)


def fits(costs: Sequence[tuple[str, float]], seconds: float) -> bool:
    """Whether every block can have GOOD_ROUNDS, "memory" at its smallest size."""
    return seconds_of(costs, GOOD_ROUNDS, GOOD_ROUNDS) <= seconds


def plan_rounds(
    costs: Sequence[tuple[str, float]], seconds: float, scales: Sequence[float]
) -> tuple[list[int], float] | float:
    """How many rounds each block gets for all its kernels, and how large the working set "memory" becomes.

    costs    (working set, seconds of a round) of each block, "memory" at its smallest size
    scales   sizes "memory" may have, relative to the smallest, largest first
    returns  rounds of each block, and the size chosen; or the seconds needed where there are too few

    First every block gets GOOD_ROUNDS, then "memory" grows; what is left goes to contested kernels later. Where even
    GOOD_ROUNDS are too many, "memory" gets fewer, then all do, down to MIN_ROUNDS: intervals widen and stay true, and
    the column `rounds` says why.
    """
    least = seconds_of(costs, MIN_ROUNDS, MIN_ROUNDS)
    if least > seconds:
        return least
    if fits(costs, seconds):
        scale = next(s for s in scales if seconds_of(costs, GOOD_ROUNDS, GOOD_ROUNDS, s) <= seconds)
        return [GOOD_ROUNDS] * len(costs), scale
    large = few = GOOD_ROUNDS
    memory = sum(cost for name, cost in costs if name == "memory")
    cached = sum(cost for name, cost in costs if name != "memory")
    if memory:
        large = max(MIN_ROUNDS, math.floor((seconds - seconds_of(costs, few, -1.5)) / memory - 1.5))
    if cached:
        few = max(MIN_ROUNDS, math.floor((seconds - seconds_of(costs, -1.5, large)) / cached - 1.5))
        few = min(GOOD_ROUNDS, few)
    return [large if name == "memory" else few for name, _ in costs], 1.0
