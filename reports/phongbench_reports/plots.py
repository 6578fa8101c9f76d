"""What all figures share: their sheet, lines and names that many have, and how one becomes SVG, light and dark.

A figure is a `chart.Figure`, or within `ink` one of matplotlib's, for pixels; both know what figures ask of them. It is
drawn once, light; the dark file is the same text with every palette colour exchanged.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from phongbench_reports.chart import Axes, Figure
from phongbench_reports.chart.palette import (
    BLUE,
    DARK,
    GREEN,
    GRID,
    INK,
    MUTED,
    ORANGE,
    PURPLE,
    SKY,
    SURFACE,
    VERMILION,
)
from phongbench_reports.text import BUDGETS

__all__ = [
    "BLUE",
    "DARK",
    "FORMS",
    "GREEN",
    "GRID",
    "INK",
    "MUTED",
    "ORANGE",
    "PURPLE",
    "SKY",
    "STYLES",
    "SURFACE",
    "VERMILION",
    "Axes",
    "Figure",
    "Plate",
    "Vector",
    "budget_lines",
    "end_labels",
    "footnote",
    "in_panel",
    "ink",
    "sheet",
    "spread",
    "svg_pair",
]

Vector = npt.NDArray[np.float64]

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

    figure     chart.Figure, or matplotlib's within `ink`
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


#: whether figures are matplotlib's
_IN_PIXELS: ContextVar[bool] = ContextVar("in_pixels", default=False)


@contextmanager
def ink() -> Iterator[None]:
    """Figures of matplotlib, for pixels, with its defaults and SETTINGS, whatever the user's matplotlibrc says."""
    import matplotlib as mpl  # late, as where it draws: pages need none of it

    token = _IN_PIXELS.set(True)
    try:
        with mpl.rc_context():
            fresh: Any = {key: value for key, value in mpl.rcParamsDefault.items() if key != "backend"}
            settings: Any = SETTINGS
            mpl.rcParams.update(fresh)
            mpl.rcParams.update(settings)
            yield
    finally:
        _IN_PIXELS.reset(token)


def sheet(height: float, rows: int = 1, columns: int = 1, **spacing: Any) -> tuple[Figure, list[Axes]]:
    """A figure 9.2 inches wide, its panels in reading order; fixed margins, since layout engines are slow."""
    margins = {"left": 0.075, "right": 0.985, "top": 0.92, "bottom": 0.14, "wspace": 0.12, "hspace": 0.35}
    share = {key: spacing.pop(key) for key in ("sharex", "sharey", "width_ratios") if key in spacing}
    margins |= spacing
    if not _IN_PIXELS.get():
        figure = Figure((9.2, height))
        return figure, figure.panels(rows, columns, spacing=margins, **share)
    from matplotlib import figure as pixels

    drawn: Any = pixels.Figure(figsize=(9.2, height))
    panels = drawn.subplots(rows, columns, squeeze=False, **share)
    drawn.subplots_adjust(**margins)
    return drawn, [one for row in panels for one in row]


def in_panel(axes: Axes, x: Any, y: Any) -> Vector:
    """Where points (n, 2) of a panel lie in shares of its width and height."""
    shares = []
    for values, scale, limits in ((x, axes.get_xscale(), axes.get_xlim()), (y, axes.get_yscale(), axes.get_ylim())):
        straight = np.log10 if scale == "log" else np.asarray
        low, high = straight(np.array(limits))
        shares.append((straight(np.asarray(values, float)) - low) / (high - low))
    return np.stack(shares, axis=-1)


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
    heights = np.clip(in_panel(axes, *np.array([end[:2] for end in ends]).T)[:, 1], 0.0, 1.0)
    for (x, y, text, colour), height in zip(ends, spread(heights.tolist(), gap), strict=True):
        axes.annotate(
            text,
            xy=(x, y),
            xytext=(1.035, height),
            textcoords="axes fraction",
            fontsize=8,
            va="center",
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.8, "shrinkA": 1, "shrinkB": 3},
        )


def footnote(figure: Figure, text: str) -> None:
    """What the marks rest on, small, at the bottom left: a figure that travels alone keeps its sample count."""
    figure.text(0.006, 0.012, text, fontsize=7.5, color=MUTED, ha="left", va="bottom")


def svg_pair(figure: Figure, name: str) -> tuple[bytes, bytes]:
    """The figure as SVG for light and for dark pages; same figure, same bytes.

    name   its title
    """
    light = figure.svg(name).decode("utf-8")
    dark = re.sub(r"#[0-9a-f]{6}\b", lambda colour: DARK.get(colour[0], colour[0]), light)
    return light.encode("utf-8"), dark.encode("utf-8")
