"""Ticks of logarithmic axes, and how a thousand of them are drawn in no time."""

from collections.abc import Iterable, Sequence
from functools import cache
from itertools import pairwise
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import TICKDOWN, TICKLEFT, Line2D  # type: ignore[attr-defined]
from matplotlib.textpath import text_to_path
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter, NullLocator

from phongbench_reports.text import power_of_ten

Vector = npt.NDArray[np.float64]


def log_axis(axis: Any, *, labels: int = 20) -> None:
    """Log scale: at most `labels` labelled decades; unlabelled ticks at 2 to 9, or at decades where crowded."""
    axis.axes.set(**{f"{axis.axis_name}scale": "log"})
    crowded = labels < 20
    axis.set_major_locator(LogLocator(10.0, numticks=labels))
    axis.set_minor_locator(LogLocator(10.0, subs=(1.0,) if crowded else tuple(range(2, 10)), numticks=40))
    axis.set_major_formatter(FuncFormatter(power_of_ten))
    axis.set_minor_formatter(NullFormatter())


def named_ticks(axis: Any, values: Sequence[float], *, minor: Sequence[float] = ()) -> None:
    """Log scale whose labelled ticks are exactly these values, with unlabelled ones at `minor`."""
    axis.axes.set(**{f"{axis.axis_name}scale": "log"})
    fixed_ticks(axis, values, [f"{value:g}" for value in values])
    axis.set_minor_locator(FixedLocator([value for value in minor if value not in values]))
    axis.set_minor_formatter(NullFormatter())


def fixed_ticks(axis: Any, places: Iterable[float], labels: Iterable[str]) -> None:
    """Ticks at these places with these labels; matplotlib's `set_ticks` makes each at once, and again when it draws."""
    named = dict(zip(map(float, places), labels, strict=True))
    axis.set_major_locator(FixedLocator(list(named)))
    axis.set_major_formatter(FuncFormatter(lambda place, _: named.get(place, "")))


def octaves(low: float, high: float) -> list[float]:
    """Powers of two from `low` to `high`, both ends included when they are one."""
    first, last = int(np.ceil(np.log2(low) - 1e-9)), int(np.floor(np.log2(high) + 1e-9))
    return [2.0**exponent for exponent in range(first, last + 1)]


def steps_of_ten(low: float, high: float, digits: Sequence[float]) -> list[float]:
    """The values digit * 10^k from `low` to `high`: 1, 2, 5, 10, ... for digits (1, 2, 5)."""
    first, last = int(np.floor(np.log10(low))), int(np.ceil(np.log10(high)))
    values = [digit * 10.0**exponent for exponent in range(first, last + 1) for digit in digits]
    return [value for value in values if low <= value <= high]


def readable(low: float, high: float, letters: float) -> list[float]:
    """The most round values from `low` to `high` whose labels lie apart, on a log axis that is so many letters wide.

    Labels stay within the axis, so that those of the next panel cannot touch them.
    """

    def ends(value: float) -> tuple[float, float]:
        middle = letters * np.log(value / low) / np.log(high / low)
        return middle - len(f"{value:g}") / 2, middle + len(f"{value:g}") / 2

    def inside(digits: Sequence[float]) -> list[float]:
        return [v for v in steps_of_ten(low, high, digits) if ends(v)[0] >= 0 and ends(v)[1] <= letters]

    tenths = tuple(tenth / 10 for tenth in range(10, 100))
    choices = [inside(digits) for digits in (tenths, (1, 1.5, 2, 2.5, 3, 4, 5, 6, 8), (1, 2, 5), (1, 3), (1,))]
    choices += [choices[-1][::step] for step in range(2, 2 + len(choices[-1]))]
    apart = (v for v in choices if all(ends(a)[1] + 1 <= ends(b)[0] for a, b in pairwise(v)))
    return next(apart, [])


