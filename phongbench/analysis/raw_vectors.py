"""Which recipe to ship for raw N, L and V, and what each step of it costs.

Recipes are judged on configurations of N, L and V at all incidences and azimuths, against Phong of the angle between
the true mirror direction and V. What is promised of a recipe that makes (R, V) and removes lengths exactly is the
promise of its formula on unit vectors, and room for the roundings of the steps before it. Of a recipe that makes
(N, H), whose value is no function of that angle, nothing is promised: its errors are samples.
"""

import math
from collections.abc import Sequence
from typing import Any

from phongbench.analysis import choice, front, kernel_times
from phongbench.analysis.choice import Choice, Judge
from phongbench.analysis.choice_words import answered, plain
from phongbench.analysis.error_budget import Budget, too_wrong
from phongbench.analysis.promises import DEVICES, Promise, promise_raw
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula, Registry
from phongbench.formulas.recipes import RECIPES
from phongbench.formulas.user_files import installed
from phongbench.inputs.length_errors import ANY
from phongbench.inputs.strata import CONFIGURATIONS
from phongbench.results import runs
from phongbench.results.records import Records, Row
from phongbench.results.runs import Run
from phongbench.results.schema import BASELINE, DOT

#: what every shader does that normalises first: the recipe that others are measured by
USUAL = Formula.parse(f"{BASELINE}@reflect/each")
#: steps of a highlight: name, the formula that has it, the formula without it, what it is
STEPS = (
    ("power", BASELINE, "", "the power, beyond a bare dot product"),
    ("normalise R and V", f"{BASELINE}/each", BASELINE, "two roots and two divisions"),
    ("one root", f"{BASELINE}/once", BASELINE, "one root and one division for the pair"),
    ("no root", f"{BASELINE}/squared", BASELINE, "one division, the cosine squared"),
    ("bit trick", f"{BASELINE}/fast", BASELINE, "two roots by the bit trick with a Newton step"),
    ("estimates", f"{BASELINE}/estimate", BASELINE, "two roots by the processor's 12-bit estimate alone"),
    ("normalise N, then R", f"{BASELINE}@reflect", BASELINE, "one root and one division, R = 2(N.L)N - L"),
    ("R at any length", f"{BASELINE}@lengthwise", BASELINE, "R = 2(N.L)N - (N.N)L"),
    ("H", "blinn@halfway/once", f"{BASELINE}/once", "two roots and two divisions, H = L/|L| + V/|V|"),
)


def cells(
    accuracy: Records, timing: Records, budget: Budget, *, any_length: bool, name: str, notes: list[str]
) -> list[Row]:
    """The recipes that a run measured and timed: rows as of `front.joined`, then samples and coverage.

    accuracy, timing  its tables, raw formulas among them
    any_length        True: L, N and V have lengths from 0.001 to 1000; else they are as wrong as the budget says
    name              the run's, for errors
    Raises InputError for what the run did not measure, naming the command that does.
    """
    rows = configurations(accuracy, budget.precision)
    if not len(rows):
        fix = f"measure them: phongbench run --precision {budget.precision}, with a plan that leaves `raw` as it is"
        raise InputError(f"the run holds no recipes from N, L and V in {budget.precision}", name, fix)
    alphas = budget.alpha.around(rows.distinct("alpha"))
    if alphas is None:
        fix = f"measure it: phongbench run --alpha {','.join(f'{a:g}' for a in budget.alpha.values)}"
        raise InputError(f"alpha {budget.alpha} lies outside what the run measured", name, fix)
    rows = rows.at(alpha=alphas)
    rows = rows.at(perturbation=ANY.name) if any_length else _as_wrong(rows, budget, name, notes)
    worst = front.worst_of(front.finite(rows, "samples", "coverage"))
    times = kernel_times.times_of(timing, working_set=budget.working_set, precision=budget.precision)
    return front.joined(worst, kernel_times.times_at(times, budget.alpha.values))


def cheapest(accuracy: Records, timing: Records, budget: Budget, name: str) -> tuple[Choice, Row | None]:
    """The choice among recipes for vectors of any length, and the row of the USUAL one, by a run's tables."""
    compared = cells(accuracy, timing, budget, any_length=True, name=name, notes=[])
    chosen = choice.choose(compared, budget.max_error, judged(budget, installed(), any_length=True))
    return chosen, next((row for row in compared if Formula.of_row(row) == USUAL), None)


def configurations(accuracy: Records, precision: str) -> Records:
    """The rows of recipes in a precision."""
    return accuracy.at(stratum=CONFIGURATIONS, precision=precision, recipe=tuple(RECIPES))


def _as_wrong(rows: Records, budget: Budget, name: str, notes: list[str]) -> Records:
    """The rows of vectors that are unit, or as wrong as the smallest measured size that covers the budget's."""
    rows = rows.at(perturbation=tuple(one for one in rows.distinct("perturbation") if one != ANY.name))
    sizes = sorted({abs(size) for size in rows.distinct("length_error")})
    reached = next((size for size in sizes if size >= budget.length_error * (1 - 1e-9)), None)
    if reached is None:
        fix = "leave --length-error or --mesh-angle out: lengths from 0.001 to 1000 are then meant"
        raise InputError(too_wrong(sizes[-1], budget), name, fix)
    if not math.isclose(reached, budget.length_error, abs_tol=1e-12):
        notes.append(f"lengths are judged at {reached:g} wrong, the nearest that was measured and not less")
    return rows.at(length_error=tuple(sign * size for size in sizes if size <= reached for sign in (1, -1)))


