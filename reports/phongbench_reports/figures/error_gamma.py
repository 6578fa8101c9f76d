"""Largest error of Lyon's formula against gamma: measured points over the closed-form law, a panel per lambda form."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from phongbench.analysis.rows import Rows, nearest, ordered
from phongbench.formulas import error_laws
from phongbench.results.schema import CELL
from phongbench_reports.figures.measured import finished, lyon
from phongbench_reports.plots import STYLES, Plate, budget_lines, end_labels, sheet
from phongbench_reports.table import Absent
from phongbench_reports.text import BUDGETS, alpha_is, gamma_is, label, listed, number, share
from phongbench_reports.ticks import log_axis, named_ticks

#: Exponents drawn, the nearest ones of the run.
ALPHAS = (10.0, 20.0, 50.0, 200.0, 1000.0)
FORMS = ("dot", "difference", "cross")
#: gamma from which law 1 promises 1 %; at 2 it promises 4 %.
TRUSTED = 4


def measured(study: Rows) -> pd.DataFrame:
    """Lyon rows with Taylor slope on unit vectors at the working precision, with the law beside the measured error."""
    rows = lyon(study.highlight, precision=study.precision, lambda_form=FORMS)
    points = zip(rows["lambda_form"], rows["alpha"].astype(float), rows["gamma"].astype(float), strict=True)
    law = np.array([abs(error_laws.lyon_taylor(*point)) for point in points], dtype=np.float64)
    rows = rows.assign(law=law, off_by=rows["max_abs"] - law)
    columns = [*CELL, "alpha", "max_abs", "law", "off_by", "rounding_max", "samples", "coverage"]
    return ordered(rows[columns], ["lambda_form", "alpha", "gamma"])


def _panel(axes: Axes, rows: pd.DataFrame, form: str, alphas: list[float]) -> list[tuple[float, float, str, str]]:
    """Law as lines, measurements as points; returns the lines' ends for their labels."""
    ends = []
    low, high = float(rows["gamma"].min()), float(rows["gamma"].max())
    fine = np.geomspace(low, high, 241)
    for alpha, (colour, marker, dash) in zip(alphas, STYLES, strict=False):
        mine = rows[(rows["lambda_form"] == form) & (rows["alpha"] == alpha)]
        law = np.maximum(np.abs(np.asarray(error_laws.lyon_taylor(form, np.full_like(fine, alpha), fine))), 1e-6)
        axes.plot(fine, law, color=colour, linestyle=dash, linewidth=1.2)
        axes.plot(mine["gamma"], mine["max_abs"].clip(lower=1e-6), color=colour, marker=marker, linestyle="none")
        ends.append((high, float(law[-1]), alpha_is(alpha), colour))
    return ends


def _sentence(rows: pd.DataFrame, alphas: list[float]) -> str:
    """How far the law is off where it promises something, and the smallest gamma per exponent."""
    away = rows[(rows["gamma"] >= TRUSTED) & (rows["law"] > 1e-3)]
    dot = rows[rows["lambda_form"] == ("dot" if (rows["lambda_form"] == "dot").any() else rows["lambda_form"].iloc[0])]
    smallest = []
    for alpha in alphas:
        fits = dot[(dot["alpha"] == alpha) & (dot["max_abs"] <= BUDGETS[0][0])]["gamma"]
        smallest.append(f"{alpha_is(alpha)}: {gamma_is(fits.min()) if len(fits) else 'none'}")
    start = (
        f"Smallest γ sampled below 1/255 with Taylor slope, {dot['lambda_form'].iloc[0]} form: {'; '.join(smallest)}."
    )
    if away.empty:
        return start
    relative = (away["off_by"] / away["law"]).abs().to_numpy(np.float64)
    at = away.iloc[int(relative.argmax())]
    where = f"{label(at)}, {alpha_is(at['alpha'])}"
    return f"{start} The law is off by at most {share(relative.max(), 2)} over {len(away)} points ({where})."


def draw(study: Rows) -> Plate | Absent:
    """Points on the law, log-log, with both code budgets."""
    data = measured(study)
    if data.empty:
        return Absent("The run holds no lyon rows with Taylor slope on unit vectors.", "Run with --only lyon.")
    swept = sorted(data["alpha"].unique())
    alphas = sorted({nearest(swept, wanted) for wanted in ALPHAS})
    forms = [form for form in FORMS if (data["lambda_form"] == form).any()]
    figure, panels = sheet(4.1, 1, len(forms), left=0.08, right=0.885, wspace=0.1, bottom=0.165, sharey=True)
    gammas = sorted(int(gamma) for gamma in data["gamma"].unique())
    for axes, form in zip(panels, forms, strict=True):
        log_axis(axes.yaxis)
        named_ticks(axes.xaxis, gammas, minor=[1.5 * gamma for gamma in gammas[:-1]])
        budget_lines(axes, named=axes is panels[0])
        ends = _panel(axes, data, form, alphas)
        axes.set_title(form)
        axes.set_xlabel("γ, exponent evaluated by squarings")
    panels[0].set_ylim(2e-4, 0.4)
    panels[0].set_ylabel("largest absolute error")
    end_labels(panels[-1], ends)
    note = f"points: measured, {study.precision}, unit vectors, Taylor slope; lines: closed-form law"
    return finished(study, figure, data, note, _sentence(data, alphas), _alt(data, forms, alphas))


def _alt(data: pd.DataFrame, forms: list[str], alphas: list[float]) -> str:
    shown = data[(data["lambda_form"] == forms[0]) & data["alpha"].isin(alphas)]
    ends = [(alpha, part.iloc[0], part.iloc[-1]) for alpha, part in shown.groupby("alpha")]
    parts = "; ".join(
        f"{alpha_is(alpha)} from {number(first['max_abs'])} at {gamma_is(first['gamma'])} "
        f"to {number(last['max_abs'])} at {gamma_is(last['gamma'])}"
        for alpha, first, last in ends
    )
    return (
        f"Largest error of lyon against gamma on log-log axes for {listed(forms)}, points measured and lines the law: "
        f"{parts} ({forms[0]} form)."
    )
