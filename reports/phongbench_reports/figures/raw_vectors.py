"""From raw N, L and V: error against time of whole recipes, a panel for each size of wrong lengths."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from phongbench.analysis import kernel_times
from phongbench.analysis.front import finite, framed, joined, worst_of
from phongbench.analysis.raw_vectors import configurations
from phongbench.analysis.rows import Rows, at, nearest
from phongbench.inputs.length_errors import ANY
from phongbench.results.records import Records
from phongbench_reports.figures.front import FLOOR, edge, marks, names
from phongbench_reports.figures.speed import SETS
from phongbench_reports.plots import INK, Plate, budget_lines, footnote, sheet
from phongbench_reports.table import Absent
from phongbench_reports.text import BUDGETS, INTERVAL, alpha_is, basis, label, listed, number, records, share, time_it
from phongbench_reports.ticks import log_axis, named_ticks, octaves

#: sizes of wrong lengths that are drawn where the run has them: all vectors too long, or too short, by as much
SIZES = (0.0, 0.001, 0.01, 0.05)


def points(study: Rows, rows: pd.DataFrame, alpha: float) -> pd.DataFrame:
    """Recipes with the worst error of both signs at each size, their times, state and name; `lengths` names the panel.

    A recipe with a value that is not finite at a size is left out there.
    rows  errors of recipes at that exponent
    """
    timing = Records.of(study.raw("timing"))
    times = kernel_times.times_of(timing, working_set=study.working_set, precision=study.precision)
    times = kernel_times.times_at(times, (alpha,))
    panels = [(_named(size), _at_size(rows, size)) for size in SIZES]
    panels.append(("any length, 0.001 to 1000", at(rows, perturbation=ANY.name)))
    drawn = []
    for name, mine in panels:
        cells = joined(worst_of(finite(Records.of(mine))), times)
        if cells:
            drawn.append(framed(cells).assign(lengths=name, alpha=alpha, label=[label(row) for row in cells]))
    return pd.concat(drawn, ignore_index=True) if drawn else pd.DataFrame()


def _at_size(rows: pd.DataFrame, size: float) -> pd.DataFrame:
    kept: pd.DataFrame = rows[(rows["perturbation"] != ANY.name) & np.isclose(rows["length_error"].abs(), size)]
    return kept


def _named(size: float) -> str:
    return f"lengths {share(size)} wrong" if size else "unit vectors"


def draw(study: Rows) -> Plate | Absent:
    """One panel per size, at one exponent; error on a log axis, time as a ratio to exact Phong given unit R and V."""
    if study.raw("timing").empty:
        return Absent("This run has no timing, so there is no front.", time_it(study))
    accuracy = study.raw("accuracy")
    rows = configurations(Records.of(accuracy), study.precision).of_frame(accuracy)
    if rows.empty:
        return Absent("The run measured no recipe from N, L and V.", "Run a preset, which holds such recipes.")
    alpha = nearest(sorted(rows["alpha"].unique()), study.alpha)
    rows = at(rows, alpha=alpha)
    data = points(study, rows, alpha)
    if data.empty:
        return Absent("No timed recipe matches a measured error.", "Run accuracy and timing at the same precision.")
    shown = list(dict.fromkeys(data["lengths"]))
    height = 0.75 + 1.9 * len(shown)
    margins = {"top": 1 - 0.3 / height, "bottom": 0.72 / height, "hspace": 0.25}
    figure, panels = sheet(height, len(shown), 1, left=0.075, right=0.985, sharex=True, sharey=True, **margins)
    log_axis(panels[0].xaxis)
    _times(panels[0], data)
    for axes, name in zip(panels, shown, strict=True):
        budget_lines(axes, vertical=True)
        axes.axhline(1.0, color=INK, linewidth=0.8)
        part = data[data["lengths"] == name]
        marks(axes, part)
        names(axes, part, gap=0.1)
        axes.set_title(name)
        axes.set_ylabel("time / exact Phong")
    panels[-1].set_xlabel("largest absolute error")
    source = f"{basis(rows)}; time: median ratio with its {INTERVAL}, {SETS[study.working_set]}"
    footnote(figure, f"{study.precision}, {alpha_is(alpha)}; error ≤ 10⁻⁷ at the left edge; {source}")
    command = f"phongbench run --alpha {alpha:g} --precision {study.precision}"
    return Plate(figure, data, _sentence(study, data), _alt(data), source, command)


def _times(axes: Axes, data: pd.DataFrame) -> None:
    """The time axis, as far as ratios reach; an interval that reaches much further is cut."""
    low = max(float(data["ratio_low"].min()), float(data["ratio"].min()) / 2)
    high = 1.35 * min(float(data["ratio_high"].max()), 2 * float(data["ratio"].max()))
    named_ticks(axes.yaxis, octaves(low / 1.5, high))
    # below the front there is room for its names
    axes.set(xlim=(FLOOR / 2, 2.0), ylim=(low / (high / low) ** 0.6, high))


def _sentence(study: Rows, data: pd.DataFrame) -> str:
    if study.twin_differs:
        return "The A/A twin differs from itself in this run, so no speed claim is made from these points."
    budget, name = BUDGETS[0]
    parts = []
    for lengths, rows in data.groupby("lengths", sort=False):
        best = next(iter(records(rows[rows["error"] <= budget].sort_values("ratio", kind="stable"))), None)
        told = f"{best['label']} ({number(best['ratio'])} of exact Phong's time)" if best else "none"
        parts.append(f"{lengths}: {told}")
    return f"Fastest recipe by medians whose samples stay within {name}: {'; '.join(parts)}."


def _alt(data: pd.DataFrame) -> str:
    parts = []
    for lengths, rows in data.groupby("lengths", sort=False):
        named = listed(f"{r['label']} ({number(r['error'])}, {number(r['ratio'])})" for r in records(edge(rows)))
        parts.append(f"{lengths}: {named}")
    return f"Error against time ratio, log-log; recipes along the front with error and ratio: {'; '.join(parts)}."
