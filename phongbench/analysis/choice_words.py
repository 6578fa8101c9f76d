"""The answer to an error budget in words and as plain data: what is promised, what was measured, what it costs."""

import math
from collections.abc import Mapping
from typing import Any

from phongbench.analysis.choice import Choice
from phongbench.analysis.error_budget import Budget
from phongbench.analysis.promises import DEVICES, exponents_of
from phongbench.formulas.formula import Formula
from phongbench.formulas.user_files import installed
from phongbench.results.records import Row
from phongbench.results.schema import BASELINE, CPU


def plain(cell: Row, budget: Budget) -> dict[str, Any]:
    """A row of cells as plain data."""
    formula, by_law = Formula.of_row(cell), cell["error_coverage"] == "law"
    spec = installed().get(formula.approximation)
    single = spec is not None and len(budget.alpha.values) == 1
    beta = spec.coefficients(formula.setting(budget.alpha.values[0])).get("beta") if single and spec else None
    counted = by_law and "cost" not in cell
    times = {name: None if counted else _number(cell[name]) for name in ("ns", "ratio", "ratio_low", "ratio_high")}
    return {
        "name": str(formula),
        "approximation": formula.approximation,
        "lambda": formula.lambda_form,
        "space": formula.space,
        "recipe": formula.recipe,
        "normalise": formula.normalise,
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
        "work": float(cell["ratio"]) if counted else None,
        **_priced(cell, counted),
    }


def _priced(cell: Row, counted: bool) -> dict[str, Any]:
    """What a choice costs: here its time, or operations that were counted; elsewhere what a compiler says."""
    if "cost" in cell:
        words = {name: str(cell[name]) for name in ("target", "unit", "cost_kind")}
        return {"cost": float(cell["cost"]), **words, "bound_by": cell["bound_by"]}
    if counted:
        return {
            "target": CPU,
            "cost": float(cell["ratio"]),
            "unit": "operations",
            "cost_kind": "counted",
            "bound_by": None,
        }
    return {"target": CPU, "cost": _number(cell["ns"]), "unit": "ns", "cost_kind": "measured", "bound_by": None}


def _number(value: Any) -> float | None:
    return None if value is None or math.isnan(value) else float(value)


def _beyond(miss: Mapping[str, Any], budget: Budget) -> str:
    if miss["max_abs"] > budget.max_error:
        return f"beyond {budget.max_error:.4g} by a factor of {miss['max_abs'] / budget.max_error:.3g} at least"
    if miss["bound"] is None:
        return f"not known to be within {budget.max_error:.4g}"
    return f"beyond {budget.max_error:.4g} by a factor of {miss['bound'] / budget.max_error:.3g}"


def basis(choice: Mapping[str, Any], budget: Budget, where: str = "") -> str:
    """What is promised, where, what that rests on, and what was measured.

    where   vectors it holds for, after the exponent; left out: those of the budget
    """
    lengths = f" and lengths up to {100 * budget.length_error:.3g} % wrong" if budget.length_error else ""
    where = f"at alpha {budget.alpha}{where or lengths}"
    if choice["coverage"] == "law":
        return f"largest error {_size(choice['max_abs'])} {where}, by law"
    certified = choice["certified"]
    alone = "" if certified is None else f"; the formula alone errs by at most {certified:.3g}, proven"
    return f"{_promise(choice, where, budget)}; {_measured(choice)}{alone}"


def _promise(choice: Mapping[str, Any], where: str, budget: Budget) -> str:
    if choice["bound"] is None:
        return f"nothing is promised {where}"
    most = f"errs by at most {_size(choice['bound'])} {where}"
    if choice["coverage"] == "contract":
        some = f", at {len(exponents_of(budget))} exponents of the range" if budget.alpha.continuous else ""
        return f"{most} {DEVICES}, proven{some}"
    if choice["coverage"] == "certified":
        return f"{most}, proven"
    if budget.alpha.continuous:
        return f"{most}, proven at {len(exponents_of(budget))} exponents of the range, with room for those between"
    return f"{most}: the worst that a search found, with the rounding that it may have missed"


