"""Error against gamma for every precision of a run: squaring multiplies rounding, so each width has its best gamma."""

import pandas as pd
from matplotlib.axes import Axes

from phongbench.analysis.rows import Rows, ordered
from phongbench.compiler.precisions import in_order
from phongbench.results.schema import CELL
from phongbench_reports.figures.measured import finished, lyon
from phongbench_reports.plots import STYLES, Plate, budget_lines, end_labels, sheet
from phongbench_reports.table import Absent
from phongbench_reports.text import alpha_is, gamma_is, listed, number, records
from phongbench_reports.ticks import log_axis

#: Lambda forms that get a panel, in order.
SHOWN = ("dot", "difference", "cross")


def rows_of(study: Rows) -> pd.DataFrame:
    """Lyon with Taylor slope at the headline exponent on unit vectors: every form, gamma and precision."""
    columns = [*CELL, "alpha", "max_abs", "model_max", "rounding_max", "samples", "coverage"]
    rows = lyon(study.highlight, alpha=study.alpha, lambda_form=SHOWN)[columns]
    rows = ordered(rows, ["lambda_form", "precision", "gamma"])
    best = rows.groupby(["lambda_form", "precision"])["max_abs"].transform("min")
    return rows.assign(best=rows["max_abs"] == best)


def _panel(axes: Axes, rows: pd.DataFrame, precisions: tuple[str, ...]) -> list[tuple[float, float, str, str]]:
    ends = []
    for index, precision in enumerate(precisions):
        colour, marker, dash = STYLES[index % len(STYLES)]
        mine = rows[rows["precision"] == precision]
        if mine.empty:
            continue
        gammas = mine["gamma"].astype(float)
        axes.plot(gammas, mine["max_abs"], color=colour, marker=marker, linestyle=dash, markersize=3.5)
        best = mine[mine["best"]].iloc[:1]
        axes.plot(
            best["gamma"].astype(float),
            best["max_abs"],
            color=colour,
            marker="o",
            markersize=11,
            linestyle="none",
            markerfacecolor="none",
            markeredgewidth=1.4,
        )
        ends.append((float(gammas.iloc[-1]), float(mine["max_abs"].iloc[-1]), precision, colour))
    return ends


def draw(study: Rows) -> Plate | Absent:
    """One panel a lambda form, one line a precision; a ring around each line's best gamma."""
    data = rows_of(study)
    if data["gamma"].nunique() < 2:
        return Absent("The run holds fewer than two gammas of lyon on unit vectors.", "Run with --only lyon.")
    precisions = in_order(data["precision"].unique())
    forms = [form for form in SHOWN if (data["lambda_form"] == form).any()]
    figure, panels = sheet(3.9, 1, len(forms), right=0.9, wspace=0.08, bottom=0.185, sharey=True)
    gammas = sorted(int(gamma) for gamma in data["gamma"].unique())
    for axes, form in zip(panels, forms, strict=True):
        log_axis(axes.yaxis)
        axes.set_xscale("log", base=2)
        axes.set_xticks(gammas, labels=[str(gamma) for gamma in gammas])
        axes.set_xticks([], minor=True)
        budget_lines(axes, named=axes is panels[0])
        ends = _panel(axes, data[data["lambda_form"] == form], precisions)
        axes.set_title(form)
        axes.set_xlabel("γ = 2ⁿ")
    end_labels(panels[-1], ends, gap=0.07)
    panels[0].set_ylabel("largest absolute error")
    note = f"lyon, {alpha_is(study.alpha)}, Taylor slope, unit vectors, stratum highlight; ring: best γ"
    return finished(study, figure, data, note, _sentence(data, precisions), _alt(data))


def _form(data: pd.DataFrame) -> str:
    """The form that the sentence speaks of: the one whose lambda keeps its digits, where it was measured."""
    return next(form for form in ("difference", "cross", "dot") if (data["lambda_form"] == form).any())


def _sentence(data: pd.DataFrame, precisions: tuple[str, ...]) -> str:
    form = _form(data)
    parts = []
    for name in precisions:
        mine = data[(data["precision"] == name) & (data["lambda_form"] == form) & data["best"]]
        for row in records(mine.iloc[:1]):
            codes = number(255 * row["max_abs"])
            parts.append(f"{name} {gamma_is(row['gamma'])} ({codes} codes)")
    return f"Best γ of the {form} form at {alpha_is(data['alpha'].iloc[0])}: {listed(parts)}."


def _alt(data: pd.DataFrame) -> str:
    parts = []
    for (form, precision), mine in data.groupby(["lambda_form", "precision"], sort=True):
        best = mine[mine["best"]].iloc[0]
        parts.append(f"{form} in {precision}: {number(best['max_abs'])} at {gamma_is(best['gamma'])}")
    return f"Log-log charts of the largest error against gamma. Smallest errors: {'; '.join(parts)}."
