"""What notebooks show of a run: its answer by target as a table, and its front as a picture."""

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import pandas as pd

from phongbench.analysis.by_target import PRECISION, alike, answers, targets_of
from phongbench.analysis.choices import Choices
from phongbench.analysis.rows import nearest
from phongbench.analysis.summary import BUDGET, summarise
from phongbench.errors import InputError
from phongbench.results.runs import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: exponents of the table, the nearest ones of the run
ALPHAS = (10.0, 20.0, 50.0, 100.0, 200.0, 1000.0)
#: facts of a run that its table is headed by
_FACTS = ("run", "state", "preset", "alphas", "gammas", "precisions", "accuracy rows", "timing rows", "note")
#: what of its question a picture tells in its title
_ASKED = ("alpha", "precision", "target")


class Front(pd.DataFrame):
    """A front as a table that draws itself as the report does; what is cut of it is a plain DataFrame."""

    @classmethod
    def of(cls, table: pd.DataFrame) -> "Front":
        """The table with its picture."""
        made = cls(table)
        made.attrs = table.attrs
        return made

    def plot(self, axes: "Axes | None" = None) -> "Axes":  # type: ignore[override]  # pandas knows no front
        """Error against time with intervals: what is on the front, off it, or too close to call.

        axes     where to draw  [default: those of a new figure of pyplot, which a notebook shows]
        returns  matplotlib Axes
        Raises InputError where there is nothing to draw, or the reports are not installed.
        """
        if self.empty or "state" not in self:
            raise InputError("this table is no front", "plot", 'e.g. pb.load("latest").front(alpha=50).plot()')
        try:
            from phongbench_reports.figures.front import alone
            from phongbench_reports.plots import ink
        except ModuleNotFoundError as missing:
            fix = "python -m pip install . in a checkout brings both"
            raise InputError(f"figures need {missing.name}, which is not installed", "plot", fix) from missing
        with ink():
            if axes is None:
                from matplotlib import pyplot as plt

                axes = plt.subplots(figsize=(9.2, 3.4), layout="constrained")[1]
            title = ", ".join(f"{name} {self.attrs[name]}" for name in _ASKED if name in self.attrs)
            alone(axes, pd.DataFrame(self).rename(columns={"name": "label"}), title)
        return axes


def in_html(run: Run) -> str:
    """What a run measured, the cheapest formula within one 8-bit code by exponent and target, and links.

    Text of users is escaped, names of folders too.
    """
    summary = summarise(run)
    facts = {name: value for name, value in summary["facts"].items() if name in _FACTS}
    told = ((escape(str(name)), escape(str(value))) for name, value in facts.items())
    head = "".join(f"<tr><th>{name}</th><td>{value}</td></tr>" for name, value in told)
    return f"<table>{head}</table>{_answers(run) or pd.DataFrame(summary['best']).to_html(index=False)}{_links(run)}"


def _answers(run: Run) -> str:
    """The verdict table; "" for a run without float32 rows."""
    choices = Choices.of(run)
    if not choices.mirrored.at(precision=PRECISION):
        return ""
    alphas = sorted({nearest(choices.alphas, alpha) for alpha in ALPHAS})
    found = answers(choices, targets_of(choices), alphas, BUDGET)
    groups = alike(found)
    cells = {(one.alpha, one.target): one for one in found}
    lines = [("alpha", *(", ".join(group) for group in groups))]
    for alpha in alphas:
        shown = [cells[alpha, group[0]] for group in groups]
        lines.append((f"{alpha:g}", *(_cell(one.formula, one.row, choices) for one in shown)))
    head, *body = ("".join(f"<td>{escape(cell)}</td>" for cell in line) for line in lines)
    caption = "cheapest formula within 1/255, with its cost over exact Phong's; float32, unit vectors"
    rest = "".join(f"<tr>{line}</tr>" for line in body)
    return f"<table><caption>{caption}</caption><thead><tr>{head.replace('td>', 'th>')}</tr></thead>{rest}</table>"


def _cell(formula: Any, row: Any, choices: Choices) -> str:
    if row is None:
        return "nothing fits"
    timed = row.get("unit") == "ns" and choices.twin_differs
    return f"{formula} {'withheld' if timed else format(float(row['ratio']), '.3g')}"


def _links(run: Run) -> str:
    """The report where there is one, and what comes next."""
    page = run.path / "report" / "index.html"
    here = Path.cwd()
    path = page.relative_to(here) if page.is_absolute() and page.is_relative_to(here) else page
    shown = f'<a href="{escape(quote(path.as_posix()))}">Report</a>' if page.is_file() else "No report yet: .report()"
    return f"<p>{shown} · .front(alpha=50).plot() · .recommend(alpha=50, max_error=1/255)</p>"
