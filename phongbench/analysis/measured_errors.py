"""What a stored run says about an error budget: each formula's largest error where it must hold, and its time.

Errors are taken on unit vectors (strata highlight, uniform and peak, what a search has found, and of formulas of (N, H)
configurations of N, L and V) and, where wrong lengths are allowed, on every kind of them up to that size, against Phong
of the true angle. They are lower bounds of what may happen: what a budget is compared with is in `promises`.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from phongbench.analysis import front, kernel_times
from phongbench.analysis.error_budget import Budget, too_wrong
from phongbench.analysis.exponents import Exponents
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.inputs.strata import CONFIGURATIONS
from phongbench.results import runs
from phongbench.results.runs import Run, as_given
from phongbench.results.schema import CELL, INPUT, TWIN

#: strata of unit vectors that a budget must hold on; the last is the search's, which looks at nearly unit ones
STRATA = ("highlight", "uniform", "peak", "normalised", "vectors")
#: perturbations that leave vectors of any wrong lengths; a cause leaves lengths of one kind only
_ANY_LENGTHS = ("a", "both", "opposite")
_FORMULA = [name for name in CELL if name != "precision"]


def cells(run: Run, budget: Budget, notes: list[str]) -> pd.DataFrame:
    """The formulas that apply: columns as of `front.joined`, then samples, coverage and certified.

    notes   receives what to bear in mind
    Raises InputError for what the run did not measure, naming the command that does.
    """
    timing = kernel_times.timed(runs.intact(run))
    worst = errors(run, budget, notes)
    times = kernel_times.times_of(timing, working_set=budget.working_set, precision=budget.precision)
    timed = front.joined(worst, kernel_times.times_at(times, budget.alpha.values))
    if timed.empty:
        fix = f"time it: phongbench run --precision {budget.precision}"
        raise InputError(f"no formula in {budget.precision} was timed in {budget.working_set}", run.id, fix)
    notes += _caveats(run, timing, budget)
    return timed if front.of_this_machine(run) else timed.assign(ns=np.nan)


def errors(run: Run, budget: Budget, notes: list[str]) -> pd.DataFrame:
    """The formulas that apply, with their errors alone: columns CELL, error, samples, coverage, bound and certified.

    Arguments and errors as for `cells`.
    """
    accuracy = runs.with_raw(runs.intact(run).accuracy)
    return _worst(run, accuracy, _vouching(run, accuracy, budget, notes), budget, notes)


def _vouching(run: Run, accuracy: pd.DataFrame, budget: Budget, notes: list[str]) -> tuple[float, ...]:
    """The run's exponents that vouch for those of the budget."""
    known, wanted = sorted(accuracy["alpha"].unique()), budget.alpha
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


def _worst(
    run: Run, accuracy: pd.DataFrame, alphas: tuple[float, ...], budget: Budget, notes: list[str]
) -> pd.DataFrame:
    """Each formula's largest error over these exponents and all inputs of the budget; formulas that apply only."""
    mine = (accuracy["precision"] == budget.precision) & (accuracy["space"] == budget.space)
    rows = as_given(
        accuracy[mine & accuracy["alpha"].isin(alphas) & accuracy["gated"] & (accuracy["truth"] == "angle")]
    )
    if rows.empty:
        raise _without_cells(run, budget)
    rows = _on_inputs(run, rows, budget, notes)
    finite = rows.groupby(CELL, dropna=False, observed=True)["nonfinite"].transform("sum") == 0
    rows = front.whole_or_any(rows[finite & rows["max_abs"].notna()], budget.alpha)
    columns = [*CELL, *INPUT, "max_abs", "samples", "coverage"]
    worst = front.worst_of(rows[columns].rename(columns={"max_abs": "error"}))
    worst = worst[[_applies(row, budget.alpha) for row in front.records(worst)]]
    return worst.merge(_certified(accuracy, alphas), on=_FORMULA, how="left")


