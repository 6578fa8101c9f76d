"""Words at places, and names with a hair line to what they name."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from phongbench_reports.chart.lettering import baselines, height, width
from phongbench_reports.chart.palette import INK
from phongbench_reports.chart.pen import Box, Pen, number, rectangle, stroke

if TYPE_CHECKING:
    from phongbench_reports.chart.axes import Axes

#: points that a hair line keeps from a name without a ground
_CLEAR = 2.0


@dataclass(frozen=True)
class Words:
    """A text of one or several lines, named as matplotlib names its look."""

    text: str
    color: str = INK
    fontsize: float = 9.0
    ha: str = "left"
    va: str = "baseline"
    fontweight: str = "normal"

    def draw(self, pen: Pen, x: float, y: float) -> None:
        """At a place."""
        bold = self.fontweight == "bold"
        if self.text:
            pen.text(self.text, (x, y), self.fontsize, self.color, ha=self.ha, va=self.va, bold=bold)

    def box(self, x: float, y: float, pad: float = 0.0) -> Box:
        """What it covers at a place, and so many points around."""
        wide, high = width(self.text, self.fontsize), height(self.text, self.fontsize)
        left = x - {"left": 0.0, "center": wide / 2, "right": wide}[self.ha]
        top = y + baselines(self.text, self.fontsize, self.va)[0] - baselines(self.text, self.fontsize, "top")[0]
        return left - pad, top - pad, left + wide + pad, top + high + pad


def annotate(
    pen: Pen,
    axes: Axes,
    text: str,
    xy: tuple[float, float],
    xytext: tuple[float, float],
    *,
    textcoords: str = "axes fraction",
    annotation_clip: bool | None = None,
    bbox: dict[str, Any] | None = None,
    arrowprops: dict[str, Any] | None = None,
    **look: Any,
) -> None:
    """A text beside the point `xy`; none where that lies outside the panel, unless `annotation_clip` is False.

    xytext      where, in shares of the panel, or in points from `xy`
    textcoords  which of the two: "axes fraction" or "offset points"
    bbox        its ground: facecolor, and how many points around as pad
    arrowprops  its hair line: color, linewidth, and by how many points shrinkA and shrinkB it is shorter
    """
    x, y = axes.at(*xy).tolist()
    left, top, right, bottom = axes.box
    inside = left - 1e-6 <= x <= right + 1e-6 and top - 1e-6 <= y <= bottom + 1e-6
    if not inside and annotation_clip is not False:
        return
    if textcoords == "offset points":
        place = (x + xytext[0], y - xytext[1])
    else:
        place = tuple(axes.at(*xytext, ("axes", "axes")).tolist())
    words = Words(text, **look)
    if arrowprops is not None:
        _hair(pen, words.box(*place, bbox["pad"] if bbox else _CLEAR), (x, y), arrowprops)
    if bbox is not None:
        pen.path(rectangle(words.box(*place, bbox["pad"])), fill=bbox["facecolor"])
    words.draw(pen, *place)


def _hair(pen: Pen, box: Box, end: tuple[float, float], look: dict[str, Any]) -> None:
    """A line from the middle of a box to a point, as far as it lies outside."""
    left, top, right, bottom = box
    x, y = (left + right) / 2, (top + bottom) / 2
    across, down = end[0] - x, end[1] - y
    reach = [half / abs(way) for half, way in (((right - left) / 2, across), ((bottom - top) / 2, down)) if way]
    length = math.hypot(across, down)
    if not reach or min(reach) >= 1.0:
        return
    first, last = min(reach) + look["shrinkA"] / length, 1.0 - look["shrinkB"] / length
    if first < last:
        (a, b), (c, d) = ((x + part * across, y + part * down) for part in (first, last))
        line = f"M{number(a)} {number(b)}L{number(c)} {number(d)}"
        pen.path(line, stroke=stroke(look["color"], look["linewidth"], cap="round"))
