"""Formulas of reflectance: error over incidence against time, glass and copper apart."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from phongbench.analysis.incidence_front import points, twin_differs
from phongbench.analysis.rows import Rows
from phongbench.inputs.optical_constants import EXACT
from phongbench_reports.figures.front import LOOKS
from phongbench_reports.plots import INK, Plate, budget_lines, footnote, in_panel, sheet, spread
from phongbench_reports.table import Absent
from phongbench_reports.text import INTERVAL, listed, number, records, span
from phongbench_reports.ticks import log_axis, named_ticks, octaves

#: errors below are drawn at the left edge: on a log axis an exact formula would vanish
FLOOR = 1e-7


def draw(study: Rows) -> Plate | Absent:
    """A panel for each material: every formula that can tell it as a point with the interval of its time."""
    if study.incidence.empty:
        return Absent("Reflectance was not measured against incidence.", "Run with the probe incidence.")
    if study.incidence_times.empty:
        return Absent("This run has no timing, so there is no front of reflectances.", "Run again without --no-timing.")
    data = pd.concat([points(study, material) for material in EXACT], ignore_index=True)
    figure, panels = sheet(3.5, 1, len(EXACT), left=0.08, bottom=0.2, top=0.88, wspace=0.1, sharex=True, sharey=True)
    low, high = float(data["ratio_low"].min()), float(data["ratio_high"].max())
    log_axis(panels[0].xaxis)
    named_ticks(panels[0].yaxis, octaves(low / 1.5, 1.5 * high), minor=[])
    panels[0].set(xlim=(FLOOR / 2, 2.0), ylim=(low / 1.6, 1.9 * high))
    for axes, (material, exact) in zip(panels, EXACT.items(), strict=True):
        budget_lines(axes, vertical=True)
        axes.axhline(1.0, color=INK, linewidth=0.8)
        _panel(axes, data[data["material"] == material])
        axes.set_title(f"{material}: time / exact {exact.kind}")
        axes.set_xlabel("largest absolute error over incidence")
    panels[0].set_ylabel("time / exact")
    basis = f"{span(study.judged_incidence['samples'])} angles, {span(study.incidence_times['rounds'])} rounds"
    note = f"{study.incidence_precision}, one channel, in L1; error ≤ 10⁻⁷ at the left edge; median ratio with its"
    footnote(figure, f"{note} {INTERVAL}; {basis}")
    command = "phongbench run --probe incidence"
    return Plate(figure, data, _sentence(study, data), _alt(data), basis, command)


def _panel(axes: Axes, rows: pd.DataFrame) -> None:
    for state, (colour, face, marker, size) in LOOKS.items():
        part = rows[rows["state"] == state]
        ends = [part["ratio"] - part["ratio_low"], part["ratio_high"] - part["ratio"]]
        axes.errorbar(
            part["error"].clip(lower=FLOOR),
            part["ratio"],
            yerr=np.abs(np.array(ends, dtype=float)),
            fmt=marker,
            markersize=size,
            color=colour,
            markerfacecolor=face,
            elinewidth=0.9,
        )
    # the exact ones stand at the left edge, with room to their right
    for left, part in ((True, rows[rows["error"] > 1e-4]), (False, rows[rows["error"] <= 1e-4])):
        _names(axes, part, left=left)


def _names(axes: Axes, rows: pd.DataFrame, *, left: bool) -> None:
    """Names beside points, none over another."""
    places = in_panel(axes, rows["error"].clip(lower=FLOOR), rows["ratio"])
    for row, (x, _), height in zip(records(rows), places, spread([float(y) for _, y in places], 0.065), strict=True):
        look: dict[str, Any] = {"fontsize": 7.5, "va": "center", "ha": "right" if left else "left"}
        axes.text(x + (-0.015 if left else 0.015), height, row["reflectance"], transform=axes.transAxes, **look)


def _sentence(study: Rows, data: pd.DataFrame) -> str:
    if twin_differs(study):
        return "An exact formula timed twice differs from itself in this run, so no speed claim is made."
    parts = []
    for material, rows in data.groupby("material", sort=False):
        named = [
            f"{row['reflectance']} ({number(255 * row['error'])} codes, {number(row['ratio'])} of the exact one's time)"
            for row in records(rows)
            if row["state"] == "on" and row["error"] > FLOOR * 10
        ]
        parts.append(f"for {material} {listed(named)}")
    return f"On the front beside the exact formulas: {'; '.join(parts)}."


def _alt(data: pd.DataFrame) -> str:
    named = [
        f"{material}: "
        + ", ".join(f"{r['reflectance']} ({number(r['error'])}, {number(r['ratio'])})" for r in records(rows))
        for material, rows in data.groupby("material", sort=False)
    ]
    return f"Error against time ratio, log-log, of formulas of reflectance, with error and ratio: {'; '.join(named)}."
