"""What a run says to ship: at each exponent the cheapest formula within one 8-bit code, equal answers together."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from phongbench.analysis.choice import promised
from phongbench.analysis.choices import Choices
from phongbench.analysis.error_budget import Budget
from phongbench.analysis.kernel_times import timed_precision
from phongbench.formulas.formula import Formula
from phongbench.formulas.user_files import installed
from phongbench.results.records import Records, by, first_of
from phongbench.results.schema import BASELINE, CELL

#: the error that is allowed: one code of an 8-bit display
BUDGET = 1 / 255


@dataclass(frozen=True)
class _Answer:
    """The answer at one exponent; `row` as of `choice.choose`, or of accuracy rows where nothing was timed."""

    alpha: float
    row: Mapping[str, Any] | None
    rival: str | None = None
    exact: bool = False

    @property
    def name(self) -> str | None:
        return None if self.row is None else str(Formula.of_row(self.row))


def verdict(choices: Choices, budget: float = BUDGET) -> dict[str, Any]:
    """What to ship, as plain data, in the precision that the run is judged at.

    budget      largest absolute error allowed; what is compared with it is a promise, as in `recommend`
    precision   judged at; timed_precision: whose times count, which is another one's where it is emulated
    timed       False where the run has no times: then a group names what errs least, by samples, and promises nothing
    withheld    identical code differed in time, so no claim to be faster is made
    groups      of neighbouring exponents with one answer, ascending: alphas; name, None where nothing is within the
                budget; bound, the largest error of them all, promised or sampled; ratio to exact Phong's time with its
                99 % interval; gain, whether that is surely below 1; exact, whether exact Phong is within the budget
                there, or None where that decides nothing; tied, the formula that the times do not tell it apart from
    """
    precision = choices.precision
    timed = bool(choices.timing.at(precision=timed_precision(precision)))
    answers = _timed(choices, precision, budget) if timed else _least(choices.mirrored.at(precision=precision))
    withheld = choices.working_set in choices.twin_differs
    groups = [_group(list(same)) for _, same in groupby(answers, key=lambda a: (a.name, a.rival, a.exact))]
    return {
        "precision": precision,
        "timed_precision": timed_precision(precision),
        "budget": budget,
        "working_set": choices.working_set or None,
        "timed": timed,
        "withheld": withheld,
        "groups": groups,
    }


def _timed(choices: Choices, precision: str, budget: float) -> list[_Answer]:
    """The choice of each exponent; where it is not surely faster than exact Phong, whether that one fits, too."""
    found = []
    for alpha in choices.alphas:
        choice = choices.choice(alpha, precision, budget)
        best, second = choice.best, choice.runner_up
        tied = best is not None and second is not None and second["ratio"] < best["ratio"]
        exact = best is not None and best["ratio_high"] >= 1 and _exact_fits(choices, alpha, precision, budget)
        rival = str(Formula.of_row(second)) if second is not None and tied else None
        found.append(_Answer(alpha, best, rival, exact))
    return found


def _exact_fits(choices: Choices, alpha: float, precision: str, budget: float) -> bool:
    """Whether exact Phong keeps the budget in this precision."""
    cells = choices.front(alpha, precision)
    judge = promised(Budget.of(alpha, budget, precision=precision), installed())
    kept = [judge(row, False) for row in cells if row["approximation"] == BASELINE]
    return any(one.kept and one.bound <= budget for one in kept)


def _least(errors: Records) -> list[_Answer]:
    """What errs least at each exponent, by samples."""
    rows = errors.at(nonfinite=0).rows([*CELL, "alpha", "max_abs", "coverage"])
    meant = [row for row in rows if row["approximation"] != BASELINE and row["max_abs"] is not None]
    first = first_of(sorted(meant, key=by(["alpha", "max_abs", *CELL, "coverage"])), ["alpha"])
    return [_Answer(row["alpha"], {**row, "bound": row["max_abs"]}) for row in first]


def _group(answers: list[_Answer]) -> dict[str, Any]:
    """Answers of neighbouring exponents that name one formula."""
    first, bounds = answers[0].row, [float(a.row["bound"]) for a in answers if a.row is not None]
    slowest = max((a.row for a in answers if a.row is not None), key=lambda row: row.get("ratio", 0), default={})
    times = {name: slowest.get(name) for name in ("ratio", "ratio_low", "ratio_high")}
    gain = times["ratio_high"] is not None and bool(times["ratio_high"] < 1)
    return {
        "alphas": [answer.alpha for answer in answers],
        "name": answers[0].name,
        "bound": max(bounds, default=None),
        "coverage": None if first is None else str(first["coverage"]),
        **times,
        "gain": gain,
        "exact": answers[0].exact if times["ratio_high"] is not None and not gain else None,
        "tied": answers[0].rival,
    }
