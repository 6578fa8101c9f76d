"""Which formula to ship for an error budget: the cheapest one whose largest error is within it, and why.

A stored run tells which formulas there are and what they cost; without one the closed-form laws answer, which know
errors but no times. What is compared with the budget is a promise (`promises`): proven, or searched and widened. What
was measured is told beside it, and decides nothing.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from phongbench.analysis import law_bounds, measured_errors
from phongbench.analysis.choice import Row, as_given, choose, promised
from phongbench.analysis.error_budget import Budget
from phongbench.analysis.exponents import Exponents
from phongbench.analysis.promises import DOMAIN, exponents_of
from phongbench.compiler.precisions import precision_named
from phongbench.formulas.formula import Formula
from phongbench.formulas.user_files import installed
from phongbench.results import runs
from phongbench.results.runs import DEFAULT_ROOT, Run


def recommend(
    run: Run | None,
    *,
    alpha: Exponents | float | str,
    max_error: float | str,
    length_error: float | str | None = None,
    precision: str = "float32",
    space: str = "reflect",
    working_set: str = "l1",
    search: bool = True,
) -> dict[str, Any]:
    """The cheapest formula within an error budget, the next cheapest, and the nearest miss, as plain data.

    run                  a stored run with timing rows, or None: answer from the laws
    alpha                exact Phong's exponent, > 0: one, several or a range, as `Exponents.of` reads them; an error is
                         the worst over all of them
    max_error            largest absolute error allowed, above 0; text may be a fraction such as 1/255
    length_error         how wrong vector lengths may be, relative, >= 0: 0.01 is up to 1 %; None for unit vectors
    precision            a name that `precision_named` knows
    space                reflect (R, V), or half (N, H), whose errors hold for coplanar vectors only
    working_set          whose times count: l1, l2 or memory
    search               False: what cannot be proven is not searched either, which takes seconds; nothing is promised
    returns              basis ("run" or "laws"), run, the budget, `choices` (best, then next; empty where nothing is
                         within it), `nearest_miss`, `notes` in words. In each choice `max_abs` is the largest error
                         that was measured, or a law's; `bound` is what is compared with the budget, None where nothing
                         is promised, and `coverage` what it rests on
    Raises InputError for numbers out of range and for what the run did not measure, naming the command that does;
    UnknownNameError for an unknown precision or space; CorruptRunError for a run whose bytes have changed.
    """
    budget = Budget.of(alpha, max_error, length_error, precision, space, working_set)
    notes: list[str] = []
    cells = law_bounds.cells(budget, notes) if run is None else measured_errors.cells(run, budget, notes)
    unknown = sorted(set(cells["approximation"]) - set(installed()))
    if unknown:
        notes.append(f"{', '.join(unknown)}: only sampled, and the formula is not here, so nothing is promised of it")
    choice = choose(cells, budget.max_error, as_given if run is None else promised(budget, installed(), search=search))
    choices = [_plain(row, budget) for row in (choice.best, choice.runner_up) if row is not None]
    miss = None if choice.nearest_miss is None else _plain(choice.nearest_miss, budget)
    if run is not None:
        vectors = "vectors rounded to it" if precision_named(precision).saturates else DOMAIN
        notes.append(f"what an answer says holds in {precision} for {vectors}")
    for chosen, other in zip(choices, [*choices[1:], None], strict=False):
        chosen["why"] = _why(chosen, other, budget, choice.resolved)
    if miss is not None:
        miss["why"] = f"{_beyond(miss, budget)}: {_basis(miss, budget)}; {_cost(miss)}"
    return {
        "basis": "laws" if run is None else "run",
        "run": None if run is None else run.id,
        "alpha": str(budget.alpha),
        "max_error": budget.max_error,
        "length_error": budget.length_error,
        "precision": precision,
        "space": space,
        "working_set": working_set,
        "choices": choices,
        "nearest_miss": miss,
        "notes": notes,
    }


def run_for(name: str | None, root: Path = DEFAULT_ROOT) -> Run | None:
    """The run of this name; without one, the newest whole run with times; None where there is none.

    name  an id under `root`, `latest` or a folder; InputError where there is no such run
    """
    if name is not None:
        return runs.find(name, root)
    whole = (run for run in reversed(runs.stored(root)) if run.complete)
    return next((run for run in whole if run.manifest["files"].get("timing.parquet", {}).get("rows", 0)), None)


def _plain(cell: Row, budget: Budget) -> dict[str, Any]:
    """A row of cells as plain data."""
    formula, by_law = Formula.of_row(cell), cell["coverage"] == "law"
    spec = installed().get(formula.approximation)
    single = spec is not None and len(budget.alpha.values) == 1
    beta = spec.coefficients(formula.setting(budget.alpha.values[0])).get("beta") if single and spec else None
    times = {name: None if by_law else _number(cell[name]) for name in ("ns", "ratio", "ratio_low", "ratio_high")}
    return {
        "name": str(formula),
        "approximation": formula.approximation,
        "lambda": formula.lambda_form,
        "space": formula.space,
        "gamma": formula.gamma,
        "beta": _number(beta),
        "beta_policy": formula.slope,
        "precision": budget.precision,
        "formula": spec.formula if spec else None,
        "max_abs": float(cell["error"]),
        "codes_8bit": 255 * float(cell["error"]),
        "bound": float(cell["bound"]) if math.isfinite(cell["bound"]) else None,
        "coverage": str(cell["coverage"]),
        "error_coverage": str(cell["error_coverage"]),
        "samples": None if by_law else int(cell["samples"]),
        **times,
        "certified": _number(cell.get("certified")),
        "work": float(cell["ratio"]) if by_law else None,
    }


def _number(value: Any) -> float | None:
    return None if value is None or pd.isna(value) else float(value)


def _beyond(miss: Mapping[str, Any], budget: Budget) -> str:
    if miss["bound"] is None:
        return f"not known to be within {budget.max_error:.4g}"
    return f"beyond {budget.max_error:.4g} by a factor of {miss['bound'] / budget.max_error:.3g}"


def _basis(choice: Mapping[str, Any], budget: Budget) -> str:
    """What is promised, where, what that rests on, and what was measured."""
    lengths = f" and lengths up to {budget.length_error:.3g} wrong" if budget.length_error else ""
    where = f"at alpha {budget.alpha}{lengths}"
    if choice["coverage"] == "law":
        return f"largest error {_size(choice['max_abs'])} {where}, by law"
    certified = choice["certified"]
    alone = "" if certified is None else f"; the formula alone errs by at most {certified:.3g}, proven"
    return f"{_promise(choice, where, budget)}; {_measured(choice)}{alone}"


def _promise(choice: Mapping[str, Any], where: str, budget: Budget) -> str:
    if choice["bound"] is None:
        return f"nothing is promised {where}"
    most = f"errs by at most {_size(choice['bound'])} {where}"
    if choice["coverage"] == "certified":
        return f"{most}, proven"
    if budget.alpha.continuous:
        return f"{most}, proven at {len(exponents_of(budget))} exponents of the range, with room for those between"
    return f"{most}: the worst that a search found, with the rounding that it may have missed"


def _measured(choice: Mapping[str, Any]) -> str:
    """The largest error that was measured, which is a lower bound."""
    error, how = f"{choice['max_abs']:.3g}", choice["error_coverage"]
    if how == "sampled":
        return f"{error} was the largest of {choice['samples']:,} samples a stratum"
    return f"{error} was the worst that a search found" if how == "searched" else f"{error} was measured ({how})"


def _size(error: float) -> str:
    return f"{error:.3g} ({255 * error:.2g} 8-bit codes)"


def _cost(choice: Mapping[str, Any]) -> str:
    if choice["ratio"] is None:
        return f"about {choice['work']:.0f} operations an element, counted and not timed"
    interval = f"interval {choice['ratio_low']:.3g} .. {choice['ratio_high']:.3g}"
    return f"{choice['ratio']:.3g} of exact Phong's time ({interval})"


def _why(choice: Mapping[str, Any], other: Mapping[str, Any] | None, budget: Budget, resolved: bool) -> str:
    """Why it is chosen, and how sure it is that the next one is slower."""
    parts = [_basis(choice, budget), f"within {budget.max_error:.4g}", _cost(choice)]
    if other is not None and choice["ratio"] is None:
        parts.append(f"the next, {other['name']}, takes about {other['work']:.0f}")
    elif other is not None:
        sure = "surely slower" if resolved else "which is faster is not settled, the intervals overlap"
        parts.append(f"the next, {other['name']}, takes {other['ratio']:.3g}: {sure}")
    return "; ".join(parts)
