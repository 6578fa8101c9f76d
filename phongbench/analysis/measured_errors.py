"""What a stored run says about an error budget: each formula's largest error where it must hold, and its time.

Errors are taken on unit vectors (strata highlight, uniform and peak, what a search has found, and of formulas of (N, H)
configurations of N, L and V) and, where wrong lengths are allowed, on every kind of them up to that size, against Phong
of the true angle. They are lower bounds of what may happen: what a budget is compared with is in `promises`.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from phongbench.analysis import front, kernel_times
from phongbench.analysis.error_budget import Budget, too_wrong
from phongbench.analysis.exponents import Exponents
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.inputs.strata import CONFIGURATIONS
from phongbench.results import runs
from phongbench.results.records import Records, Row, key
from phongbench.results.runs import Run
from phongbench.results.schema import CELL, TWIN

#: strata of unit vectors that a budget must hold on; the last is the search's, which looks at nearly unit ones
STRATA = ("highlight", "uniform", "peak", "normalised", "vectors")
#: perturbations that leave vectors of any wrong lengths; a cause leaves lengths of one kind only
_ANY_LENGTHS = ("a", "both", "opposite")
_FORMULA = [name for name in CELL if name != "precision"]


def with_times(run: Run, known: Sequence[Row], budget: Budget, notes: list[str]) -> list[Row]:
    """Those of the formulas of `errors` that were timed: rows as of `front.joined`, then samples, coverage, certified.

    notes   receives what to bear in mind
    Raises InputError for what the run did not time, naming the command that does.
    """
    timing = kernel_times.timed(run)
    times = kernel_times.times_of(timing, working_set=budget.working_set, precision=budget.precision)
    timed = front.joined(known, kernel_times.times_at(times, budget.alpha.values))
    if not timed:
        fix = f"time it: phongbench run --precision {budget.precision}"
        raise InputError(f"no formula in {budget.precision} was timed in {budget.working_set}", run.id, fix)
    notes += _caveats(run, timing, budget)
    return timed if front.of_this_machine(run) else [{**row, "ns": None} for row in timed]


def errors(run: Run, budget: Budget, notes: list[str]) -> list[Row]:
    """The formulas that apply, with their errors alone: rows of CELL, error, samples, coverage, bound and certified.

    notes   receives what to bear in mind
    Raises InputError for what the run did not measure, naming the command that does.
    """
    accuracy = runs.intact(run).records("accuracy")
    return _worst(run, accuracy, _vouching(run, accuracy, budget, notes), budget, notes)


def _vouching(run: Run, accuracy: Records, budget: Budget, notes: list[str]) -> tuple[float, ...]:
    """The run's exponents that vouch for those of the budget."""
    known, wanted = accuracy.distinct("alpha"), budget.alpha
    alphas = wanted.around(known)
    if alphas is None:
        listed = ",".join(f"{value:g}" for value in wanted.values)
        fix = f"measure it: phongbench run --alpha {listed}, or name another run with --run"
        what = f"alpha {wanted} lies outside what the run measured, {known[0]:g} .. {known[-1]:g}"
        raise InputError(what, run.id, fix)
    missing = [value for value in wanted.values if not any(math.isclose(value, one) for one in alphas)]
    if missing:
        near = ", ".join(f"{value:g}" for value in alphas)
        subject = " and ".join(f"{value:g}" for value in missing) + (" was" if len(missing) == 1 else " were")
        whose = "its neighbours vouch for it" if len(missing) == 1 else "their neighbours vouch for them"
        notes.append(f"alpha {subject} not measured: {whose}, by the worst of alpha {near}")
    elif wanted.continuous:
        notes.append(f"alpha {wanted} is judged by the worst of the {len(alphas)} exponents measured there")
    return alphas


def _worst(run: Run, accuracy: Records, alphas: tuple[float, ...], budget: Budget, notes: list[str]) -> list[Row]:
    """Each formula's largest error over these exponents and all inputs of the budget; formulas that apply only."""
    mine = accuracy.as_given().at(precision=budget.precision, space=budget.space, truth="angle", gated=True)
    mine = mine.at(alpha=alphas)
    if not len(mine):
        raise _without_cells(run, budget)
    known = front.finite(_on_inputs(run, mine, budget, notes), "samples", "coverage")
    worst = front.worst_of(front.whole_or_any(known, budget.alpha))
    proven, formula = _certified(accuracy, alphas), key(_FORMULA)
    return [{**row, "certified": proven.get(formula(row))} for row in worst if _applies(row, budget.alpha)]


