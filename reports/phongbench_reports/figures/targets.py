"""Error against cost on every target: a panel for each front, all on the same axes."""

import math

import pandas as pd

from phongbench.analysis.by_target import PRECISION, errors_of, front_on, targets_of
from phongbench.analysis.rows import Rows, at
from phongbench.results.schema import CPU
from phongbench_reports.figures.front import FLOOR, edge, marks, names
from phongbench_reports.plots import INK, Plate, budget_lines, footnote, sheet
from phongbench_reports.table import Absent
from phongbench_reports.text import BUDGETS, alpha_is, basis, label, listed, number, records
from phongbench_reports.ticks import log_axis, named_ticks, octaves

COLUMNS = 3
#: names in a panel, how far apart in its heights, and how wide a letter is in its widths
NAMED, GAP, LETTER = 4, 0.1, 0.024
#: letters of a title that a panel is wide
WIDEST = 36
#: what a cost is, by its unit
UNITS = {"ns": "time, measured", "cycles": "cycles, counted", "slots": "issue slots, counted"}


def fronts(study: Rows) -> pd.DataFrame:
    """Formulas at the run's middle exponent on each target, with error, ratio and state; `panel` groups like ones."""
    frames, wrong = [], errors_of(study.choices, study.alpha)
    for target in targets_of(study.choices):
        timed = target == CPU
        cells = study.front(study.alpha, PRECISION) if timed else front_on(study.choices, target, study.alpha, wrong)
        frames.append(cells.assign(target=target, unit="ns" if timed else cells["unit"], alpha=study.alpha))
    frames = [frame for frame in frames if len(frame)]
    panels: dict[object, list[str]] = {}
    for frame in frames:
        best = frame[frame["state"] == "on"]
        shape = tuple(zip(map(label, records(best)), best["ratio"].round(3), strict=True)), frame["unit"].iloc[0]
        panels.setdefault(shape, []).append(str(frame["target"].iloc[0]))
    named = {target: ", ".join(group) for group in panels.values() for target in group}
    data = pd.concat(frames, ignore_index=True) if frames else pd.DataFrame()
    return data.assign(panel=data["target"].map(named), label=[label(r) for r in records(data)]) if frames else data


def draw(study: Rows) -> Plate | Absent:
    """One panel for each front; error on a log axis, cost as a ratio to exact Phong on the same target."""
    if at(study.highlight, precision=PRECISION, space="reflect").empty:
        return Absent(f"Nothing was measured at {PRECISION}.", f"Run with --precision {PRECISION}.")
    if set(targets_of(study.choices)) <= {CPU}:
        return Absent("This run has no costs on other targets.", "Run again: phongbench run keeps them.")
    data = fronts(study)
    shown = list(dict.fromkeys(data["panel"]))
    count = math.ceil(len(shown) / COLUMNS)
    height = 0.85 + 2.3 * count
    margins = {"top": 1 - 0.33 / height, "bottom": 0.72 / height, "hspace": 0.3, "wspace": 0.08}
    columns = min(COLUMNS, len(shown))
    figure, panels = sheet(height, count, columns, left=0.085, right=0.99, sharex=True, sharey=True, **margins)
    log_axis(panels[0].xaxis, labels=5)
    low, high = float(data["ratio"].min()), max(float(data["ratio"].max()), 1.0) * 1.35
    named_ticks(panels[0].yaxis, octaves(low / 1.5, high))
    panels[0].set(xlim=(FLOOR / 2, 1.0), ylim=(low / (high / low) ** 0.45, high))
    for place, (axes, panel) in enumerate(zip(panels, shown, strict=False)):
        part = data[(data["panel"] == panel) & (data["target"] == panel.split(", ")[0])]
        budget_lines(axes, vertical=True, named=place == 0)
        axes.axhline(1.0, color=INK, linewidth=0.8)
        marks(axes, part)
        names(axes, part, gap=GAP, letter=LETTER, most=NAMED)
        axes.set_title(_titled(panel, part["unit"].iloc[0]), fontsize=8.5)
        axes.set_ylabel("cost / exact Phong" if place % columns == 0 else "")
        axes.set_xlabel("largest absolute error" if place + columns >= len(shown) else "")
        axes.tick_params(labelbottom=place + columns >= len(shown))
    panels[0].legend(loc="lower left", fontsize=7.5, handletextpad=0.2, borderaxespad=0.1, labelspacing=0.25)
    for axes in panels[len(shown) :]:
        axes.set_axis_off()
    rows = at(study.highlight, space="reflect", precision=PRECISION, alpha=study.alpha)
    source = f"{basis(rows)}; cost with the dot product, over exact Phong's there; of like fronts the first target's"
    footnote(figure, f"{PRECISION}, {alpha_is(study.alpha)}, unit vectors; {source}")
    command = f"phongbench run --alpha {study.alpha:g} --precision {PRECISION}"
    return Plate(figure, data.drop(columns="cost_alone", errors="ignore"), _sentence(data), _alt(data), source, command)


def _titled(panel: str, unit: str) -> str:
    """The targets of a panel and what their costs are; many names take two lines."""
    targets = panel.split(", ")
    lines = [", ".join(part) for part in (targets[:4], targets[4:]) if part]
    told = f"({UNITS.get(unit, unit)})"
    return ",\n".join(lines) + (" " if len(f"{lines[-1]} {told}") <= WIDEST else "\n") + told


def _sentence(data: pd.DataFrame) -> str:
    """How many fronts there are, and the cheapest formula of each whose samples stay within a budget."""
    budget, name = BUDGETS[0]
    best: dict[str, list[str]] = {}
    for panel, rows in data[data["error"] <= budget].groupby("panel", sort=False):
        first = rows.sort_values(["ratio", "error"], kind="stable").iloc[0]
        best.setdefault(f"{first['label']} ({number(first['ratio'])})", []).append(str(panel))
    told = "; ".join(f"{formula} on {listed(panels)}" for formula, panels in best.items())
    return f"Cheapest with samples within {name}, in brackets its cost over exact Phong's: {told}."


def _alt(data: pd.DataFrame) -> str:
    parts = []
    for panel, rows in data.groupby("panel", sort=False):
        mine = rows[rows["target"] == str(panel).split(", ")[0]]
        named = listed(f"{r['label']} ({number(r['error'])}, {number(r['ratio'])})" for r in records(edge(mine)))
        parts.append(f"{panel}: {named}")
    return f"Error against cost ratio, log-log; formulas along each front with error and ratio: {'; '.join(parts)}."