def _without_cells(run: Run, budget: Budget) -> InputError:
    held = sorted({f"{p} {s}" for p, s in zip(run.accuracy["precision"], run.accuracy["space"], strict=True)})
    fix = f"measure it: phongbench run --precision {budget.precision}"
    what = f"no cells in {budget.precision}, {budget.space} space; the run holds {', '.join(held)}"
    return InputError(what, run.id, fix)


def _on_inputs(run: Run, rows: pd.DataFrame, budget: Budget, notes: list[str]) -> pd.DataFrame:
    """The rows of unit vectors, and of wrong lengths up to the smallest measured one that covers the budget's."""
    unit = rows["stratum"].isin((*STRATA, CONFIGURATIONS))
    if not unit.any():
        fix = 'measure them: phongbench run with a plan whose strata include "highlight"'
        raise InputError(f"the run holds none of the strata {', '.join(STRATA)}", run.id, fix)
    if budget.space == "half" and not (rows["stratum"] == CONFIGURATIONS).any():
        notes.append(
            "this run measured formulas of (N, H) on coplanar vectors only: a new one measures all configurations"
        )
    if not budget.length_error:
        return rows[unit]
    wrong = (rows["stratum"] == "lengths") & rows["perturbation"].isin(_ANY_LENGTHS)
    sizes = np.sort(rows.loc[wrong, "length_error"].abs().unique())
    if not len(sizes):
        fix = f'measure them: a plan with strata = ["highlight", "lengths"] and length_spaces = ["{budget.space}"]'
        raise InputError(f"the run holds no vectors of wrong length in {budget.space} space", run.id, fix)
    reached = sizes[sizes >= budget.length_error * (1 - 1e-9)]
    if not len(reached):
        fix = "allow a smaller length error, or normalise the vectors first"
        raise InputError(too_wrong(sizes[-1], budget), run.id, fix)
    if not math.isclose(reached[0], budget.length_error):
        notes.append(f"lengths are judged at {reached[0]:g} wrong, the nearest that was measured and not less")
    covered: pd.DataFrame = rows[unit | (wrong & (rows["length_error"].abs() <= reached[0]))]
    return covered


def _applies(row: Mapping[str, Any], alpha: Exponents) -> bool:
    """False for a formula of ours that does not take an exponent of the budget."""
    formula, ends = Formula.of_row(row), alpha.values
    middle = (math.sqrt(ends[0] * ends[-1]),) if alpha.continuous else ()
    spec = REGISTRY.get(formula.approximation)
    return spec is None or all(spec.accepts(formula.setting(value)) for value in (*ends, *middle))


def _certified(accuracy: pd.DataFrame, alphas: tuple[float, ...]) -> pd.DataFrame:
    """The proven bound of each formula's own error over these exponents, where there is one at each."""
    rows = accuracy[(accuracy["coverage"] == "certified") & accuracy["alpha"].isin(alphas)]
    groups = rows.groupby(_FORMULA, dropna=False, observed=True)["model_max"]
    return groups.max()[groups.size() == len(alphas)].rename("certified").reset_index()


def _caveats(run: Run, timing: pd.DataFrame, budget: Budget) -> list[str]:
    """What to bear in mind of these times and vectors, as sentences."""
    notes, timed = [], kernel_times.timed_precision(budget.precision)
    if timed != budget.precision:
        notes.append(
            f"{budget.precision} is emulated here, so its time says nothing: formulas are ordered by the times of the "
            f"same kernels in {timed}"
        )
    twin = timing[(timing["approximation"] == TWIN) & (timing["working_set"] == budget.working_set)]
    if (twin["verdict"] != "unresolved").any():
        notes.append(
            "identical code differed in time in this run, so no claim to be faster is made: time it again when quiet"
        )
    if not front.of_this_machine(run):
        notes.append("the run was timed on another kind of machine: its ratios hold there, nanoseconds are left out")
    return notes
