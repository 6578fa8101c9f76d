"""Time per element of each kernel in every working set, with the ceilings measured in the same run."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from phongbench.analysis.rows import Rows, at, near
from phongbench.results.schema import CEILINGS, TWIN
from phongbench_reports.plots import BLUE, MUTED, SURFACE, Plate, footnote, sheet
from phongbench_reports.table import Absent
from phongbench_reports.text import label, listed, number, records, span, time_it
from phongbench_reports.ticks import fixed_ticks, named_ticks, readable, steps_of_ten

SETS = {"l1": "in L1", "l2": "in L2", "memory": "beyond cache"}
#: A kernel that moves this share of what a plain copy moves waits for memory, whatever its formula.
BOUND = 0.85
#: letters of a tick's label that fit beside one another on all panels together
LETTERS = 82
KEYS = ["approximation", "lambda_form", "space", "gamma", "precision", "working_set"]
NUMBERS = [
    "ns_min", "ns_median", "ratio", "ratio_low", "ratio_high", "dot_ratio", "bandwidth_fraction", "rounds", "threads",
]  # fmt: skip


def rows_of(study: Rows) -> pd.DataFrame:
    """Kernels of the working precision on the fewest threads; for formulas with squarings the gamma nearest to 8."""
    rows = at(study.timing, precision=study.precision)
    rows = rows[rows["lit"].isna()] if "lit" in rows else rows
    rows = rows[(rows["approximation"] != TWIN) & (rows["threads"] == rows["threads"].min())]
    rows = near(rows, "gamma", 8).drop_duplicates(KEYS)
    names = [label(row | {"beta_policy": "none"}) for row in records(rows)]
    shown: pd.DataFrame = rows[[*KEYS, *NUMBERS]].assign(label=names).reset_index(drop=True)
    return shown


def _panel(axes: Axes, rows: pd.DataFrame, names: list[str]) -> None:
    place = {name: len(names) - 1 - index for index, name in enumerate(names)}
    kernels = rows[rows["label"].isin(names)]
    y = kernels["label"].map(place).to_numpy(np.float64)
    axes.hlines(y, kernels["ns_min"], kernels["ns_median"], color=BLUE, linewidth=1.2)
    waits = (kernels["bandwidth_fraction"] >= BOUND).to_numpy()
    for bound, face in ((False, BLUE), (True, SURFACE)):
        mine = waits == bound
        axes.plot(kernels["ns_min"].to_numpy()[mine], y[mine], "o", color=BLUE, markerfacecolor=face, markersize=4.5)
    ceilings = rows[rows["approximation"].isin(CEILINGS)].sort_values("ns_min", kind="stable")
    for index, row in enumerate(records(ceilings)):
        axes.axvline(row["ns_min"], color=MUTED, linewidth=0.9, linestyle=(0, (4, 3)), zorder=1)
        place_of_name = (row["ns_min"], len(names) - 0.42 + 0.62 * index)
        look: dict[str, Any] = {"fontsize": 7, "color": MUTED, "va": "center", "textcoords": "offset points"}
        axes.annotate(str(row["approximation"]), place_of_name, (2, 0), annotation_clip=False, **look)
    fixed_ticks(axes.yaxis, [place[name] for name in names], names)
    axes.tick_params(axis="y", length=0)
    axes.grid(False, axis="y")
    axes.set_ylim(-0.7, len(names) + 1.4)


def draw(study: Rows) -> Plate | Absent:
    """Nanoseconds on a log axis: dot the minimum over clean epochs, line to the median; hollow where memory decides."""
    if study.timing.empty:
        return Absent("This run has no timing.", time_it(study))
    data = rows_of(study)
    sets = [name for name in SETS if (data["working_set"] == name).any()]
    first = data[(data["working_set"] == sets[0]) & ~data["approximation"].isin(CEILINGS)] if sets else data.iloc[:0]
    if first.empty:
        return Absent(f"This run timed nothing at {study.precision}.", "Run again with that precision.")
    names = first.sort_values(["ns_min", "label"], kind="stable")["label"].tolist()
    height = 1.5 + 0.19 * (len(names) + 2)
    margins = {"bottom": 0.74 / height, "top": 1 - 0.34 / height}
    figure, panels = sheet(height, 1, len(sets), left=0.225, right=0.985, wspace=0.07, sharey=True, **margins)
    for axes, name in zip(panels, sets, strict=True):
        mine = data[data["working_set"] == name]
        low, high = 0.85 * float(mine["ns_min"].min()), 1.3 * float(mine["ns_median"].max())
        named_ticks(axes.xaxis, readable(low, high, LETTERS / len(sets)), minor=steps_of_ten(low, high, range(1, 10)))
        axes.set_xlim(low, high)
        _panel(axes, mine, names)
        axes.set_title(SETS[name])
        axes.set_xlabel("ns per element")
    rounds = f"{span(data['rounds'])} rounds, {span(data['threads'])} thread"
    footnote(
        figure,
        f"{study.precision}; dot: fastest clean epoch, line: to the median; "
        f"hollow: at least {BOUND:.0%} of copy bandwidth; {rounds}",
    )
    return Plate(figure, data, _sentence(study, data, sets), _alt(data, names, sets), rounds)


def _sentence(study: Rows, data: pd.DataFrame, sets: list[str]) -> str:
    kernels = data[~data["approximation"].isin(CEILINGS)]
    small = kernels[kernels["working_set"] == sets[0]].sort_values(["ns_min", "label"], kind="stable")
    fast, exact = small.iloc[0], small[small["approximation"] == "phong"]
    where = SETS[sets[0]]
    start = f"{where[0].upper()}{where[1:]}, {fast['label']} takes {number(fast['ns_min'])} ns per element"
    if len(exact):
        start += f" and exact Phong {number(exact['ns_min'].iloc[0])} ns"
    large = kernels[kernels["working_set"] == sets[-1]]
    waits = int((large["bandwidth_fraction"] >= BOUND).sum())
    tail = f"; {SETS[sets[-1]]}, {waits} of {len(large)} kernels wait for memory, where the formula no longer matters"
    withheld = (
        f"; the A/A twin differs from itself in {listed(study.twin_differs)}, so speed claims are withheld"
        if study.twin_differs
        else ""
    )
    return f"{start}{tail if len(sets) > 1 else ''}{withheld}."


def _alt(data: pd.DataFrame, names: list[str], sets: list[str]) -> str:
    small = data[data["working_set"] == sets[0]].drop_duplicates("label").set_index("label")["ns_min"]
    parts = ", ".join(f"{name} {number(small[name])}" for name in names)
    return f"Dot chart of nanoseconds per element on log axes, one panel per working set. {SETS[sets[0]]}: {parts}."
