"""The cheapest formula of a front for an error budget, by what may be promised of each."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from heapq import heapify, heappop, heappush
from typing import Any

from phongbench.analysis.error_budget import Budget
from phongbench.analysis.promises import Promise, promise, promise_half
from phongbench.analysis.target_costs import TIE
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation
from phongbench.results.records import Row, by, key
from phongbench.results.schema import BASELINE, CELL, KERNEL

#: (row, sharp) -> what may be promised of it; unless sharp, the bound only says on which side of the budget it is
Judge = Callable[[Row, bool], Promise]


@dataclass(frozen=True)
class Choice:
    """Answer to an error budget. Rows are those of a front, with `bound` and `coverage` as they are promised.

    best          row or None   cheapest cell whose bound is within the budget; of those tied with it the most accurate
    runner_up     row or None   the cheapest one where best is tied with it, else the next cheapest
    resolved      bool          the intervals of best and runner_up do not overlap
    nearest_miss  row or None   cell with the smallest bound beyond the budget, of those faster than `best`
    """

    best: Row | None
    runner_up: Row | None
    resolved: bool
    nearest_miss: Row | None


def promised(
    budget: Budget, registry: Mapping[str, Approximation] = REGISTRY, *, search: bool = True, measured: bool = True
) -> Judge:
    """Judges rows of a run by what may be promised of their formula, which is never below a measured error.

    search    as for `promises.promise`
    measured  False where the errors of the rows are bounds by other means, which limit nothing
    """

    def judge(row: Row, sharp: bool) -> Promise:
        seen = float(row["error"]) if measured else 0.0
        if seen > budget.max_error and not sharp:
            return Promise(seen, "sampled")  # no need to prove that it may be worse
        formula = Formula.of_row(row)
        if formula.space == "half":
            kept = promise_half(formula, budget, registry)
            return Promise(max(kept.bound, seen), kept.coverage)
        kept = promise(formula, budget, registry, sharp=sharp, search=search)
        if budget.alpha.continuous and not sharp and kept.bound <= budget.max_error:
            # room for what lies between two exponents is known of sharp bounds only
            kept = promise(formula, budget, registry, search=search)
        return Promise(max(kept.bound, seen), kept.coverage)

    return judge


def as_given(row: Row, sharp: bool) -> Promise:
    """The promise of rows whose error is a bound already: that of a law."""
    return Promise(float(row["error"]), str(row.get("coverage", "certified")))


def remembered(judge: Judge) -> Judge:
    """The same judge, who proves a formula once however often it is asked about: on every target, say."""
    known: dict[tuple[str, float, bool], Promise] = {}

    def judged(row: Row, sharp: bool) -> Promise:
        key = (str(Formula.of_row(row)), float(row["error"]), sharp)
        if key not in known:
            known[key] = judge(row, sharp)
        return known[key]

    return judged


def choose(cells: Sequence[Row], max_error: float, judge: Judge = as_given) -> Choice:
    """The cheapest cell of a front whose bound is within `max_error`, the next one, and the nearest miss.

    Times are tied where each lies within the other's interval: of those tied with the least, the one that errs least
    is best, and the least is next. An interval that only reaches so far is no tie: a time that is badly known would
    win by that. Nor are exact Phong's own time, and costs that a compiler counted: they have no intervals.

    cells  rows with CELL, error, ratio, ratio_low and ratio_high
    Variants of one kernel (beta policies) take the same time; only the first within the budget stands for it.
    """
    ties = [TIE] if any(TIE in row for row in cells) else []
    rows = sorted(cells, key=by(["ratio", *ties, "error", *CELL]))
    fits: dict[tuple[Any, ...], tuple[Row, Promise]] = {}
    misses: list[tuple[float, int]] = []
    for position, row in enumerate(rows):
        kernel = _kernel(row)
        if kernel in fits:
            continue
        known = judge(row, False)
        if known.kept and known.bound <= max_error:
            fits[kernel] = row, known
            if len(fits) == 1 and (tied := _most_accurate(rows[position + 1 :], row, max_error, judge)):
                fits = {_kernel(tied[0]): tied, kernel: (row, known)}
        elif not fits:
            misses.append((known.bound, position))
        if len(fits) == 2:
            break
    best, second = [*(_sharpened(row, known, judge) for row, known in fits.values()), None, None][:2]
    resolved = best is not None and second is not None and bool(best["ratio_high"] < second["ratio_low"])
    faster = [miss for miss in misses if best is None or rows[miss[1]]["ratio"] < best["ratio"]]
    return Choice(best, second, resolved, _nearest(rows, faster, judge))


_kernel = key(KERNEL)


def _most_accurate(rows: list[Row], fastest: Row, max_error: float, judge: Judge) -> tuple[Row, Promise] | None:
    """Of the rows tied with the fastest that err less, the one that errs least within the budget."""
    tied = [
        row
        for row in rows
        if row["ratio"] < row["ratio_high"]  # a time that was measured, not a cost that was counted
        and row["ratio_low"] <= fastest["ratio"]
        and row["ratio"] <= fastest["ratio_high"]
        and row["error"] < fastest["error"]
        and row["approximation"] != BASELINE
        and _kernel(row) != _kernel(fastest)
    ]
    for row in sorted(tied, key=lambda row: (row["error"], row["ratio"])):
        known = judge(row, False)
        if known.kept and known.bound <= max_error:
            return row, known
    return None


def _sharpened(row: Row, known: Promise, judge: Judge) -> Row:
    """The row with the smaller of two bounds: that of which it is known to be within, and the sharp one."""
    return _with(row, min(judge(row, True), known, key=lambda kept: kept.bound))


def _nearest(rows: list[Row], misses: list[tuple[float, int]], judge: Judge) -> Row | None:
    """The row with the smallest bound; each is given as (what it is at least, position)."""
    heapify(misses)
    sharp: dict[int, Promise] = {}
    while misses:
        _, position = heappop(misses)
        if position in sharp:
            return _with(rows[position], sharp[position])
        sharp[position] = judge(rows[position], True)
        heappush(misses, (sharp[position].bound, position))
    return None


def _with(row: Row, kept: Promise) -> Row:
    return {**row, "bound": kept.bound, "coverage": kept.coverage, "error_coverage": row.get("coverage")}
