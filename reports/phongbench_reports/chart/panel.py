"""A panel of a figure without its marks: its place, scales and words, by the names that matplotlib gives them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from phongbench_reports.chart.pen import Box, Pen, Vector
from phongbench_reports.chart.scale import Scale

#: of which of the panel's measures a place is told, x and y
Kind = tuple[str, str]
DATA: Kind = ("data", "data")


class Panel:
    """A panel.

    place         left, top, right and bottom in points
    xaxis, yaxis  its scales, which it may share
    shows         directions whose tick labels stand here
    """

    transAxes: Kind = ("axes", "axes")  # noqa: N815 - as matplotlib calls it

    def __init__(self, place: Box, xaxis: Scale, yaxis: Scale, shows: str = "xy") -> None:
        self.place, self.xaxis, self.yaxis, self.shows = place, xaxis, yaxis, set(shows)
        self.axison, self.framed = True, True
        self.grids, self.tick_lengths = {"x", "y"}, {"x": 3.5, "y": 3.5}
        self.titled: tuple[str, str, float, float] = ("", "left", 6.0, 9.5)
        self.names = {"x": "", "y": ""}
        self._square: float | None = None
        self._drawn: list[tuple[float, int, Callable[[Pen], None]]] = []

    @property
    def box(self) -> Box:
        """Left, top, right and bottom in points; of a picture that keeps its shape, as far as it fills the panel."""
        left, top, right, bottom = self.place
        if self._square is None:
            return self.place
        wide, high = right - left, bottom - top
        shown = min(wide, high * self._square)
        x, y = (wide - shown) / 2, (high - shown / self._square) / 2
        return left + x, top + y, right - x, bottom - y

    def at(self, x: Any, y: Any, kind: Kind = DATA) -> Vector:
        """Places (n, 2) in points of values, or of shares of the panel's width and height."""
        left, top, right, bottom = self.box
        across = self.xaxis.fractions(x) if kind[0] == "data" else np.asarray(x, float)
        up = self.yaxis.fractions(y) if kind[1] == "data" else np.asarray(y, float)
        return np.stack(np.broadcast_arrays(left + across * (right - left), bottom - up * (bottom - top)), axis=-1)

    def get_xaxis_transform(self) -> Kind:
        """Values in x, shares of the height in y."""
        return ("data", "axes")

    def get_yaxis_transform(self) -> Kind:
        """Shares of the width in x, values in y."""
        return ("axes", "data")

    def set(self, **properties: Any) -> None:
        """Several properties at once: set(xlabel=...) is set_xlabel(...)."""
        for name, value in properties.items():
            getattr(self, f"set_{name}")(*value if name in ("xlim", "ylim") else (value,))

    def set_xlim(self, left: float | None = None, right: float | None = None) -> None:
        """The ends of the horizontal scale."""
        self.xaxis.limit(left, right)

    def set_ylim(self, bottom: float | None = None, top: float | None = None) -> None:
        """The ends of the vertical scale."""
        self.yaxis.limit(bottom, top)

    def get_xlim(self) -> tuple[float, float]:
        """The ends of the horizontal scale."""
        return self.xaxis.limits

    def get_ylim(self) -> tuple[float, float]:
        """The ends of the vertical scale."""
        return self.yaxis.limits

    def invert_yaxis(self) -> None:
        """Exchange the ends of the vertical scale."""
        self.yaxis.flip()

    def get_xscale(self) -> str:
        """Which, linear or log, the horizontal scale is."""
        return "log" if self.xaxis.log else "linear"

    def get_yscale(self) -> str:
        """Which, linear or log, the vertical scale is."""
        return "log" if self.yaxis.log else "linear"

    def set_xscale(self, kind: str, *, base: int = 10) -> None:
        """Make the horizontal scale logarithmic; whatever its base, ticks are set apart."""
        self.xaxis.log = kind == "log"

    def set_yscale(self, kind: str) -> None:
        """Make the vertical scale logarithmic."""
        self.yaxis.log = kind == "log"

    def set_xticks(
        self,
        places: Iterable[float],
        labels: Iterable[str] | None = None,
        *,
        minor: bool = False,
        fontsize: float | None = None,
    ) -> None:
        """Ticks of the horizontal scale, with these labels or their numbers; small ones have none."""
        _set_ticks(self.xaxis, list(places), labels, fontsize, minor=minor)

    def set_yticks(
        self,
        places: Iterable[float],
        labels: Iterable[str] | None = None,
        *,
        minor: bool = False,
        fontsize: float | None = None,
    ) -> None:
        """The same of the vertical scale."""
        _set_ticks(self.yaxis, list(places), labels, fontsize, minor=minor)

    def set_xlabel(self, name: str) -> None:
        """What the horizontal scale is of."""
        self.names["x"] = name

    def set_ylabel(self, name: str) -> None:
        """What the vertical scale is of."""
        self.names["y"] = name

    def set_title(self, title: str, *, loc: str = "left", pad: float = 6.0, fontsize: float = 9.5) -> None:
        """Words above the panel, `pad` points from it."""
        self.titled = (title, loc, pad, fontsize)

    def tick_params(self, axis: str = "both", *, length: float | None = None, labelbottom: bool | None = None) -> None:
        """How long ticks are, and whether labels stand below the panel."""
        if length is not None:
            self.tick_lengths |= dict.fromkeys(_directions(axis), length)
        if labelbottom is not None:
            self.shows = self.shows | {"x"} if labelbottom else self.shows - {"x"}

    def grid(self, visible: bool, axis: str = "both") -> None:
        """Whether lines lead across the panel at ticks."""
        self.grids = self.grids | _directions(axis) if visible else self.grids - _directions(axis)

    def set_axis_off(self) -> None:
        """Leave scales, frame and ground out."""
        self.axison = False

    def set_frame_on(self, framed: bool) -> None:
        """Whether the panel has a frame and a ground."""
        self.framed = framed

    def _reach(self, xs: Vector, ys: Vector) -> None:
        self.xaxis.reach(xs)
        self.yaxis.reach(ys)

    def _add(self, zorder: float, draw: Callable[[Pen], None]) -> None:
        self._drawn.append((zorder, len(self._drawn), draw))


def _directions(axis: str) -> set[str]:
    return {"x", "y"} if axis == "both" else {axis}


def _set_ticks(
    scale: Scale, places: list[float], labels: Iterable[str] | None, fontsize: float | None, *, minor: bool
) -> None:
    if minor:
        scale.subdivide(places)
        return
    scale.name(places, labels)
    scale.fontsize = fontsize or scale.fontsize
