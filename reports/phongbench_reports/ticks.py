"""Ticks of logarithmic axes, and how a thousand of them are drawn in no time."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import TICKDOWN, TICKLEFT, Line2D  # type: ignore[attr-defined]
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter, NullLocator

from phongbench_reports.text import power_of_ten


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
    axis.set_ticks(list(values), labels=[f"{value:g}" for value in values])
    axis.set_minor_locator(FixedLocator([value for value in minor if value not in values]))
    axis.set_minor_formatter(NullFormatter())


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


def merge_minor_ticks(figure: Figure) -> None:
    """Turn the minor ticks of every axis, whose limits are final, into one line of marks that looks the same.

    To matplotlib each tick is five artists, and a figure of nine log-log panels has a thousand: a second to draw.
    """
    ticked = [axis for axes in figure.axes if axes.axison for axis in (axes.xaxis, axes.yaxis)]
    places = [_minor_places(axis) for axis in ticked]
    for axis in ticked:  # all places first: panels that share an axis share its locator
        axis.set_minor_locator(NullLocator())
    for axis, here in zip(ticked, places, strict=True):
        if len(here):
            axis.axes.add_artist(_marks(axis, here))


def _minor_places(axis: Axis) -> npt.NDArray[np.float64]:
    low, high = sorted(axis.get_view_interval())
    places = axis.get_minorticklocs()
    return np.asarray(places[(places >= low) & (places <= high)])


def _marks(axis: Any, places: npt.NDArray[np.float64]) -> Line2D:
    """Minor ticks at these places as matplotlib would draw them."""
    upright, edge = axis.axis_name == "x", np.zeros(len(places))
    look: Any = mpl.rcParams
    size, width, colour = (look[f"{axis.axis_name}tick.{name}"] for name in ("minor.size", "minor.width", "color"))
    return Line2D(
        *((places, edge) if upright else (edge, places)),
        linestyle="none",
        marker=TICKDOWN if upright else TICKLEFT,
        markersize=size,
        markeredgewidth=width,
        color=colour,
        clip_on=False,
        zorder=axis.get_zorder(),
        transform=axis.axes.get_xaxis_transform("tick1") if upright else axis.axes.get_yaxis_transform("tick1"),
    )