def merge_ticks(figure: Figure) -> None:
    """Turn the ticks of every axis, whose limits are final, into a line of marks, one of grid, and texts that look so.

    To matplotlib each tick is five artists, and a figure of nine log-log panels has a thousand: a second to draw.
    """
    every = (axis for axes in figure.axes if axes.axison for axis in (axes.xaxis, axes.yaxis))
    ticked: list[Any] = [axis for axis in every if not isinstance(axis.get_major_locator(), NullLocator)]
    places = [(_inside(axis, axis.get_majorticklocs()), _inside(axis, axis.get_minorticklocs())) for axis in ticked]
    labels = [
        axis.major.formatter.format_ticks(major.tolist()) for axis, (major, _) in zip(ticked, places, strict=True)
    ]
    for axis in ticked:  # all places first: panels that share an axis share its locator
        axis.set_major_locator(NullLocator())
        axis.set_minor_locator(NullLocator())
    for axis, (major, minor), names in zip(ticked, places, labels, strict=True):
        _draw_ticks(axis, major, minor, names)


def _inside(axis: Axis, places: npt.ArrayLike) -> Vector:
    """The places between the ends of the axis, or as good as on one."""
    known, drawn = np.asarray(places, float), axis.get_transform().transform
    low, high = sorted(drawn(np.asarray(axis.get_view_interval(), float)))
    slack = 1e-9 * (high - low)
    inside: Vector = known[(drawn(known) >= low - slack) & (drawn(known) <= high + slack)]
    return inside


def _draw_ticks(axis: Any, major: Vector, minor: Vector, names: Sequence[str]) -> None:
    """Marks at these places, lines across the panel and names at the major ones, and room for the name of the axis."""
    look: Any = mpl.rcParams
    told, kind, size = axis.get_tick_params("major"), f"{axis.axis_name}tick", look["font.size"]
    length = told.get("length", look[f"{kind}.major.size"])
    if told.get("gridOn") and len(major):
        axis.axes.add_artist(_lines(axis, major))
    for places, how, long in ((minor, "minor", look[f"{kind}.minor.size"]), (major, "major", length)):
        if len(places) and long:
            axis.axes.add_artist(_marks(axis, places, long, look[f"{kind}.{how}.width"]))
    beyond = length + look[f"{kind}.major.pad"]
    upright = axis.axis_name == "x"
    if not told.get("labelbottom" if upright else "labelleft", True) or not any(names):
        axis.labelpad += length
        return
    size = told.get("labelsize", size)
    across = axis.axes.get_xaxis_text1_transform if upright else axis.axes.get_yaxis_text1_transform
    transform, vertical, horizontal = across(beyond)
    for place, name in zip(major, names, strict=True):
        at = (place, 0.0) if upright else (0.0, place)
        axis.axes.text(*at, name, transform=transform, va=vertical, ha=horizontal, fontsize=size)
    axis.labelpad += beyond + (size if upright else max(_wide(name, size) for name in names))


@cache
def _wide(text: str, size: float) -> float:
    """Points that the longest line of a text takes."""
    font = FontProperties(size=size)
    widths = [text_to_path.get_text_width_height_descent(line, font, ismath=False)[0] for line in text.split("\n")]
    return float(max(widths))


def _lines(axis: Any, places: Vector) -> Line2D:
    """The grid at these places."""
    look: Any = mpl.rcParams
    along, across = np.repeat(places, 3), np.tile([0.0, 1.0, np.nan], len(places))
    upright = axis.axis_name == "x"
    return Line2D(
        *((along, across) if upright else (across, along)),
        color=look["grid.color"],
        linewidth=look["grid.linewidth"],
        zorder=axis.get_zorder(),
        transform=axis.axes.get_xaxis_transform("grid") if upright else axis.axes.get_yaxis_transform("grid"),
    )


def _marks(axis: Any, places: Vector, size: float, width: float) -> Line2D:
    """Ticks at these places as matplotlib would draw them."""
    look: Any = mpl.rcParams
    upright, edge = axis.axis_name == "x", np.zeros(len(places))
    return Line2D(
        *((places, edge) if upright else (edge, places)),
        linestyle="none",
        marker=TICKDOWN if upright else TICKLEFT,
        markersize=size,
        markeredgewidth=width,
        color=look[f"{axis.axis_name}tick.color"],
        clip_on=False,
        zorder=axis.get_zorder(),
        transform=axis.axes.get_xaxis_transform("tick1") if upright else axis.axes.get_yaxis_transform("tick1"),
    )
