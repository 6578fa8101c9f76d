"""The error of each formula split into its parts: the model, the lengths of the vectors, rounding."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from phongbench.analysis.rows import Rows, at, near, ordered
from phongbench.results.schema import CELL
from phongbench_reports.figures.measured import finished
from phongbench_reports.plots import BLUE, GREEN, GRID, VERMILION, Plate, Vector, budget_lines, sheet
from phongbench_reports.table import Absent
from phongbench_reports.text import alpha_is, label, listed, number, percent, records
from phongbench_reports.ticks import fixed_ticks, log_axis

PARTS = {
    "model_max": ("model", BLUE, "o"),
    "length_max": ("lengths", VERMILION, "s"),
    "rounding_max": ("rounding", GREEN, "^"),
}
LIMITS = (1e-8, 10.0)
#: precisions beside one another: more would leave no room
SHOWN = 3


def rows_of(study: Rows) -> pd.DataFrame:
    """One row per formula and precision at the headline exponent, one vector about 1 % too long; Taylor slopes."""
    rows = at(study.lengths, alpha=study.alpha, perturbation="a", gated=True)
    rows = rows[(rows["length_error"] > 0) & ~rows["beta_policy"].isin(["minimax", "energy"])]
    if rows.empty:
        return rows
    rows = near(near(rows, "length_error", 0.01), "gamma", 8)
    columns = [*CELL, "alpha", "perturbation", "length_error", *PARTS, "max_abs", "samples", "coverage"]
    rows = rows[columns].assign(label=[label(row) for row in records(rows)])
    rows = ordered(rows, ["precision", *CELL[:-1]])
    whole = rows[list(PARTS)].fillna(0.0).sum(axis=1)
    shares = {name.replace("_max", "_share"): rows[name].fillna(0.0) / whole.where(whole > 0.0) for name in PARTS}
    return rows.assign(**shares)


def order_of(data: pd.DataFrame, precision: str) -> list[str]:
    """Names of the formulas, the one whose parts in this precision add up to most first."""
    rows = data[data["precision"] == precision]
    whole = rows[list(PARTS)].fillna(0.0).sum(axis=1)
    ordered = rows.assign(whole=whole).sort_values(["whole", "label"], ascending=[False, True], kind="stable")
    return list(dict.fromkeys([*ordered["label"], *data["label"]]))


def _sizes(axes: Axes, rows: pd.DataFrame, y: Vector) -> None:
    """Each part on a log axis."""
    parts = rows[list(PARTS)].to_numpy(np.float64)
    biggest = np.clip(np.nanmax(parts, axis=1), *LIMITS)
    axes.hlines(y, LIMITS[0], biggest, color=GRID, linewidth=1.0, zorder=1)
    for index, (name, colour, marker) in enumerate(PARTS.values()):
        # Parts of 0 (exact formulas, length-free forms) would leave a log axis: they sit at its left end.
        axes.plot(
            np.clip(parts[:, index], *LIMITS),
            y,
            color=colour,
            marker=marker,
            linestyle="none",
            label=name,
            clip_on=False,
            markersize=4.5,
        )


def _shares(axes: Axes, rows: pd.DataFrame, y: Vector) -> None:
    """The parts of each formula stacked, as shares of their sum: a log axis cannot stack."""
    left = np.zeros(len(rows))
    for name, (_, colour, _) in PARTS.items():
        share = 100.0 * rows[name.replace("_max", "_share")].fillna(0.0).to_numpy(np.float64)
        axes.barh(y, share, left=left, height=0.62, color=colour, linewidth=0)
        left = left + share


def draw(study: Rows) -> Plate | Absent:
    """Per precision two panels: the size of the three parts, and what share of their sum each is."""
    data = rows_of(study)
    if data.empty:
        return Absent("The run holds no rows on vectors of the wrong length.", "Run with the stratum lengths.")
    precisions = [name for name in study.precisions if (data["precision"] == name).any()][:SHOWN]
    names = order_of(data, precisions[0])
    height = 1.7 + 0.2 * len(names)
    margins = {"left": 0.225, "right": 0.985, "wspace": 0.09, "bottom": 0.78 / height, "top": 1 - 0.67 / height}
    widths = (2.4, 1) * len(precisions)
    figure, panels = sheet(height, 1, len(widths), sharey=True, width_ratios=widths, **margins)
    place = {name: len(names) - 1 - index for index, name in enumerate(names)}
    for index, name in enumerate(precisions):
        rows = data[data["precision"] == name]
        y = np.array([place[name] for name in rows["label"]], dtype=np.float64)
        sizes, shares = panels[2 * index : 2 * index + 2]
        log_axis(sizes.xaxis, labels=6 if len(precisions) < SHOWN else 3)
        sizes.set_xlim(*LIMITS)
        budget_lines(sizes, vertical=True, named=len(precisions) < SHOWN)
        _sizes(sizes, rows, y)
        _shares(shares, rows, y)
        sizes.set_title(name, pad=14)
        sizes.set_xlabel("largest error of the part" if len(precisions) < SHOWN else "largest error")
        shares.set(xlim=(0.0, 100.0), xticks=(0, 50) if len(precisions) < SHOWN else (50,), xlabel="share (%)")
    for axes in panels:
        axes.grid(False, axis="y")
        axes.tick_params(axis="y", length=0)
    fixed_ticks(panels[0].yaxis, [place[name] for name in names], names)
    panels[0].set_ylim(-0.7, len(names) - 0.3)
    marks = panels[0].get_legend_handles_labels()
    figure.legend(*marks, loc="upper right", ncols=3, fontsize=8, columnspacing=1.0, handletextpad=0.2)
    one = percent(float(data["length_error"].iloc[0]))
    note = (
        f"{alpha_is(study.alpha)}, one vector {one} in length; ≤ 10⁻⁸ drawn at the left edge; the largest of each "
        "part, not all at one input"
    )
    return finished(study, figure, data, note, _sentence(data, precisions), _alt(data))


def _sentence(data: pd.DataFrame, precisions: list[str]) -> str:
    sentences = []
    for name in precisions:
        rows = data[data["precision"] == name]
        largest = rows[list(PARTS)].idxmax(axis=1).value_counts()
        counts = listed(f"{PARTS[part][0]} for {int(largest[part])}" for part in PARTS if part in largest.index)
        sentences.append(f"in {name} the largest part is {counts} of {len(rows)} formulas")
    return f"With one vector {percent(float(data['length_error'].iloc[0]))} in length, {'; '.join(sentences)}."


def _alt(data: pd.DataFrame) -> str:
    rows = data[data["precision"] == data["precision"].max()] if data.empty else data[data["precision"] == "float32"]
    rows = rows if len(rows) else data
    parts = "; ".join(
        f"{row['label']}: "
        + ", ".join(f"{name} {number(row[part])}" for part, (name, _, _) in PARTS.items() if row[part] == row[part])
        for row in records(rows.head(12))
    )
    return f"Dot chart of the parts of each formula's error on a log axis. {rows['precision'].iloc[0]}: {parts}."
