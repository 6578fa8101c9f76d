"""Paper, ink and axes that all figures share, and the way a figure becomes SVG, in a light and a dark variant.

Only matplotlib's object API: pyplot keeps global state and picks a backend. A figure is drawn once, light;
the dark file is the same text with every palette colour exchanged, which halves the drawing time and keeps both alike.
"""

import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from phongbench_reports.svg import slim
from phongbench_reports.text import BUDGETS
from phongbench_reports.ticks import merge_ticks

Vector = npt.NDArray[np.float64]

SURFACE, INK, MUTED, GRID = "#fcfcfd", "#1b2330", "#586374", "#dde1e7"
#: Okabe and Ito's colours, safe for the colour-blind, their yellow left out (unreadable on white).
BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY = "#0072b2", "#d55e00", "#009e73", "#b8609c", "#d99000", "#56b4e9"
DARK = {
    SURFACE: "#161b23",
    INK: "#e4e8ee",
    MUTED: "#9aa6b6",
    GRID: "#2d3541",
    BLUE: "#3fa0e0",
    VERMILION: "#f0803c",
    GREEN: "#2fc397",
    PURPLE: "#dd95c3",
    ORANGE: "#f2b33a",
    SKY: "#9bd6fb",
}
#: Colour, marker and dash together: any one of the three is enough to tell series apart.
STYLES: tuple[tuple[str, str, Any], ...] = (
    (BLUE, "o", "-"),
    (VERMILION, "s", (0, (5, 2))),
    (GREEN, "^", (0, (1.5, 1.5))),
    (PURPLE, "D", (0, (6, 2, 1.5, 2))),
    (ORANGE, "v", (0, (3, 1.5))),
    (SKY, "P", (0, (8, 3))),
    (INK, "X", (0, (2, 3))),
)
#: One look per lambda form, the same in every figure.
FORMS = {"dot": STYLES[0], "difference": STYLES[1], "cross": STYLES[2], "tan2": STYLES[3], "none": STYLES[6]}

SETTINGS: dict[str, Any] = {
    **dict.fromkeys(("text.color", "axes.labelcolor", "xtick.labelcolor", "ytick.labelcolor"), INK),
    **dict.fromkeys(("axes.edgecolor", "xtick.color", "ytick.color"), MUTED),
    **dict.fromkeys(("axes.facecolor", "figure.facecolor", "savefig.facecolor"), SURFACE),
    **dict.fromkeys(("axes.spines.top", "axes.spines.right", "xtick.minor.visible", "legend.frameon"), False),
    "font.family": ["sans-serif"],
    "font.sans-serif": ["DejaVu Sans", "Verdana", "sans-serif"],
    "font.size": 9.0,
    "svg.fonttype": "none",
    "axes.grid": True,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "axes.axisbelow": True,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.linewidth": 0.8,
    "axes.titley": 1.0,  # where matplotlib puts it anyway, after it has laid out all tick labels
    "axes.unicode_minus": True,
    "lines.linewidth": 1.5,
    "lines.markersize": 5.0,
}


@dataclass(frozen=True)
class Plate:
    """A finished figure and everything the page says about it.

    figure     matplotlib Figure
    data       DataFrame    every mark of the figure as a row, with its key columns; becomes the CSV
    takeaway   str          one sentence computed from the rows
    alt        str          what a reader who cannot see the figure must know
    basis      str          sample counts and coverage, or rounds of timing
    command    str | None   command line that measures these rows again
    """

    figure: Figure
    data: pd.DataFrame
    takeaway: str
    alt: str
    basis: str
    command: str | None = None


@contextmanager
def ink() -> Iterator[None]:
    """Draw inside this: matplotlib's defaults plus SETTINGS, whatever the user's matplotlibrc says."""
    with mpl.rc_context():
        fresh: Any = {key: value for key, value in mpl.rcParamsDefault.items() if key != "backend"}
        settings: Any = SETTINGS
        mpl.rcParams.update(fresh)
        mpl.rcParams.update(settings)
        yield


