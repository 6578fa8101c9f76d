"""A figure: panels in a grid, and words and keys around them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from phongbench_reports.chart.axes import Axes
from phongbench_reports.chart.legend import Legend
from phongbench_reports.chart.palette import SURFACE
from phongbench_reports.chart.pen import Box, Pen, rectangle
from phongbench_reports.chart.scale import Scale
from phongbench_reports.chart.series import Series
from phongbench_reports.chart.words import Words


class Figure:
    """Empty, so many inches wide and high."""

    def __init__(self, figsize: tuple[float, float] = (1.0, 1.0)) -> None:
        self.width, self.height = (72.0 * inches for inches in figsize)
        self.axes: list[Axes] = []
        self._drawn: list[Callable[[Pen], None]] = []

    def panels(
        self,
        rows: int,
        columns: int,
        *,
        spacing: dict[str, float],
        sharex: bool = False,
        sharey: bool | str = False,
        width_ratios: Sequence[float] | None = None,
    ) -> list[Axes]:
        """Panels in reading order; those that share a scale show its labels at the lower or left side only.

        spacing       left, right, bottom and top of them all, in shares of the figure; wspace and hspace between two,
                      in shares of the mean panel
        sharey        "row": those of a row share it
        width_ratios  of the columns; alike, if there are none
        """
        across = _cells(spacing["left"], spacing["right"], spacing["wspace"], width_ratios or [1.0] * columns)
        down = _cells(1.0 - spacing["top"], 1.0 - spacing["bottom"], spacing["hspace"], [1.0] * rows)
        one_x, one_y, of_row = Scale(), Scale(), [Scale() for _ in range(rows)]
        for row, (top, bottom) in enumerate(down):
            for column, (left, right) in enumerate(across):
                xaxis = one_x if sharex else Scale()
                yaxis = of_row[row] if sharey == "row" else one_y if sharey else Scale()
                shows = ("x" if not sharex or row == rows - 1 else "") + ("y" if not sharey or column == 0 else "")
                self.axes.append(Axes(self._points((left, top, right, bottom)), xaxis, yaxis, shows))
        return self.axes[-rows * columns :]

    def _points(self, shares: Box) -> Box:
        left, top, right, bottom = shares
        return left * self.width, top * self.height, right * self.width, bottom * self.height

    def add_axes(self, place: tuple[float, float, float, float]) -> Axes:
        """A panel by its left and lower end, width and height, in shares of the figure."""
        left, bottom, wide, high = place
        axes = Axes(self._points((left, 1 - bottom - high, left + wide, 1 - bottom)), Scale(), Scale())
        self.axes.append(axes)
        return axes

    def text(self, x: float, y: float, text: str, **look: Any) -> None:
        """Words at a place in shares of the figure."""
        words = Words(text, **look)
        self._drawn.append(lambda pen: words.draw(pen, x * self.width, (1 - y) * self.height))

    def legend(self, handles: Sequence[Series], labels: Sequence[str], **look: Any) -> None:
        """A key of these series in the figure."""
        key = Legend(tuple(handles), tuple(labels), **look)
        self._drawn.append(lambda pen: key.draw(pen, (0.0, 0.0, self.width, self.height), np.empty((0, 2))))

    def svg(self, title: str) -> bytes:
        """The picture as SVG: the same figure gives the same bytes."""
        pen = Pen(self.width, self.height, title)
        pen.path(rectangle((0.0, 0.0, self.width, self.height)), fill=SURFACE)
        for axes in self.axes:
            axes.draw(pen)
        for draw in self._drawn:
            draw(pen)
        return pen.svg()


def _cells(start: float, end: float, space: float, ratios: Sequence[float]) -> list[tuple[float, float]]:
    """Start and end of cells whose widths are as these ratios, with so much space between, in mean widths."""
    mean = (end - start) / (len(ratios) + space * (len(ratios) - 1))
    cells, at = [], start
    for ratio in ratios:
        wide = mean * len(ratios) * ratio / sum(ratios)
        cells.append((at, at + wide))
        at += wide + space * mean
    return cells
