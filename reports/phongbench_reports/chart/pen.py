"""Writes SVG: each look once as a class, each shape of a mark once, places in hundredths of a point."""

import base64
from collections.abc import Iterable, Sequence
from html import escape
from itertools import groupby
from typing import Any

import numpy as np
import numpy.typing as npt

from phongbench.support import image_files
from phongbench_reports.chart.lettering import baselines

Vector = npt.NDArray[np.float64]
Dash = str | tuple[int, tuple[float, ...]]
#: left, top, right and bottom
Box = tuple[float, float, float, float]

_FONT = "font-family:'DejaVu Sans','Verdana',sans-serif"
_ANCHORS = {"left": "start", "center": "middle", "right": "end"}
#: what XML cannot hold: such a sign becomes one that says so
_UNHELD = dict.fromkeys([*range(9), 11, 12, *range(14, 32), *range(0xD800, 0xE000), 0xFFFE, 0xFFFF], "\ufffd")
#: a line may leave out points this near to it
_NEAR = 0.04


def number(value: float) -> str:
    """A place in hundredths: "0.5", "12.25", "0"."""
    return f"{value + 0.0:.2f}".rstrip("0").rstrip(".") if abs(value) >= 0.005 else "0"


def line_of(points: Vector) -> str:
    """Path data of a line through points (n, 2), which breaks where one is not finite."""
    parts = []
    for start, end in _runs(np.isfinite(points).all(axis=1)):
        part = points[start:end]
        parts.append("M" + "L".join(f"{number(x)} {number(y)}" for x, y in part[_needed(part)].tolist()))
    return "".join(parts)


def polygon(points: Iterable[tuple[float, float]]) -> str:
    """Path data of a closed outline."""
    return "M" + "L".join(f"{number(x)} {number(y)}" for x, y in points) + "z"


def rectangle(box: Box) -> str:
    """Path data of a box."""
    left, top, right, bottom = map(number, box)
    return f"M{left} {bottom}H{right}V{top}H{left}z"


