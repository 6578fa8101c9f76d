"""The key of a panel or figure: a sample of each series beside its name, in columns, where there is room."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from phongbench_reports.chart.lettering import ASCENT, DESCENT, height, width
from phongbench_reports.chart.palette import INK
from phongbench_reports.chart.pen import Box, Pen, Vector
from phongbench_reports.chart.series import Series

#: where a key is put that is to hide as little as it can, the first one first
_CORNERS = ("upper right", "upper left", "lower left", "lower right")


@dataclass(frozen=True)
class Legend:
    """Samples and names; lengths are in font sizes, as matplotlib names them.

    loc             which of its corners or edges lies at the same of what it is in: "upper left", or "best"
    bbox_to_anchor  the place, in shares of that, where this corner lies instead
    alignment       of the title: left or center
    labelcolor      "linecolor": names in the colour of their series
    """

    handles: Sequence[Series]
    labels: Sequence[str]
    loc: str
    fontsize: float = 9.0
    bbox_to_anchor: tuple[float, float] | None = None
    ncols: int = 1
    title: str = ""
    title_fontsize: float = 9.0
    alignment: str = "center"
    labelcolor: str = ""
    borderpad: float = 0.4
    borderaxespad: float = 0.5
    handlelength: float = 2.0
    handletextpad: float = 0.8
    labelspacing: float = 0.5
    columnspacing: float = 2.0

    def _columns(self) -> list[list[tuple[Series, str]]]:
        pairs = list(zip(self.handles, self.labels, strict=True))
        parts = np.array_split(np.arange(len(pairs)), self.ncols)
        return [[pairs[index] for index in part] for part in parts if len(part)]

    def _wide(self, column: list[tuple[Series, str]]) -> float:
        return self.fontsize * (self.handlelength + self.handletextpad) + max(
            width(n, self.fontsize) for _, n in column
        )

    def _high(self, column: list[tuple[Series, str]]) -> float:
        rows = sum(height(name, self.fontsize) for _, name in column)
        return rows + self.fontsize * self.labelspacing * (len(column) - 1)

    def draw(self, pen: Pen, around: Box, points: Vector) -> None:
        """In a box; of points (n, 2) a key that is put where it is best hides few."""
        columns, size, pad = self._columns(), self.fontsize, self.fontsize * self.borderpad
        if not columns:
            return
        wide = sum(map(self._wide, columns)) + size * self.columnspacing * (len(columns) - 1)
        wide = max(wide, width(self.title, self.title_fontsize) if self.title else 0.0)
        above = self.title_fontsize + size * self.labelspacing if self.title else 0.0
        whole = (wide + 2 * pad, above + max(map(self._high, columns)) + 2 * pad)
        left, top = self._corner(around, whole, points)
        left, top = left + pad, top + pad
        if self.title:
            x = left + (wide / 2 if self.alignment == "center" else 0.0)
            pen.text(self.title, (x, top), self.title_fontsize, INK, ha=self.alignment, va="top")
        for column in columns:
            self._draw_column(pen, column, left, top + above)
            left += self._wide(column) + size * self.columnspacing

    def _draw_column(self, pen: Pen, column: list[tuple[Series, str]], left: float, top: float) -> None:
        size = self.fontsize
        for series, name in column:
            high = height(name, size)
            # a sample lies amid its name, as high as its letters without a tail
            middle = top + high / 2 + size * (ASCENT - DESCENT) / 2 - 0.35 * size
            middle += size * DESCENT / 2 if "\n" in name else 0.0
            series.key(pen, left, middle, size * self.handlelength, size)
            colour = series.color if self.labelcolor == "linecolor" else INK
            pen.text(name, (left + size * (self.handlelength + self.handletextpad), top), size, colour, va="top")
            top += high + size * self.labelspacing

    def _corner(self, around: Box, whole: tuple[float, float], points: Vector) -> tuple[float, float]:
        """Its upper left corner."""
        if self.loc != "best":
            return self._placed(self.loc, around, whole)

        def hidden(loc: str) -> int:
            x, y = self._placed(loc, around, whole)
            low, high = np.array([x, y]), np.array([x + whole[0], y + whole[1]])
            return int(((points >= low) & (points <= high)).all(axis=1).sum())

        return self._placed(min(_CORNERS, key=hidden), around, whole)

    def _placed(self, loc: str, around: Box, whole: tuple[float, float]) -> tuple[float, float]:
        left, top, right, bottom = around
        if self.bbox_to_anchor is not None:
            x, y = self.bbox_to_anchor
            left = right = left + x * (right - left)
            top = bottom = bottom - y * (bottom - top)
        away = self.fontsize * self.borderaxespad
        across = left + away if "left" in loc else right - away - whole[0]
        middle = (top + bottom - whole[1]) / 2
        return across, top + away if "upper" in loc else bottom - away - whole[1] if "lower" in loc else middle