def _without_cells(run: Run, budget: Budget) -> InputError:
    every = run.records("accuracy")
    held = [f"{p} {s}" for p in every.distinct("precision") for s in every.at(precision=p).distinct("space")]
    fix = f"measure it: phongbench run --precision {budget.precision}"
    what = f"no cells in {budget.precision}, {budget.space} space; the run holds {', '.join(sorted(held))}"
    return InputError(what, run.id, fix)


def _on_inputs(run: Run, mine: Records, budget: Budget, notes: list[str]) -> Records:
    """The rows of unit vectors, and of wrong lengths up to the smallest measured one that covers the budget's."""
    unit = mine.at(stratum=(*STRATA, CONFIGURATIONS))
    if not len(unit):
        fix = 'measure them: phongbench run with a plan whose strata include "highlight"'
        raise InputError(f"the run holds none of the strata {', '.join(STRATA)}", run.id, fix)
    if budget.space == "half" and not len(unit.at(stratum=CONFIGURATIONS)):
        notes.append(
            "this run measured formulas of (N, H) on coplanar vectors only: a new one measures all configurations"
        )
    if not budget.length_error:
        return unit
    wrong = mine.at(stratum="lengths", perturbation=_ANY_LENGTHS)
    sizes = sorted({abs(size) for size in wrong.distinct("length_error")})
    if not sizes:
        fix = f'measure them: a plan with strata = ["highlight", "lengths"] and length_spaces = ["{budget.space}"]'
        raise InputError(f"the run holds no vectors of wrong length in {budget.space} space", run.id, fix)
    reached = next((size for size in sizes if size >= budget.length_error * (1 - 1e-9)), None)
    if reached is None:
        fix = "allow a smaller length error, or normalise the vectors first"
        raise InputError(too_wrong(sizes[-1], budget), run.id, fix)
    if not math.isclose(reached, budget.length_error):
        notes.append(f"lengths are judged at {reached:g} wrong, the nearest that was measured and not less")
    covered = (*(-size for size in sizes if size <= reached), *(size for size in sizes if size <= reached))
    return unit.together(wrong.at(length_error=covered))


def _applies(row: Mapping[str, Any], alpha: Exponents) -> bool:
    """False for a formula of ours that does not take an exponent of the budget."""
    formula, ends = Formula.of_row(row), alpha.values
    middle = (math.sqrt(ends[0] * ends[-1]),) if alpha.continuous else ()
    spec = REGISTRY.get(formula.approximation)
    return spec is None or all(spec.accepts(formula.setting(value)) for value in (*ends, *middle))


def _certified(accuracy: Records, alphas: tuple[float, ...]) -> dict[tuple[Any, ...], float | None]:
    """The proven bound of each formula's own error over these exponents, where there is one at each."""
    groups: dict[tuple[Any, ...], list[float | None]] = {}
    formula = key(_FORMULA)
    for row in accuracy.at(coverage="certified", alpha=alphas).rows([*_FORMULA, "model_max"]):
        groups.setdefault(formula(row), []).append(row["model_max"])
    return {
        name: max((bound for bound in bounds if bound is not None), default=None)
        for name, bounds in groups.items()
        if len(bounds) == len(alphas)
    }


def _caveats(run: Run, timing: Records, budget: Budget) -> list[str]:
    """What to bear in mind of these times and vectors, as sentences."""
    notes, timed = [], kernel_times.timed_precision(budget.precision)
    if timed != budget.precision:
        notes.append(
            f"{budget.precision} is emulated here, so its time says nothing: formulas are ordered by the times of the "
            f"same kernels in {timed}"
        )
    twin = timing.at(approximation=TWIN, working_set=budget.working_set)
    if set(twin.distinct("verdict")) - {"unresolved"}:
        notes.append(
            "identical code differed in time in this run, so no claim to be faster is made: time it again when quiet"
        )
    if not front.of_this_machine(run):
        notes.append("the run was timed on another kind of machine: its ratios hold there, nanoseconds are left out")
    return notes
