"""Largest error of Lyon's formula against gamma: measured points over the closed-form law, a panel per lambda form."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from phongbench.formulas import error_laws
from phongbench.results.schema import CELL
from phongbench_reports.cuts import Absent, Study, nearest
from phongbench_reports.plots import STYLES, Plate, budget_lines, end_labels, footnote, log_axis, named_ticks, sheet
from phongbench_reports.reproduce import reproduce
from phongbench_reports.text import BUDGETS, basis, label, listed, number

#: Exponents drawn, the nearest ones of the run.
ALPHAS = (10.0, 20.0, 50.0, 200.0, 1000.0)
FORMS = ("dot", "difference", "cross")
#: gamma from which law 1 promises 1 %; at 2 it promises 4 %.
TRUSTED = 4


def measured(study: Study) -> pd.DataFrame:
    """Lyon rows with Taylor slope on unit vectors at the working precision, with the law beside the measured error."""
    rows = study.at(study.unit, approximation="lyon", beta_policy="taylor", precision=study.precision, space="reflect")
    rows = rows[rows["lambda_form"].isin(FORMS) & rows["gamma"].notna()].copy()
    alpha, gamma = rows["alpha"].to_numpy(np.float64), rows["gamma"].to_numpy(np.float64)
    predicted = [
        abs(error_laws.lyon_taylor(f, a, g)) for f, a, g in zip(rows["lambda_form"], alpha, gamma, strict=True)
    ]
    rows["law"] = np.array(predicted, dtype=np.float64)
    rows["off_by"] = rows["max_abs"] - rows["law"]
    columns = [*CELL, "alpha", "max_abs", "law", "off_by", "rounding_max", "samples", "coverage"]
    return rows[columns].sort_values(["lambda_form", "alpha", "gamma"], kind="stable").reset_index(drop=True)


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
        ends.append((high, float(law[-1]), f"α\u00a0=\u00a0{alpha:g}", colour))
    return ends


def _sentence(rows: pd.DataFrame, alphas: list[float]) -> str:
    """How far the law is off where it promises something, and the smallest gamma per exponent."""
    away = rows[(rows["gamma"] >= TRUSTED) & (rows["law"] > 1e-3)]
    dot = rows[rows["lambda_form"] == ("dot" if (rows["lambda_form"] == "dot").any() else rows["lambda_form"].iloc[0])]
    found = []
    for alpha in alphas:
        fits = dot[(dot["alpha"] == alpha) & (dot["max_abs"] <= BUDGETS[0][0])]["gamma"]
        found.append(f"α\u00a0=\u00a0{alpha:g}: " + (f"γ\u00a0=\u00a0{int(fits.min())}" if len(fits) else "none"))
    start = f"Smallest γ within 1/255 with Taylor slope, {dot['lambda_form'].iloc[0]} form: {'; '.join(found)}."
    if away.empty:
        return start
    relative = (away["off_by"] / away["law"]).abs().to_numpy(np.float64)
    at = away.iloc[int(relative.argmax())]
    where = f"{label(at)}, α\u00a0=\u00a0{at['alpha']:g}"
    return f"{start} The law is off by at most {100 * relative.max():.2g}\u00a0% over {len(away)} points ({where})."


def draw(study: Study) -> Plate | Absent:
    """Points on the law, log-log, with both code budgets."""
    data = measured(study)
    if data.empty:
        return Absent("The run holds no lyon rows with Taylor slope on unit vectors.", "Run with --only lyon.")
    swept = sorted(data["alpha"].unique())
    alphas = sorted({nearest(swept, wanted) for wanted in ALPHAS})
    forms = [form for form in FORMS if (data["lambda_form"] == form).any()]
    figure, panels = sheet(4.1, 1, len(forms), left=0.07, right=0.885, wspace=0.1, bottom=0.165, sharey=True)
    gammas = sorted(int(gamma) for gamma in data["gamma"].unique())
    for axes, form in zip(panels, forms, strict=True):
        log_axis(axes.yaxis)
        named_ticks(axes.xaxis, gammas, minor=[1.5 * gamma for gamma in gammas[:-1]])
        budget_lines(axes, named=axes is panels[0])
        ends = _panel(axes, data, form, alphas)
        axes.set_title(f"{form}")
        axes.set_xlabel("γ, exponent evaluated by squarings")
    panels[0].set_ylim(2e-4, 0.4)
    panels[0].set_ylabel("largest absolute error")
    end_labels(panels[-1], ends)
    told = basis(data)
    footnote(figure, f"points: measured, {study.precision}, unit vectors, Taylor slope; lines: closed-form law; {told}")
    alt = (
        f"Largest error of lyon against gamma on log-log axes for {listed(forms)}, points measured and lines the law: "
        + "; ".join(
            f"α = {alpha:g} from {number(part['max_abs'].iloc[0])} at γ = {int(part['gamma'].iloc[0])} "
            f"to {number(part['max_abs'].iloc[-1])} at γ = {int(part['gamma'].iloc[-1])}"
            for alpha, part in data[(data["lambda_form"] == forms[0]) & data["alpha"].isin(alphas)].groupby("alpha")
        )
        + f" ({forms[0]} form)."
    )
    command = reproduce(study, data)
    return Plate(figure, data, _sentence(data, alphas), alt, told, command)
