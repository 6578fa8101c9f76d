"""A line asked backwards: its intensities, both branches of its normals, and its heights with their band."""

import io
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from phongbench.errors import InputError
from phongbench.inverse.line import MARKS, OK, InverseLine
from phongbench.support.atomic_files import write_bytes
from phongbench.support.user_paths import check_file
from phongbench_reports.plots import BLUE, INK, MUTED, ORANGE, PURPLE, SKY, VERMILION, footnote, ink, sheet, svg_pair

#: mark -> colour and sign of a sample that was not used
_SIGNS = dict(zip(MARKS[1:], ((INK, "v"), (VERMILION, "^"), (ORANGE, "s"), (PURPLE, "x")), strict=True))


def save(line: InverseLine, path: Path) -> None:
    """Write the figure: .svg or .png. InputError for other names."""
    kind = path.suffix.lower()
    if kind not in (".svg", ".png"):
        raise InputError(f"a figure is not written as {path.suffix or path.name}", str(path), "use .svg or .png")
    check_file(path)
    with ink():
        figure = draw(line)
        if kind == ".svg":
            data = svg_pair(figure, "inverse-line")[0]
        else:
            buffer = io.BytesIO()
            figure.savefig(buffer, format="png", dpi=150)
            data = buffer.getvalue()
    write_bytes(path, data)


def draw(line: InverseLine) -> Figure:
    """Intensity, angles of both branches, and height, over x."""
    figure, (intensity, angles, height) = sheet(6.6, 3, 1, sharex=True, top=0.955, bottom=0.095, hspace=0.28)
    intensity.plot(line.x, line.intensity, color=INK, linewidth=1.0)
    for mark, (colour, sign) in _SIGNS.items():
        mine = line.marks == mark
        if mine.any():
            look: Any = {"color": colour, "marker": sign, "linestyle": "none", "markersize": 4}
            intensity.plot(line.x[mine], line.intensity[mine], label=f"{mark} ({int(mine.sum())})", **look)
    if (line.marks != OK).any():
        intensity.legend(loc="best", fontsize=8)
    intensity.set_title("intensity")
    _angles(angles, line)
    _height(height, line)
    height.set_xlabel("x (to the right)")
    usable = int((line.marks == OK).sum())
    footnote(figure, f"{len(line.x)} samples, {usable} usable; z and heights towards the viewer")
    return figure


def _angles(axes: Axes, line: InverseLine) -> None:
    axes.plot(line.x, line.others, color=MUTED, linestyle=(0, (1.5, 1.5)), label="other branch")
    axes.plot(line.x, line.angles, color=BLUE, label="chosen branch")
    axes.axhline(line.facts["light_degrees"], color=ORANGE, linewidth=0.9, linestyle=(0, (4, 3)), label="light")
    axes.legend(loc="best", fontsize=8)
    axes.set_title("normal's angle from the viewer's direction, towards x (degrees)")


def _height(axes: Axes, line: InverseLine) -> None:
    wide = bool(np.nanmax(line.height_high - line.height_low, initial=0.0) > 0)
    if wide:
        axes.fill_between(line.x, line.height_low, line.height_high, color=SKY, alpha=0.4, linewidth=0)
    axes.plot(line.x, line.height, color=BLUE)
    axes.set_title("height, with its 99 % band" if wide else "height")
