"""Error against time: every formula as a point with its interval, the front as steps."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from phongbench.analysis.rows import Rows, at, nearest
from phongbench_reports.figures.speed import SETS
from phongbench_reports.plots import (
    BLUE,
    INK,
    MUTED,
    ORANGE,
    SURFACE,
    Plate,
    budget_lines,
    footnote,
    hair,
    in_panel,
    sheet,
)
from phongbench_reports.reproduce import reproduce
from phongbench_reports.table import Absent
from phongbench_reports.text import BUDGETS, INTERVAL, alpha_is, basis, label, listed, number, records, time_it
from phongbench_reports.ticks import log_axis, named_ticks, octaves

#: Exponents drawn, the nearest ones of the run: a wide lobe, the classic middle, a tight one.
ALPHAS = (10.0, 50.0, 200.0)
#: Errors below are drawn at the left edge: on a log axis an exact formula would vanish.
FLOOR = 1e-7
#: Points of the front that get a name, and how far apart names are in axes heights.
NAMED, GAP = 6, 0.075
#: Width of a letter of a name in axes widths, about.
LETTER = 0.0078
LOOKS = {"on": (BLUE, BLUE, "o", 5.5), "unresolved": (ORANGE, SURFACE, "D", 4.0), "off": (MUTED, SURFACE, "o", 3.2)}


def cells(study: Rows, wanted: Sequence[float]) -> pd.DataFrame:
    """Front cells at the exponents nearest to these, with alpha, and a name for each."""
    alphas = sorted({nearest(study.alphas, alpha) for alpha in wanted})
    frame = pd.concat([study.front(a, study.precision).assign(alpha=a) for a in alphas], ignore_index=True)
    return frame.assign(label=[label(row) for row in records(frame)])


def marks(axes: Axes, rows: pd.DataFrame) -> None:
    """Cells as points with the interval of their time, by their state, and the front as steps."""
    rows = rows[["state", "error", "ratio", "ratio_low", "ratio_high"]]  # to select among many columns takes longer
    for state in ("off", "unresolved", "on"):
        part = rows[rows["state"] == state]
        colour, face, marker, size = LOOKS[state]
        x = part["error"].clip(lower=FLOOR).to_numpy()
        spans = [part["ratio"] - part["ratio_low"], part["ratio_high"] - part["ratio"]]
        axes.errorbar(
            x,
            part["ratio"],
            yerr=np.abs(np.array(spans, dtype=float)),
            fmt=marker,
            markersize=size,
            color=colour,
            markerfacecolor=face,
            markeredgewidth=1.1,
            elinewidth=0.9,
            capsize=0,
            label=state,
            zorder=3 if state == "on" else 2,
        )
    best = edge(rows)
    # A step, not a slope: no mixture of two formulas lies between two points.
    axes.step(best["error"].clip(lower=FLOOR), best["ratio"], where="post", color=BLUE, linewidth=1.2, zorder=1.8)


def edge(rows: pd.DataFrame) -> pd.DataFrame:
    """The front as far as the medians tell: cells not off it that are faster than every one that errs less."""
    wrong, ratio = rows["error"].to_numpy(), rows["ratio"].to_numpy()
    on = np.flatnonzero(rows["state"] != "off")
    order = on[np.lexsort((ratio[on], wrong[on]))]
    least = np.minimum.accumulate(np.append(np.inf, ratio[order]))[:-1]
    return rows.iloc[order[ratio[order] < least]].reset_index(drop=True)


def names(axes: Axes, rows: pd.DataFrame, *, gap: float = GAP, letter: float = LETTER, most: int = NAMED) -> None:
    """Names to the lower left of points of the front, where nothing can be: it would be on the front itself.

    gap     how far apart names are, in axes heights
    letter  width of a letter in axes widths
    most    how many points get a name
    """
    best = edge(rows)
    if best.empty:
        return
    picks = np.unique(np.linspace(0, len(best) - 1, min(most, len(best))).round().astype(int))
    best = best.iloc[picks]
    points = in_panel(axes, best["error"].clip(lower=FLOOR), best["ratio"])
    lowest = 1.0
    for (x, y), row in zip(points, records(best), strict=True):
        left = x < 0.03 + letter * len(row["label"])  # no room to its left: above it instead
        height = float(y) + gap if left else min(float(y), lowest) - gap
        lowest = lowest if left else height
        if not (0 <= x <= 1 and 0 <= y <= 1):
            continue
        end = (float(x) + (0.012 if left else -0.012), height)
        hair(axes, (x, y), end, color=BLUE, linewidth=0.6, zorder=2.5)
        axes.text(
            *end,
            row["label"],
            transform=axes.transAxes,
            fontsize=7.5,
            ha="left" if left else "right",
            va="center",
            bbox={"facecolor": SURFACE, "edgecolor": "none", "pad": 0.8},
            zorder=4,
        )


def alone(axes: Axes, rows: pd.DataFrame, title: str) -> None:
    """One front on axes of any figure.

    rows  with label, error, ratio, ratio_low, ratio_high and state; call it inside `ink`
    """
    _scale(axes, rows)
    panel(axes, rows, title)
    axes.set(xlabel="largest absolute error", ylabel="cost / exact Phong")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=8, handletextpad=0.2, borderaxespad=0.1)


def _scale(axes: Axes, rows: pd.DataFrame) -> None:
    low, high = float(rows["ratio_low"].min()), float(rows["ratio_high"].max())
    log_axis(axes.xaxis)
    top = max(high, 1.0) * 1.35
    bottom = low / (top / low) ** 0.6  # below the front there is room for its names
    named_ticks(axes.yaxis, octaves(low / 1.5, top), minor=[0.75 * tick for tick in octaves(low / 0.75, top / 0.75)])
    axes.set(xlim=(FLOOR / 2, 1.0), ylim=(bottom, top))


def panel(axes: Axes, rows: pd.DataFrame, title: str) -> None:
    """A front on axes that are scaled for it."""
    budget_lines(axes, vertical=True)
    axes.axhline(1.0, color=INK, linewidth=0.8)
    axes.text(0.998, 1.0, "exact Phong", transform=axes.get_yaxis_transform(), fontsize=7.5, ha="right", va="bottom")
    marks(axes, rows)
    names(axes, rows)
    axes.set_title(title)
    axes.set_ylabel("time / exact Phong")


def draw(study: Rows, alphas: Sequence[float] = ALPHAS) -> Plate | Absent:
    """One panel per exponent, the nearest ones of the run; error on a log axis, time as a ratio to exact Phong."""
    if study.timing.empty:
        return Absent("This run has no timing, so there is no front.", time_it(study))
    data = cells(study, alphas) if (study.timing["precision"] == study.precision).any() else pd.DataFrame()
    if data.empty:
        return Absent("No timed kernel matches a measured error.", "Run accuracy and timing at the same precision.")
    alphas = sorted(data["alpha"].unique())
    height = 0.75 + 2.35 * len(alphas)
    margins = {"top": 1 - 0.3 / height, "bottom": 0.72 / height, "hspace": 0.2}
    figure, panels = sheet(height, len(alphas), 1, left=0.075, right=0.985, sharex=True, sharey=True, **margins)
    _scale(panels[0], data)
    for axes, alpha in zip(panels, alphas, strict=True):
        panel(axes, data[data["alpha"] == alpha], alpha_is(alpha))
    panels[-1].set_xlabel("largest absolute error")
    panels[0].legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=8, handletextpad=0.2, borderaxespad=0.1
    )
    rows = at(study.highlight, space="reflect", precision=study.precision, alpha=tuple(alphas))
    source = f"{basis(rows)}; time: median ratio with its {INTERVAL}, {SETS[study.working_set]}"
    footnote(figure, f"{study.precision}, unit vectors, formulas of (R, V); error ≤ 10⁻⁷ at the left edge; {source}")
    command = reproduce(study, rows).removesuffix(" --no-timing")
    return Plate(figure, data, _sentence(study, data), _alt(data), source, command)


def _sentence(study: Rows, data: pd.DataFrame) -> str:
    if study.twin_differs:
        return "The A/A twin differs from itself in this run, so no speed claim is made from these points."
    parts = []
    budget, name = BUDGETS[0]
    for alpha in sorted(data["alpha"].unique()):
        best = study.choices.choice(float(alpha), study.precision, budget).best
        if best is None:
            parts.append(f"nothing at {alpha_is(alpha)}")
        else:
            parts.append(f"{label(best)} at {alpha_is(alpha)} ({number(best['ratio'])} of exact Phong's time)")
    counts = data["state"].value_counts()
    states = listed(f"{int(counts.get(state, 0))} {state}" for state in ("on", "unresolved", "off"))
    return f"Fastest within {name}, proven: {listed(parts)}. Of {len(data)} points, {states} the front."


def _alt(data: pd.DataFrame) -> str:
    parts = []
    for alpha, rows in data.groupby("alpha"):
        best = edge(rows)
        named = ", ".join(f"{row['label']} ({number(row['error'])}, {number(row['ratio'])})" for row in records(best))
        parts.append(f"{alpha_is(alpha)}: {named or 'no point'}")
    return f"Error against time ratio, log-log; points along the front with error and ratio: {'; '.join(parts)}."
