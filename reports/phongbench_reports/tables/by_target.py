"""The answer by target: at each exponent which formula to ship where."""

from collections.abc import Sequence
from dataclasses import replace

import pandas as pd

from phongbench.analysis.by_target import PRECISION, Answer, alike, answers, targets_of
from phongbench.analysis.rows import Rows, at, nearest
from phongbench.results.schema import CPU, GPU
from phongbench_reports.table import Absent, Table
from phongbench_reports.text import alpha_is, counted, listed, number

#: exponents that are shown, the nearest ones of the run
ALPHAS = (10.0, 20.0, 50.0, 100.0, 200.0, 1000.0)


def by_target(study: Rows, budget: float, name: str, only: Sequence[str] = ()) -> Table | Absent:
    """For some swept exponents the cheapest formula within the budget on each target, with its cost over exact Phong's.

    Targets that answer alike share a column.
    budget  largest absolute error allowed
    name    the budget in words, "1/255"
    only    these targets; without any, all that the run has costs of
    """
    targets = [target for target in targets_of(study.choices) if target in only or not only]
    if not [target for target in targets if target != CPU]:
        return Absent("This run has no costs on other targets.", "Run again: phongbench run keeps them.")
    if at(study.highlight, precision=PRECISION, space="reflect").empty:
        return Absent(f"Nothing was measured at {PRECISION}.", f"Run with --precision {PRECISION}.")
    alphas = sorted({nearest(study.alphas, alpha) for alpha in ALPHAS})
    found = answers(study.choices, targets, alphas, budget)
    withheld = bool(study.twin_differs)
    groups = alike(found)
    cells = {(answer.alpha, answer.target): answer for answer in found}
    rows = tuple(
        (f"{alpha:g}", *(_cell(cells[alpha, group[0]], withheld=withheld) for group in groups)) for alpha in alphas
    )
    headings = ("α", *(", ".join(group) for group in groups))
    data = pd.DataFrame([answer.as_dict() for answer in found])
    source = (
        f"{PRECISION}, unit vectors, formulas of (R, V); after each its cost over exact Phong's, dot product included"
    )
    return Table(
        headings, rows, data, _sentence(found, study.alpha, name), f"{source}; {_basis(study, targets)}", frozenset({0})
    )


def turned(answer: Table | Absent) -> Table | Absent:
    """The table with a row for each group of targets: there may be many of them, and a page is only so wide."""
    if isinstance(answer, Absent):
        return answer
    alphas, *columns = zip(*answer.rows, strict=True)
    rows = tuple((group, *cells) for group, cells in zip(answer.headings[1:], columns, strict=True))
    headings = ("target", *(alpha_is(float(alpha)) for alpha in alphas))
    return replace(answer, headings=headings, rows=rows, numeric=frozenset())


def _cell(answer: Answer, *, withheld: bool) -> str:
    if answer.row is None:
        return "nothing fits"
    timed = answer.target == CPU and withheld
    return f"{answer.formula}, {'withheld' if timed else number(answer.row['ratio'])}"


def _sentence(found: Sequence[Answer], alpha: float, name: str) -> str:
    """At how many exponents targets differ, and how at the usual one."""
    alphas = list(dict.fromkeys(answer.alpha for answer in found))
    apart = [a for a in alphas if len({answer.formula for answer in found if answer.alpha == a}) > 1]
    shown = nearest(alphas, alpha)
    ways: dict[str, list[str]] = {}
    for answer in found:
        if answer.alpha == shown:
            ways.setdefault(str(answer.formula or "nothing"), []).append(answer.target)
    told = listed(f"{formula} on {listed(targets)}" for formula, targets in ways.items())
    count = f"{len(apart)} of {counted(len(alphas), 'exponent')}"
    start = f"Within {name} the answer depends on the target at {count}"
    return f"{start}; at {alpha_is(shown)} it is {told}."


def _basis(study: Rows, targets: Sequence[str]) -> str:
    """How each target's costs were got."""
    rows = at(study.costs, target=tuple(targets)).drop_duplicates(["target"])
    tools: dict[str, list[str]] = {}
    for row in rows[rows["cost_kind"] == "compiled"].to_dict("records"):
        tools.setdefault(f"{row['tool']} ({row['tool_version']})", []).append(str(row["target"]))
    counted = "; ".join(f"{', '.join(names)} by {tool}" for tool, names in tools.items())
    adapter = [f"{GPU} by {row['tool']}" for row in at(rows, target=GPU).to_dict("records")]
    timed = ", ".join([f"{CPU} is timed", *adapter])
    return f"{timed}; the others are counted in what their compilers make: {counted}"
