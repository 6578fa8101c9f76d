"""A panel of a figure with its marks, which have the names, and the meaning, that matplotlib gives them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from phongbench_reports.chart import frame
from phongbench_reports.chart.legend import Legend
from phongbench_reports.chart.panel import DATA, Kind, Panel
from phongbench_reports.chart.pen import Pen, Vector, line_of, polygon, stroke
from phongbench_reports.chart.series import Series, series_of
from phongbench_reports.chart.words import Words, annotate


class Axes(Panel):
    """A panel to draw in; scales have room for what is drawn, unless they have limits."""

    def __init__(self, *place_and_scales: Any) -> None:
        super().__init__(*place_and_scales)
        self.images: list[npt.NDArray[np.uint8]] = []
        self._series: list[Series] = []
        self._lines: list[tuple[Vector, Vector]] = []

    def plot(self, x: Any, y: Any, fmt: str = "", **look: Any) -> list[Series]:
        """A line with marks through points; see `Series` for its look."""
        series, xs, ys = series_of(fmt, look), np.asarray(x, float), np.asarray(y, float)
        self._reach(xs, ys)
        self._lines.append((xs, ys))
        self._series += [series] if series.label else []
        self._add(series.zorder, lambda pen: series.draw(pen, self.at(xs, ys), self.box))
        return [series]

    def step(self, x: Any, y: Any, where: str, **look: Any) -> None:
        """A line of steps that keeps each value up to the next place."""
        if where != "post":
            raise ValueError(where)
        xs, ys = np.repeat(np.asarray(x, float), 2)[1:], np.repeat(np.asarray(y, float), 2)[:-1]
        self.plot(xs, ys, **look)

    def errorbar(self, x: Any, y: Any, *, yerr: Vector, fmt: str, **look: Any) -> None:
        """Marks with intervals in y; `yerr` (2, n) are their parts below and above."""
        series, xs, ys = series_of(fmt, look), np.asarray(x, float), np.asarray(y, float)
        self._series += [series] if series.label else []
        ends = np.stack([xs, ys - yerr[0]], -1), np.stack([xs, ys + yerr[1]], -1)
        self._segments(ends, series.color, series.elinewidth, series.zorder)
        self._reach(xs, ys)
        self._add(series.zorder, lambda pen: series.draw(pen, self.at(xs, ys), self.box))

    def hlines(self, y: Any, xmin: Any, xmax: Any, *, color: str, linewidth: float, zorder: float = 2.0) -> None:
        """Lines across, each from one place to another."""
        ends = [np.stack(np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float)), -1) for x in (xmin, xmax)]
        self._segments(ends, color, linewidth, zorder)

    def _segments(self, ends: Sequence[Vector], colour: str, width: float, zorder: float) -> None:
        first, last = ends
        self._reach(*np.concatenate([first, last]).T)

        def draw(pen: Pen) -> None:
            pairs = np.stack([self.at(*first.T), self.at(*last.T)], axis=1)
            pen.path("".join(map(line_of, pairs)), stroke=stroke(colour, width), clip=self.box)

        self._add(zorder, draw)

    def axhline(self, y: float, *, zorder: float = 2.0, **look: Any) -> None:
        """A line across the whole panel; see `Series` for its look."""
        self.yaxis.reach([y])
        self._across(("axes", "data"), [(0.0, y), (1.0, y)], zorder, look)

    def axvline(self, x: float, *, zorder: float = 2.0, **look: Any) -> None:
        """A line up the whole panel; see `Series` for its look."""
        self.xaxis.reach([x])
        self._across(("data", "axes"), [(x, 0.0), (x, 1.0)], zorder, look)

    def _across(self, kind: Kind, ends: list[tuple[float, float]], zorder: float, look: dict[str, Any]) -> None:
        (xs, ys), series = zip(*ends, strict=True), series_of("", look)
        self._series += [series] if series.label else []
        self._add(zorder, lambda pen: series.draw(pen, self.at(xs, ys, kind), self.box))

    def axhspan(self, ymin: float, ymax: float, *, color: str, alpha: float, linewidth: float) -> None:
        """A band across the whole panel."""
        self.yaxis.reach([ymin, ymax])
        self._area(("axes", "data"), [(0, ymin), (1, ymin), (1, ymax), (0, ymax)], color, "", alpha)

    def fill(
        self,
        x: Any,
        y: Any,
        *,
        facecolor: str,
        edgecolor: str = "none",
        linewidth: float = 0.0,
        alpha: float = 1.0,
        zorder: float = 1.0,
    ) -> None:
        """The area within an outline."""
        self._reach(np.asarray(x, float), np.asarray(y, float))
        edge = "" if edgecolor == "none" else stroke(edgecolor, linewidth, join="miter")
        self._area(DATA, list(zip(x, y, strict=True)), facecolor, edge, alpha, zorder)

    def barh(
        self,
        y: Any,
        width: Any,
        *,
        height: float,
        color: str,
        left: Any = 0.0,
        linewidth: float = 0.0,
        xerr: Vector | None = None,
        error_kw: dict[str, Any] | None = None,
    ) -> None:
        """Bars across, without an edge; `xerr` (2, n) are parts of an interval below and above their ends."""
        assert not linewidth
        ys, first, wide = np.broadcast_arrays(*(np.asarray(v, float) for v in (y, left, width)))
        self.xaxis.reach(np.concatenate([first, first + wide]), ends=[*first.tolist()])
        for low, start, end in zip(ys - height / 2, first, first + wide, strict=True):
            corners = [(start, low), (end, low), (end, low + height), (start, low + height)]
            self.yaxis.reach([low, low + height])
            self._area(DATA, corners, color)
        if xerr is not None:
            look = error_kw or {}
            ends = [np.stack([first + wide + off, ys], -1) for off in (-xerr[0], xerr[1])]
            self._segments(ends, look["ecolor"], look["elinewidth"], 2.0)

    def _area(
        self,
        kind: Kind,
        corners: Sequence[tuple[float, float]],
        fill: str,
        edge: str = "",
        opacity: float = 1.0,
        zorder: float = 1.0,
    ) -> None:
        xs, ys = zip(*corners, strict=True)

        def draw(pen: Pen) -> None:
            outline = polygon((x, y) for x, y in self.at(xs, ys, kind).tolist())
            pen.path(outline, fill=fill, stroke=edge, opacity=opacity, clip=self.box)

        self._add(zorder, draw)

    def imshow(
        self,
        picture: npt.NDArray[np.uint8],
        *,
        interpolation: str = "antialiased",
        aspect: str = "equal",
        extent: tuple[float, float, float, float] | None = None,
    ) -> None:
        """A picture of codes, its first row on top; unless its aspect is `auto` it keeps its shape.

        extent  values at its left, right, bottom and top
        """
        tall, wide = picture.shape[:2]
        left, right, bottom, top = extent or (-0.5, wide - 0.5, tall - 0.5, -0.5)
        self.set_xlim(left, right)
        self.set_ylim(bottom, top)
        self._square = wide / tall if aspect == "equal" else None
        self.images.append(picture)
        self._add(0.0, lambda pen: pen.picture(picture, self.box, sharp=interpolation == "nearest"))

    def text(self, x: float, y: float, text: str, *, transform: Kind = DATA, zorder: float = 3.0, **look: Any) -> None:
        """Words at a place; see `Words` for their look."""
        words = Words(text, **look)
        self._add(zorder, lambda pen: words.draw(pen, *self.at(x, y, transform).tolist()))

    def annotate(
        self, text: str, xy: tuple[float, float], xytext: tuple[float, float], *, zorder: float = 3.0, **look: Any
    ) -> None:
        """Words beside a point, see `words.annotate`."""
        self._add(zorder, lambda pen: annotate(pen, self, text, xy, xytext, **look))

    def legend(self, handles: Sequence[Series] = (), labels: Sequence[str] = (), **look: Any) -> None:
        """A key of these series, or of all that have a label, in the panel."""
        known, named = (handles, labels) if handles else self.get_legend_handles_labels()
        key = Legend(tuple(known), tuple(named), **look)
        self._add(5.0, lambda pen: key.draw(pen, self.box, self._points()))

    def _points(self) -> Vector:
        """The points of all lines."""
        return np.concatenate([np.empty((0, 2)), *(self.at(*line) for line in self._lines)])

    def get_legend_handles_labels(self) -> tuple[list[Series], list[str]]:
        """The series that have a label, and the labels."""
        return self._series, [series.label for series in self._series]

    def draw(self, pen: Pen) -> None:
        """All of it, from what lies below to what lies above."""
        layers = [*self._drawn, *frame.layers(self)]
        for _, _, draw in sorted(layers, key=lambda layer: layer[:2]):
            draw(pen)