def sheet(height: float, rows: int = 1, columns: int = 1, **spacing: Any) -> tuple[Figure, list[Axes]]:
    """A figure 9.2 inches wide, its axes in reading order; fixed margins, since layout engines are slow."""
    figure = Figure(figsize=(9.2, height))
    margins = {"left": 0.075, "right": 0.985, "top": 0.92, "bottom": 0.14, "wspace": 0.12, "hspace": 0.35}
    share = {key: spacing.pop(key) for key in ("sharex", "sharey", "width_ratios") if key in spacing}
    axes = figure.subplots(rows, columns, squeeze=False, **share)
    figure.subplots_adjust(**{**margins, **spacing})
    return figure, [one for row in axes for one in row]


def budget_lines(axes: Axes, *, vertical: bool = False, named: bool = True, side: str = "left") -> None:
    """One code of 8 and of 10 bits as thin lines across the error axis, named at the top or at a `side`."""
    for (value, name), outward in zip(BUDGETS, ("left", "right"), strict=True):
        draw = axes.axvline if vertical else axes.axhline
        draw(value, color=MUTED, linewidth=0.9, linestyle=(0, (4, 3)), zorder=1.5)
        look: dict[str, Any] = {"color": MUTED, "fontsize": 7.5}
        if named and vertical:
            axes.text(value, 1.0, f" {name} ", transform=axes.get_xaxis_transform(), va="top", ha=outward, **look)
        elif named:
            at = 0.012 if side == "left" else 0.996
            axes.text(at, value, name, transform=axes.get_yaxis_transform(), va="bottom", ha=side, **look)


def spread(wanted: Sequence[float], gap: float) -> list[float]:
    """Positions at least `gap` apart, in the order of the wanted ones and near to them, from 0 to 1."""
    order = sorted(range(len(wanted)), key=lambda index: (wanted[index], index))
    placed = np.array([wanted[index] for index in order], dtype=float)
    for _ in range(200):
        overlap = gap - np.diff(placed)
        if not len(overlap) or overlap.max() <= 1e-6:
            break
        push = np.maximum(overlap, 0.0) / 2.0
        placed[1:] += push
        placed[:-1] -= push
    placed += max(0.0, -float(placed.min(initial=0.0))) - max(0.0, float(placed.max(initial=1.0)) - 1.0)
    result = [0.0] * len(wanted)
    for position, index in zip(placed, order, strict=True):
        result[index] = float(position)
    return result


def end_labels(axes: Axes, ends: Sequence[tuple[float, float, str, str]], *, gap: float = 0.055) -> None:
    """Names of lines beside their right ends, in place of a legend.

    ends   (x, y, text, colour) of each line's last point, in data units; a hair line leads to a name that had to move
    """
    if not ends:
        return
    places = in_panel(axes, *np.array([end[:2] for end in ends]).T)
    heights = spread(np.clip(places[:, 1], 0.0, 1.0).tolist(), gap)
    for place, height, (_, _, text, colour) in zip(places, heights, ends, strict=True):
        hair(axes, place, (1.025, height), color=colour, linewidth=0.8)
        axes.text(1.035, height, text, fontsize=8, va="center", transform=axes.transAxes)


def in_panel(axes: Axes, x: npt.ArrayLike, y: npt.ArrayLike) -> Vector:
    """Where points (n, 2) of a panel lie in shares of its width and height."""
    to_axes = axes.transData + axes.transAxes.inverted()
    return np.asarray(to_axes.transform(np.column_stack([x, y])))


def hair(axes: Axes, place: Any, name: tuple[float, float], **look: Any) -> None:
    """A line from a point to its name, both in shares of the panel; an arrow's ends would be cut by searching."""
    ends = zip(place, name, strict=True)
    axes.add_artist(Line2D(*ends, clip_on=False, solid_capstyle="round", transform=axes.transAxes, **look))


def footnote(figure: Figure, text: str) -> None:
    """What the marks rest on, small, at the bottom left: a figure that travels alone keeps its sample count."""
    figure.text(0.006, 0.012, text, fontsize=7.5, color=MUTED, ha="left", va="bottom")


def svg_pair(figure: Figure, name: str) -> tuple[bytes, bytes]:
    """The figure as SVG for light and for dark pages; same figure, same bytes.

    name   its title
    """
    merge_ticks(figure)
    buffer = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": f"phongbench-{name}", "svg.fonttype": "none"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": "phongbench", "Title": name})
    light = slim(buffer.getvalue()).decode("utf-8")
    dark = re.sub(r"#[0-9a-f]{6}\b", lambda colour: DARK.get(colour[0], colour[0]), light)
    return light.encode("utf-8"), dark.encode("utf-8")
