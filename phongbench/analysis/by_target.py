"""The answer to an error budget for each target beside one another: which formula to ship where."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from phongbench.analysis.choice import Judge, promised, remembered
from phongbench.analysis.choices import Choices
from phongbench.analysis.error_budget import Budget
from phongbench.analysis.front import errors_at, framed, judged
from phongbench.analysis.target_costs import Price, own_prices, priced, prices, table_of, unit_of
from phongbench.formulas.formula import Formula
from phongbench.formulas.user_files import installed
from phongbench.results.records import Row
from phongbench.results.runs import DEFAULT_ROOT
from phongbench.results.schema import CPU, GPU
from phongbench.targets.chips import TARGETS

if TYPE_CHECKING:
    import pandas as pd

#: the precision of compiled costs
PRECISION = "float32"


@dataclass(frozen=True)
class Answer:
    """The cheapest formula within a budget at one exponent on one target.

    row  of `priced` cells, with `bound` and `coverage` as they are promised; None where nothing is within the budget,
         or nothing was timed
    """

    alpha: float
    target: str
    row: Mapping[str, Any] | None

    @property
    def formula(self) -> Formula | None:
        """What it names."""
        return None if self.row is None else Formula.of_row(self.row)

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        names = ("cost", "unit", "cost_kind", "ratio", "ratio_low", "ratio_high", "bound_by", "bound", "coverage")
        row = self.row or {}
        told = {name: row.get(name) for name in names}
        formula = self.formula
        more = {"normalise": formula.normalise, "recipe": formula.recipe} if formula else {}
        return {"alpha": self.alpha, "target": self.target, "name": str(formula) if formula else None, **told, **more}


def targets_of(choices: Choices) -> list[str]:
    """The targets that a run has costs of, in the order of the list of targets; GPU if its times have intervals."""
    costs = choices.costs.rows(["target", "ratio_low"])
    known = {row["target"] for row in costs} - {GPU}
    known |= {GPU for row in costs if row["target"] == GPU and row["ratio_low"] is not None}
    timed = [CPU] if choices.timing.at(precision=PRECISION) else []
    return [*timed, *(name for name in (GPU, *TARGETS) if name in known)]


def answers(
    choices: Choices, targets: Sequence[str], alphas: Iterable[float], budget: float, root: Path = DEFAULT_ROOT
) -> list[Answer]:
    """The answer at each exponent on each target, formulas of (R, V) in float32 on unit vectors.

    budget  largest absolute error allowed; what is compared with it is a promise, as in `recommend`
    root    the folder of the runs, in which measured targets were added
    """
    found = []
    own = {target: own_prices(choices.costs, target, None) for target in targets}
    for alpha in alphas:
        # of others no code need be written
        near = [row for row in errors_of(choices, alpha) if row["error"] is not None and row["error"] <= budget]
        formulas = [Formula.of_row(row) for row in near]
        judge = remembered(promised(Budget.of(alpha, budget, precision=PRECISION), installed()))
        for target in targets:
            if target == CPU:
                timed = choices.choice(alpha, PRECISION, budget).best
                row = None if timed is None else {**timed, "cost": timed["ns"], **unit_of(CPU)}
            else:
                told = prices(formulas, (alpha,), table_of(target, root), own=own[target])
                row = cheapest(zip(told, near, strict=True), judge, budget, unit_of(target, root))
            found.append(Answer(alpha, target, row))
    return found


def cheapest(
    cells: Iterable[tuple[Price | None, Row]], judge: Judge, budget: float, unit: Mapping[str, str]
) -> dict[str, Any] | None:
    """The cheapest cell whose bound is within the budget, with its price; of equally cheap ones that errs least.

    cells  in the order of their names; those without a price are left out
    """
    known = [(price, row) for price, row in cells if price is not None]
    for price, row in sorted(known, key=lambda cell: (cell[0].ratio, cell[0].alone, cell[1]["error"])):
        kept = judge(row, False)
        if kept.kept and kept.bound <= budget:
            sharp = min(judge(row, True), kept, key=lambda one: one.bound)
            ends = {"ratio": price.ratio, "ratio_low": price.low, "ratio_high": price.high}
            cost = {"cost": price.cost, "bound_by": price.bound_by, **unit}
            return {**row, **ends, **cost, "bound": sharp.bound, "coverage": sharp.coverage}
    return None


def errors_of(choices: Choices, alpha: float) -> list[Row]:
    """Formulas of (R, V) with their largest sampled error at an exponent."""
    return errors_at(choices.mirrored, alpha=alpha, precision=PRECISION)


def front_on(choices: Choices, target: str, alpha: float, cells: Sequence[Row]) -> "pd.DataFrame":
    """The front of a compiled target at an exponent, of the cells of `errors_of`, as `front.points` gives it."""
    own = own_prices(choices.costs, target, None)
    return framed(judged(priced(cells, (alpha,), target, None, [], own=own)))


def alike(found: Sequence[Answer]) -> list[list[str]]:
    """The targets in groups that answer alike, in formula and ratio, at every exponent; in their order."""
    groups: dict[tuple[Any, ...], list[str]] = {}
    for target in dict.fromkeys(answer.target for answer in found):
        mine = [answer for answer in found if answer.target == target]
        key = tuple((a.alpha, a.formula, None if a.row is None else round(float(a.row["ratio"]), 3)) for a in mine)
        groups.setdefault(key, []).append(target)
    return list(groups.values())