def _runs(known: Any) -> list[tuple[int, int]]:
    """Start and end of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _needed(points: Vector) -> list[int]:
    """Points that a line must go through, to pass all of them within _NEAR (Douglas and Peucker)."""
    kept, open_ends = {0, len(points) - 1}, [(0, len(points) - 1)]
    while open_ends:
        first, last = open_ends.pop()
        if last - first < 2:
            continue
        x, y = points[last] - points[first]
        between = points[first + 1 : last] - points[first]
        length = float(np.hypot(x, y))
        away = np.abs(x * between[:, 1] - y * between[:, 0]) / length if length else np.hypot(*between.T)
        worst = int(away.argmax())
        if away[worst] > _NEAR:
            kept.add(first + 1 + worst)
            open_ends += [(first, first + 1 + worst), (first + 1 + worst, last)]
    return sorted(kept)


class Pen:
    """Collects what a picture of this size in points shows, first what lies below."""

    def __init__(self, width: float, height: float, title: str) -> None:
        self._size, self._title = (number(width), number(height)), title
        self._looks: dict[str, str] = {}
        self._defined: dict[str, str] = {}
        #: attributes that neighbours may share, and start and end of the element
        self._elements: list[tuple[str, str, str]] = []

    def path(
        self, data: str, *, fill: str = "none", opacity: float = 1.0, clip: Box | None = None, stroke: str = ""
    ) -> None:
        """An outline.

        stroke  as `stroke` gives it
        """
        if not data:
            return
        seen = f";fill-opacity:{opacity:g}" if opacity < 1 else ""
        self._add(f"fill:{fill}{stroke}{seen}", f'<path d="{data}"', "/>", clip)

    def marks(self, shape: str, points: Vector, *, fill: str, stroke: str = "", clip: Box | None = None) -> None:
        """A shape, path data around 0, at points (n, 2)."""
        name = self._define(f'<path d="{shape}" id="{{}}"/>')
        for x, y in points[np.isfinite(points).all(axis=1)].tolist():
            place = f'x="{number(x)}" y="{number(y)}"'
            self._add(f"fill:{fill}{stroke}", f'<use xlink:href="#{name}" {place}', "/>", clip)

    def text(
        self,
        text: str,
        place: tuple[float, float],
        size: float,
        colour: str,
        *,
        ha: str = "left",
        va: str = "baseline",
        bold: bool = False,
        upright: bool = False,
    ) -> None:
        """Lines of text at a place, for `va` see `lettering.baselines`; upright ones are read from below."""
        weight = "font-weight:700;" if bold else ""
        style = f"{weight}font-size:{size:g}px;{_FONT};text-anchor:{_ANCHORS[ha]};fill:{colour}"
        x, y = place
        for line, below in zip(text.split("\n"), baselines(text, size, va), strict=True):
            if upright:
                start = f'<text transform="translate({number(x + below)} {number(y)})rotate(-90)"'
            else:
                start = f'<text x="{number(x)}" y="{number(y + below)}"'
            self._add(style, start, f">{_written(line)}</text>", None)

    def picture(self, pixels: npt.NDArray[np.uint8], box: Box, *, sharp: bool, clip: Box | None = None) -> None:
        """A picture (height, width, 3) of codes that fills a box.

        sharp  whether its pixels stay squares where it is shown larger
        """
        left, top, right, bottom = box
        code = base64.b64encode(image_files.png(np.ascontiguousarray(pixels))).decode("ascii")
        place = f'x="{number(left)}" y="{number(top)}" width="{number(right - left)}" height="{number(bottom - top)}"'
        start = f'<image {place} preserveAspectRatio="none" xlink:href="data:image/png;base64,{code}"'
        self._add("image-rendering:pixelated" if sharp else "", start, "/>", clip)

    def _add(self, style: str, start: str, end: str, clip: Box | None) -> None:
        looks = f' class="{self._looks.setdefault(style, f"s{len(self._looks)}")}"' if style else ""
        if clip is not None:
            left, top, right, bottom = clip
            shape = f'<rect x="{number(left)}" y="{number(top)}" width="{number(right - left)}"'
            name = self._define(f'<clipPath id="{{}}">\n{shape} height="{number(bottom - top)}"/>\n</clipPath>')
            looks += f' clip-path="url(#{name})"'
        self._elements.append((looks, start, end))

    def _define(self, element: str) -> str:
        """The name of an element that others refer to."""
        return self._defined.setdefault(element, f"a{len(self._defined)}")

    def svg(self) -> bytes:
        """All of it as a file."""
        wide, high = self._size
        head = f'width="{wide}pt" height="{high}pt" viewBox="0 0 {wide} {high}" version="1.1"'
        rules = "".join(f"\n.{name}{{{style}}}" for style, name in self._looks.items())
        lines = [
            '<?xml version="1.0" encoding="utf-8"?>',
            f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" {head}>',
            f"<title>{_written(self._title)}</title>",
            f'<defs>\n<style type="text/css">svg{{stroke-linejoin:round;stroke-linecap:butt}}{rules}\n</style>',
            *(element.replace("{}", name, 1) for element, name in self._defined.items()),
            "</defs>",
            *_grouped(self._elements),
            "</svg>\n",
        ]
        return "\n".join(lines).encode("utf-8")


def _grouped(elements: Sequence[tuple[str, str, str]]) -> Iterable[str]:
    """Neighbours of one look in a group that has it; marks always, since their own clip would move with them."""
    for looks, members in groupby(elements, key=lambda one: one[0]):
        alike = list(members)
        if looks and (len(alike) > 2 or alike[0][1].startswith("<use")):
            yield f"<g{looks}>"
            yield from (start + end for _, start, end in alike)
            yield "</g>"
        else:
            yield from (start + looks + end for _, start, end in alike)


def _written(text: str) -> str:
    """Text as XML holds it; blanks at its ends are kept, which readers would leave out."""
    inner, nothing = text.strip(" "), "\u00a0"
    before = nothing * (len(text) - len(text.lstrip(" ")))
    kept = before + inner + nothing * (len(text) - len(before) - len(inner))
    return escape(kept.translate(_UNHELD), quote=False)


def stroke(colour: str, width: float, dash: Dash = "-", *, cap: str = "", join: str = "") -> str:
    """The part of a style that says how a line looks; dashes are in units of its width. None for no width."""
    if not width or dash == "none":
        return ""
    pattern = f";stroke-dasharray:{','.join(f'{width * d:g}' for d in dash[1])}" if isinstance(dash, tuple) else ""
    ends = f";stroke-linecap:{cap}" if cap else ""
    corners = f";stroke-linejoin:{join}" if join else ""
    return f";stroke:{colour};stroke-width:{width:g}{pattern}{ends}{corners}"
