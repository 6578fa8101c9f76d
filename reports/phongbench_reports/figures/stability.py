"""Error against the length error of the vectors, one series per lambda form, with the law of lengths drawn over it."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from phongbench.analysis import length_sensitivity
from phongbench.analysis.rows import STABILITY_ALPHA, Rows, nearest, ordered
from phongbench.results.schema import CELL
from phongbench_reports.figures.measured import finished, lyon, setting_of
from phongbench_reports.plots import FORMS, MUTED, SURFACE, Plate, budget_lines, end_labels, sheet
from phongbench_reports.table import Absent
from phongbench_reports.text import alpha_is, listed, number, records
from phongbench_reports.ticks import log_axis

#: How the lengths err, as the perturbation column names it, and in words.
WAYS = {"a": "one vector", "both": "both alike", "opposite": "both, opposite"}


def rows_of(study: Rows) -> pd.DataFrame:
    """Lyon with Taylor slope at one exponent and one gamma on vectors of the wrong length."""
    rows = lyon(
        study.lengths[study.lengths["length_error"] != 0.0],
        alpha=STABILITY_ALPHA,
        gamma=64,
        gated=True,
        precision=study.precision,
        perturbation=tuple(WAYS),
        lambda_form=tuple(FORMS),
    )
    errors = ["length_max", "rounding_max", "max_abs", "samples", "coverage"]
    columns = [*CELL, "alpha", "perturbation", "length_error", *errors]
    return ordered(rows[columns], ["perturbation", "lambda_form", "length_error"])


def slopes(rows: pd.DataFrame) -> dict[str, tuple[float, float]]:
    """Form -> (fitted exponent, the law's fitted alike) of change ~ length error^p, for rows of one way."""
    fitted = length_sensitivity.fits(rows.assign(stratum="lengths", truth="angle", gated=True))
    return {str(row["lambda_form"]): (row["exponent"], row["law_exponent"]) for row in records(fitted)}


def _series(axes: Axes, part: pd.DataFrame, column: str, look: tuple[str, str, Any], *, joined: bool) -> None:
    """Too long filled, too short hollow, over the size of the length error."""
    colour, marker, dash = look
    for too_long in (True, False):
        mine = part[(part["length_error"] > 0) == too_long].sort_values("length_error", key=abs, kind="stable")
        axes.plot(
            mine["length_error"].abs(),
            mine[column].clip(lower=1e-8),
            color=colour,
            marker=marker,
            linestyle=dash if joined and too_long else "none",
            markerfacecolor=colour if too_long else SURFACE,
            linewidth=1.1,
            zorder=3 if too_long else 2.8,
        )


def _column(upper: Axes, lower: Axes, rows: pd.DataFrame, way: str) -> dict[str, list[tuple[float, float, str, str]]]:
    alpha, gamma = float(rows["alpha"].iloc[0]), float(rows["gamma"].iloc[0])
    sizes = rows["length_error"].abs()
    fine = np.geomspace(float(sizes.min()), float(sizes.max()), 121)
    ends: dict[str, list[tuple[float, float, str, str]]] = {"length_max": [], "max_abs": []}
    for form, look in FORMS.items():
        part = rows[(rows["lambda_form"] == form) & (rows["perturbation"] == way)]
        if part.empty:
            continue
        drawn = length_sensitivity.law(form, way, alpha, gamma, fine)
        if drawn is not None:
            upper.plot(fine, np.maximum(drawn, 1e-8), color=look[0], linestyle=look[2], linewidth=1.1)
        _series(upper, part, "length_max", look, joined=drawn is None)
        _series(lower, part, "max_abs", look, joined=True)
        last = part[part["length_error"] > 0].sort_values("length_error", kind="stable").tail(1)
        for column in ends if len(last) else ():
            ends[column].append((float(last["length_error"].iloc[0]), float(last[column].iloc[0]), form, look[0]))
    return ends


def draw(study: Rows) -> Plate | Absent:
    """Upper row: what the lengths alone change, with the law; lower row: the whole error against the true angle."""
    data = rows_of(study)
    if data.empty:
        return Absent("The run holds no lyon rows on vectors of the wrong length.", "Run with --only lyon.")
    ways = [way for way in WAYS if (data["perturbation"] == way).any()]
    margins = {"left": 0.075, "right": 0.895, "wspace": 0.08, "hspace": 0.1, "top": 0.905, "bottom": 0.115}
    figure, panels = sheet(6.4, 2, len(ways), sharex=True, sharey="row", **margins)
    for column, way in enumerate(ways):
        upper, lower = panels[column], panels[len(ways) + column]
        log_axis(upper.xaxis)
        for axes in (upper, lower):
            log_axis(axes.yaxis)
            budget_lines(axes, named=column == 0)
        ends = _column(upper, lower, data, way)
        _name_slopes(upper, data[data["perturbation"] == way])
        upper.set_title(WAYS[way], pad=25)
        lower.set_xlabel("relative length error")
        upper.set_ylim(1e-6, 30.0)
        lower.set_ylim(1e-5, 30.0)
    end_labels(upper, ends["length_max"])
    end_labels(lower, ends["max_abs"])
    panels[0].set_ylabel("change by the lengths alone")
    panels[len(ways)].set_ylabel("largest absolute error")
    note = f"{setting_of(study, data)}; filled: too long, hollow: too short; lines above: law of lengths"
    return finished(study, figure, data, note, _sentence(data), _alt(data, ways))


def _name_slopes(axes: Axes, rows: pd.DataFrame) -> None:
    fitted = slopes(rows)
    forms = [form for form in FORMS if form in fitted]
    if not forms:
        return
    measured = ", ".join(f"{form} {fitted[form][0]:.2f}" for form in forms)
    by_law = ", ".join(f"{fitted[form][1]:.2f}" for form in forms)
    look: dict[str, Any] = {"fontsize": 7.5, "color": MUTED, "va": "bottom", "transform": axes.transAxes}
    axes.text(0.0, 1.02, f"slopes: {measured}\nby the law: {by_law}", **look)


def _sentence(data: pd.DataFrame) -> str:
    """Each form's error with one vector one percent too long, and the slopes of small length errors."""
    way = "a" if (data["perturbation"] == "a").any() else str(data["perturbation"].iloc[0])
    rows = data[data["perturbation"] == way]
    at = nearest(sorted(rows.loc[rows["length_error"] > 0, "length_error"].unique()), 0.01)
    one = rows[rows["length_error"] == at].sort_values("max_abs", kind="stable")
    errors = listed(f"{row['lambda_form']} {number(row['max_abs'])}" for row in records(one))
    fitted = slopes(rows)
    powers = listed(f"{fitted[f][0]:.2f} ({f}, by the law {fitted[f][1]:.2f})" for f in FORMS if f in fitted)
    sentence = f" Small length errors e change the highlight like e to the power {powers}." if fitted else ""
    best = one.iloc[0]["lambda_form"]
    return (
        f"With {WAYS[way]} {number(100 * at)}\u00a0% too long at {alpha_is(data['alpha'].iloc[0])}, "
        f"{best} errs least: {errors}.{sentence}"
    )


def _alt(data: pd.DataFrame, ways: list[str]) -> str:
    parts = []
    for way in ways:
        rows = data[(data["perturbation"] == way) & (data["length_error"] > 0)]
        top = rows.sort_values("length_error", kind="stable").groupby("lambda_form", sort=True).tail(1)
        sizes = ", ".join(
            f"{row['lambda_form']} {number(row['max_abs'])}" for row in records(top.sort_values("lambda_form"))
        )
        parts.append(f"{WAYS[way]}: {sizes} at {number(100 * float(rows['length_error'].max()))} %")
    return f"Log-log charts of error against relative length error per lambda form. Largest errors: {'; '.join(parts)}."