def judged(budget: Budget, registry: Registry, *, any_length: bool) -> Judge:
    """Judges rows of recipes by what may be promised of them, which is never below a measured error."""

    def judge(row: Row, sharp: bool) -> Promise:
        kept = promise_raw(Formula.of_row(row), budget, registry, any_length=any_length, sharp=sharp)
        return Promise(max(kept.bound, float(row["error"])), kept.coverage)

    return judge


def recommend(run: Run | None, budget: Budget, *, any_length: bool, notes: Sequence[str] = ()) -> dict[str, Any]:
    """The cheapest recipe from raw N, L and V within a budget, as plain data like `recommend.recommend`.

    any_length  True: vectors of any length; else as wrong as the budget says
    notes       what is to be told first
    returns     the keys of `recommend.recommend`, and `usual`: the recipe that normalises all and takes the power, and
                `steps`: what each step costs, see there
    Raises InputError where there is no run: recipes are chosen by what was measured.
    """
    if run is None:
        raise InputError("no run says what recipes cost", "raw", "measure them: phongbench run")
    notes = [*notes]
    accuracy, timing = runs.intact(run).records("accuracy"), kernel_times.timed(run)
    compared = cells(accuracy, timing, budget, any_length=any_length, name=run.id, notes=notes)
    judge = judged(budget, installed(), any_length=any_length)
    most = f"up to {100 * budget.length_error:.3g} % wrong"
    lengths = (
        "any length from 0.001 to 1000" if any_length else f"lengths {most}" if budget.length_error else "unit N, L, V"
    )
    notes += [gain] if (gain := lengths_gain(compared, budget, judge)) else []
    chosen = choice.choose(compared, budget.max_error, judge)
    answer = answered(chosen, budget, f", N, L and V of {lengths}")
    where = f"{DEVICES}, " if budget.contract else ""
    notes.append(f"what an answer says holds in {budget.precision} {where}for every N, L and V of {lengths}")
    usual = [
        plain(row | {"bound": math.inf, "error_coverage": row["coverage"]}, budget)
        for row in compared
        if Formula.of_row(row) == USUAL
    ]
    return {
        "basis": "run",
        "run": run.id,
        "alpha": str(budget.alpha),
        "max_error": budget.max_error,
        "length_error": None if any_length else budget.length_error,
        "precision": budget.precision,
        "space": "from N, L and V",
        "working_set": budget.working_set,
        "contract": budget.contract,
        **answer,
        "usual": usual[0] if usual else None,
        "steps": steps(timing, working_set=budget.working_set, precision=budget.precision),
        "notes": notes,
    }


def steps(timing: Records, *, working_set: str = "l1", precision: str = "float32") -> list[dict[str, Any]]:
    """What each step of a highlight costs: rows of step, what, with, without, ns, share, share_low, share_high.

    ns     difference of the least times; a step of which one was not timed, or has no interval, is left out
    share  of exact Phong's time on unit vectors, with the 99 % interval of that time's ratio
    """
    times = kernel_times.times_of(timing, working_set=working_set, precision=precision)
    by_name = {_name(row): row for row in times if front.whole(row, "ns", *front.SPAN)}
    rows = []
    for name, having, lacking, what in STEPS:
        with_it, without = by_name.get(having), by_name.get(lacking or DOT)
        if with_it is None or without is None:
            continue
        # the baseline's own ratio is 1 without an interval, so the interval is that of the other kernel
        low, high = with_it["ratio_low"] - without["ratio_high"], with_it["ratio_high"] - without["ratio_low"]
        rows.append(
            {
                "step": name,
                "what": what,
                "with": having,
                "without": lacking or "a bare dot product",
                "ns": with_it["ns"] - without["ns"],
                "share": with_it["ratio"] - without["ratio"],
                "share_low": low,
                "share_high": high,
            }
        )
    return rows


def _name(row: Row) -> str:
    name = str(row["approximation"])
    return name if name == DOT else str(Formula.of_row({**row, "beta_policy": "none"}))


def in_words(rows: Sequence[dict[str, Any]]) -> str:
    """The steps in a line: "power 0.12 ns, one root 0.09 ns"."""
    return ", ".join(f"{row['step']} {row['ns']:.2g} ns" for row in rows)


def lengths_gain(compared: Sequence[Row], budget: Budget, judge: Judge) -> str | None:
    """A sentence on whether removing lengths is the better answer, where the budget can be met both ways."""
    best: dict[bool, Row | None] = {}
    for removes in (True, False):
        mine = [row for row in compared if (row["normalise"] != "none") == removes]
        best[removes] = choice.choose(mine, budget.max_error, judge).best if mine else None
    with_it, without = best[True], best[False]
    if with_it is None or without is None:
        return None if with_it is None else "without removing lengths no recipe is within the budget"
    names = [str(Formula.of_row(row)) for row in (with_it, without)]
    if with_it["ratio_high"] < without["ratio_low"]:
        return f"removing lengths is the better answer: {names[0]} is faster than {names[1]}, which leaves them"
    if without["ratio_high"] < with_it["ratio_low"]:
        return f"leaving lengths is the better answer: {names[1]} is faster than {names[0]}, which removes them"
    return f"{names[0]} removes lengths, {names[1]} leaves them: which is faster is not settled"