def _measured(choice: Mapping[str, Any]) -> str:
    """The largest error that was measured, which is a lower bound."""
    error, how = f"{choice['max_abs']:.3g}", choice["error_coverage"]
    if how == "law":
        return f"the laws' bound of what runs here is {error}"
    if how == "sampled":
        return f"{error} was the largest of {choice['samples']:,} samples a stratum"
    return f"{error} was the worst that a search found" if how == "searched" else f"{error} was measured ({how})"


def _size(error: float) -> str:
    return f"{error:.3g} ({255 * error:.2g} 8-bit codes)"


def _cost(choice: Mapping[str, Any]) -> str:
    if choice["ratio"] is None:
        return f"about {choice['work']:.0f} operations an element, counted and not timed"
    if choice["cost_kind"] == "compiled":
        over = f"{choice['cost']:.3g} {choice['unit']} beyond the dot product on {choice['target']}"
        return f"{over}, {choice['ratio']:.3g} of exact Phong's, by the compiler; bound by {choice['bound_by']}"
    where = "" if choice["target"] == CPU else f" on {choice['target']}"
    return f"{choice['ratio']:.3g} of exact Phong's time{where} ({_interval(choice)})"


def _interval(choice: Mapping[str, Any]) -> str:
    return f"{choice['ratio_low']:.3g} .. {choice['ratio_high']:.3g} with 99 %"


def why(
    choice: Mapping[str, Any], other: Mapping[str, Any] | None, budget: Budget, resolved: bool, where: str = ""
) -> str:
    """Why it is chosen, and how sure it is that the next one is slower."""
    parts = [basis(choice, budget, where), f"within {budget.max_error:.4g}", _cost(choice)]
    if other is not None and choice["ratio"] is None:
        parts.append(f"the next, {other['name']}, takes about {other['work']:.0f}")
    elif other is not None and choice["cost_kind"] == "compiled":
        parts.append(f"the next, {other['name']}, takes {other['cost']:.3g} {other['unit']}")
    elif other is not None:
        sure = "surely slower" if resolved else "which is faster is not settled, the intervals overlap"
        parts.append(f"the next, {other['name']}, takes {other['ratio']:.3g} ({_interval(other)}): {sure}")
    return "; ".join(parts)


def why_missed(miss: Mapping[str, Any], budget: Budget, where: str = "") -> str:
    """How far a nearest miss is from the budget."""
    return f"{_beyond(miss, budget)}: {basis(miss, budget, where)}; {_cost(miss)}"


def answered(choice: Choice, budget: Budget, where: str = "", *, exact: bool | None = None) -> dict[str, Any]:
    """A choice as plain data, each row with its reason: `choices`, `nearest_miss`, and the `verdict` in a sentence.

    exact   whether exact Phong is within the budget, too; None where the choice is not one over it
    """
    choices = [plain(row, budget) for row in (choice.best, choice.runner_up) if row is not None]
    miss = None if choice.nearest_miss is None else plain(choice.nearest_miss, budget)
    for chosen, other in zip(choices, [*choices[1:], None], strict=False):
        chosen["why"] = why(chosen, other, budget, choice.resolved, where)
    if miss is not None:
        miss["why"] = why_missed(miss, budget, where)
    return {"choices": choices, "nearest_miss": miss, "verdict": _verdict(choices, choice.resolved, exact=exact)}


def _verdict(choices: list[dict[str, Any]], resolved: bool, *, exact: bool | None) -> str:
    """What to ship, in a sentence of at most 25 words."""
    if not choices:
        return "nothing meets the budget"
    best, other = choices[0], next(iter(choices[1:]), None)
    if best["approximation"] == BASELINE and exact is not None:
        return "exact Phong is the cheapest within the budget"
    if best["ratio"] is None:
        return f"{best['name']}: the fewest operations within the budget"
    if exact is not None and best["ratio_high"] >= 1:
        if exact:
            return "no measurable gain: ship exact Phong"
        return f"{best['name']}: no measurable gain, but exact Phong is not within the budget"
    if other is None or resolved or best["cost_kind"] == "compiled":
        return f"{best['name']}: the cheapest within the budget"
    if other["ratio"] < best["ratio"]:
        return f"{best['name']} and {other['name']} are tied in time: the first errs less"
    return f"{best['name']}, or {other['name']}, which is not surely slower"
