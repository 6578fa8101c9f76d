"""Lines, marks and bars as they look in a panel and in its key."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from phongbench_reports.chart.pen import Box, Dash, Pen, Vector, line_of, number, polygon, stroke

#: outlines of marks in units of their size, y up; a circle has none
_OUTLINES: dict[str, tuple[tuple[float, float], ...]] = {
    "s": ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)),
    "^": ((0.0, 0.5), (-0.5, -0.5), (0.5, -0.5)),
    "v": ((0.0, -0.5), (0.5, 0.5), (-0.5, 0.5)),
    "D": ((0.0, -(0.5**0.5)), (0.5**0.5, 0.0), (0.0, 0.5**0.5), (-(0.5**0.5), 0.0)),
    "P": tuple(
        (x / 6, y / 6)
        for x, y in (
            (-1, -3),
            (1, -3),
            (1, -1),
            (3, -1),
            (3, 1),
            (1, 1),
            (1, 3),
            (-1, 3),
            (-1, 1),
            (-3, 1),
            (-3, -1),
            (-1, -1),
        )
    ),
    "X": tuple(
        (x / 4, y / 4)
        for x, y in (
            (-1, -2),
            (0, -1),
            (1, -2),
            (2, -1),
            (1, 0),
            (2, 1),
            (1, 2),
            (0, 1),
            (-1, 2),
            (-2, 1),
            (-1, 0),
            (-2, -1),
        )
    ),
}


@dataclass(frozen=True)
class Series:
    """A line with marks, named as matplotlib names it.

    linestyle   "-", "none", or (0, lengths of dashes and gaps in widths of the line)
    marker      o, s, ^, v, D, P, X or x; "" for none
    markevery   (first, step): which points have a mark
    fillstyle   "none": hollow marks
    elinewidth  width of the bars of an interval
    """

    color: str
    linestyle: Dash = "-"
    linewidth: float = 1.5
    marker: str = ""
    markersize: float = 5.0
    markerfacecolor: str | None = None
    markeredgewidth: float = 1.0
    markevery: tuple[int, int] = (0, 1)
    fillstyle: str = "full"
    label: str = ""
    zorder: float = 2.0
    clip_on: bool = True
    elinewidth: float = 0.0

    @property
    def pen(self) -> str:
        """The style of the line."""
        return stroke(self.color, self.linewidth, self.linestyle, cap="square" if self.linestyle == "-" else "")

    def draw(self, pen: Pen, points: Vector, clip: Box | None) -> None:
        """Line and marks through points (n, 2)."""
        clip = clip if self.clip_on else None
        if self.linestyle != "none":
            pen.path(line_of(points), stroke=self.pen, clip=clip)
        self.marks(pen, points[self.markevery[0] :: self.markevery[1]], clip)

    def marks(self, pen: Pen, points: Vector, clip: Box | None = None) -> None:
        """The marks at points (n, 2)."""
        if not self.marker:
            return
        face = "none" if self.fillstyle == "none" or self.marker == "x" else self.markerfacecolor or self.color
        edge = stroke(self.color, self.markeredgewidth, join="" if self.marker == "o" else "miter")
        if clip is not None:  # what lies outside need not be written
            near = np.array(clip[:2]) - self.markersize, np.array(clip[2:]) + self.markersize
            points = points[((points >= near[0]) & (points <= near[1])).all(axis=1)]
        pen.marks(_shape(self.marker, self.markersize), points, fill=face, stroke=edge, clip=clip)

    def key(self, pen: Pen, left: float, middle: float, width: float, size: float) -> None:
        """The sample in a key, from `left` on as wide as `width`; `size` is the key's font size."""
        points = np.array([[left, middle], [left + width, middle]])
        if self.linestyle != "none":
            pen.path(line_of(points), stroke=self.pen)
        if self.elinewidth:
            bar = np.array([[left + width / 2, middle - size / 2], [left + width / 2, middle + size / 2]])
            pen.path(line_of(bar), stroke=stroke(self.color, self.elinewidth))
        self.marks(pen, points.mean(axis=0, keepdims=True))


def series_of(fmt: str, look: dict[str, Any]) -> Series:
    """A series by matplotlib's short form: "o" is marks without a line."""
    short = {"marker": fmt, "linestyle": "none"} if fmt else {}
    known = {name: value for name, value in look.items() if name != "capsize"}
    return Series(**{**short, **known})


def _shape(marker: str, size: float) -> str:
    """Path data of a mark around 0, y down."""
    half = number(size / 2)
    if marker == "o":
        wide = number(size)
        return f"M-{half} 0a{half} {half} 0 1 0 {wide} 0a{half} {half} 0 1 0 -{wide} 0z"
    if marker == "x":
        return f"M-{half} -{half}L{half} {half}M-{half} {half}L{half} -{half}"
    return polygon((size * x, -size * y) for x, y in _OUTLINES[marker])
