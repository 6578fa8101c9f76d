"""Rounding error of each lambda form over the exponent, one panel per precision."""

import pandas as pd
from matplotlib.axes import Axes

from phongbench.analysis.rows import STABILITY_ALPHA, Rows, nearest, ordered
from phongbench.compiler.precisions import in_order
from phongbench.results.schema import CELL
from phongbench_reports.figures.measured import finished, lyon
from phongbench_reports.plots import FORMS, Plate, budget_lines, end_labels, sheet
from phongbench_reports.table import Absent
from phongbench_reports.text import alpha_is, gamma_is, listed, number, records
from phongbench_reports.ticks import log_axis


def rows_of(study: Rows) -> pd.DataFrame:
    """Lyon with Taylor slope and the gamma nearest to 32, unit vectors, every precision of the run."""
    measured = study.highlight[study.highlight["rounding_max"].notna()]  # float64's rounding is not measured
    columns = [*CELL, "alpha", "rounding_max", "max_abs", "model_max", "samples", "coverage"]
    rows = lyon(measured, gamma=32, lambda_form=tuple(FORMS))[columns]
    return ordered(rows, ["precision", "lambda_form", "alpha"])


def _panel(axes: Axes, rows: pd.DataFrame) -> list[tuple[float, float, str, str]]:
    ends = []
    for form, (colour, marker, dash) in FORMS.items():
        mine = rows[rows["lambda_form"] == form]
        if len(mine):
            size = mine["rounding_max"].clip(lower=1e-17)
            axes.plot(mine["alpha"], size, color=colour, marker=marker, linestyle=dash)
            ends.append((float(mine["alpha"].iloc[-1]), float(size.iloc[-1]), form, colour))
    return ends


def draw(study: Rows) -> Plate | Absent:
    """Rounding part of the error against alpha, log-log, both code budgets."""
    data = rows_of(study)
    if data.empty:
        return Absent("The run holds no lyon rows on unit vectors.", "Run with --only lyon.")
    precisions = list(in_order(data["precision"].unique()))
    figure, panels = sheet(3.7, 1, len(precisions), left=0.075, right=0.895, wspace=0.34, bottom=0.185)
    for axes, name in zip(panels, precisions, strict=True):
        log_axis(axes.xaxis)
        log_axis(axes.yaxis)
        budget_lines(axes, side="right")
        ends = _panel(axes, data[data["precision"] == name])
        low, high = axes.get_ylim()
        axes.set_ylim(low / 1.5, max(high, 1e-2))
        end_labels(axes, ends, gap=0.075)
        axes.set_title(name)
        axes.set_xlabel("α, exact exponent")
    panels[0].set_ylabel("rounding part of the largest error")
    note = f"lyon, {gamma_is(data['gamma'].iloc[0])}, Taylor slope, unit vectors, stratum highlight"
    return finished(study, figure, data, note, _sentence(data, precisions), _alt(data, precisions))


def _sentence(data: pd.DataFrame, precisions: list[str]) -> str:
    alpha = nearest(sorted(data["alpha"].unique()), STABILITY_ALPHA)
    parts = []
    for name in precisions:
        rows = data[(data["precision"] == name) & (data["alpha"] == alpha)].sort_values("rounding_max", kind="stable")
        sizes = listed(f"{number(255 * row['rounding_max'])} ({row['lambda_form']})" for row in records(rows))
        parts.append(f"{name} {sizes}")
    where = f"lyon, {gamma_is(data['gamma'].iloc[0])}, at {alpha_is(alpha)}"
    return f"Rounding of {where}, in 8-bit codes: {'; '.join(parts)}."


def _alt(data: pd.DataFrame, precisions: list[str]) -> str:
    parts = []
    for name in precisions:
        rows = data[data["precision"] == name]
        for form, mine in rows.groupby("lambda_form", sort=True):
            first, last = mine.iloc[0], mine.iloc[-1]
            parts.append(
                f"{name} {form} from {number(first['rounding_max'])} at {alpha_is(first['alpha'])} "
                f"to {number(last['rounding_max'])} at {alpha_is(last['alpha'])}"
            )
    return f"Log-log charts of the rounding error against alpha: {'; '.join(parts)}."
