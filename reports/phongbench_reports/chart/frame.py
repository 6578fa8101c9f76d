"""What stands around the marks of a panel: ground, grid, ticks and their labels, frame, names of scales, title."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from phongbench_reports.chart.lettering import height, width
from phongbench_reports.chart.palette import GRID, INK, MUTED, SURFACE
from phongbench_reports.chart.pen import Pen, number, rectangle, stroke

if TYPE_CHECKING:
    from phongbench_reports.chart.axes import Axes

#: small ticks: length and width; points between a tick and its label, and from there to the name of the scale
_SMALL, _THIN, _PAD, _NAME_PAD, _NAME_SIZE = 2.0, 0.6, 3.5, 4.0, 9.0
Layer = tuple[float, int, Callable[[Pen], None]]


def layers(axes: Axes) -> Iterator[Layer]:
    """Each part with its height among the marks, and what draws it."""
    if axes.axison:
        if axes.framed:
            yield -1.0, 0, lambda pen: pen.path(rectangle(axes.box), fill=SURFACE)
            yield 2.5, -1, lambda pen: _spines(axes, pen)
        yield 0.5, -1, lambda pen: _scales(axes, pen)
    yield 3.0, -1, lambda pen: _title(axes, pen)


def _spines(axes: Axes, pen: Pen) -> None:
    left, top, right, bottom = map(number, axes.box)
    pen.path(f"M{left} {top}V{bottom}H{right}", stroke=stroke(MUTED, 0.8, cap="square", join="miter"))


def _scales(axes: Axes, pen: Pen) -> None:
    """Grid, ticks, labels and names of both scales."""
    left, top, right, bottom = axes.box
    found = {"x": axes.xaxis.ticks(int((right - left) / 27)), "y": axes.yaxis.ticks(int((bottom - top) / 18))}
    places = {name: _places(axes, name, [value for value, _ in ticks]) for name, ticks in found.items()}
    small = {"x": _places(axes, "x", axes.xaxis.small_ticks()), "y": _places(axes, "y", axes.yaxis.small_ticks())}
    for name in "xy":
        if name in axes.grids:
            lines = [
                f"M{number(p)} {number(bottom)}V{number(top)}"
                if name == "x"
                else f"M{number(left)} {number(p)}H{number(right)}"
                for p in places[name]
            ]
            pen.path("".join(lines), stroke=stroke(GRID, 0.7))
    for name in "xy":
        pen.path(_marks(axes, name, small[name], _SMALL), stroke=stroke(MUTED, _THIN))
        pen.path(_marks(axes, name, places[name], axes.tick_lengths[name]), stroke=stroke(MUTED, 0.8))
    for name, scale in (("x", axes.xaxis), ("y", axes.yaxis)):
        labels = [label for _, label in found[name]] if name in axes.shows else []
        _labels(axes, pen, name, list(zip(places[name], labels, strict=False)), scale.fontsize)


def _places(axes: Axes, name: str, values: list[float]) -> list[float]:
    """Where values of a scale are, in points along it."""
    if not values:
        return []
    zeros = [0.0] * len(values)
    found = axes.at(values, zeros, ("data", "axes")) if name == "x" else axes.at(zeros, values, ("axes", "data"))
    return [float(place) for place in found[:, "xy".index(name)]]


def _marks(axes: Axes, name: str, places: list[float], length: float) -> str:
    left, _, _, bottom = axes.box
    if not length:
        return ""
    if name == "x":
        return "".join(f"M{number(place)} {number(bottom)}v{number(length)}" for place in places)
    return "".join(f"M{number(left)} {number(place)}h-{number(length)}" for place in places)


def _labels(axes: Axes, pen: Pen, name: str, labels: list[tuple[float, str]], size: float) -> None:
    """The labels of a scale's ticks, and beyond them its name."""
    left, top, right, bottom = axes.box
    beyond = axes.tick_lengths[name] + _PAD
    for place, label in labels:
        if label and name == "x":
            pen.text(label, (place, bottom + beyond), size, INK, ha="center", va="top")
        elif label:
            pen.text(label, (left - beyond, place), size, INK, ha="right", va="center_baseline")
    shown = [label for _, label in labels if label]
    if not axes.names[name]:
        return
    measure = height if name == "x" else width
    room = beyond + max(measure(label, size) for label in shown) if shown else axes.tick_lengths[name]
    if name == "x":
        middle = ((left + right) / 2, bottom + room + _NAME_PAD)
        pen.text(axes.names[name], middle, _NAME_SIZE, INK, ha="center", va="top")
    else:
        middle = (left - room - _NAME_PAD, (top + bottom) / 2)
        pen.text(axes.names[name], middle, _NAME_SIZE, INK, ha="center", va="bottom", upright=True)


def _title(axes: Axes, pen: Pen) -> None:
    text, loc, pad, size = axes.titled
    left, top, right, _ = axes.box
    if text:
        x = left if loc == "left" else (left + right) / 2
        pen.text(text, (x, top - pad), size, INK, ha=loc, bold=True)
