"""One formula's lobe and its error against the angle: the picture that the service draws of a curve."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from phongbench_reports.plots import BLUE, INK, VERMILION, budget_lines, footnote, ink, log_axis, sheet, svg_pair
from phongbench_reports.text import number

#: errors below this are rounding of the curve's own float64 evaluation
FLOOR = 1e-7
#: matplotlib's settings belong to the process
_ONE_AT_A_TIME = threading.Lock()


def svg(name: str, alpha: float, found: Mapping[str, npt.NDArray[Any]]) -> bytes:
    """The lobe beside exact Phong's, and the size of their difference on a log axis, as SVG for a light page.

    name   str    of the formula, for people
    alpha  float  exponent of exact Phong
    found  arrays angle_degrees, value, exact, error of equal length
    """
    angle = found["angle_degrees"]
    with _ONE_AT_A_TIME, ink():
        figure, (lobe, size) = sheet(3.6, 1, 2, left=0.07, wspace=0.18, bottom=0.2, top=0.88)
        lobe.plot(angle, found["exact"], color=INK, linestyle=(0, (5, 2)), label="exact Phong")
        lobe.plot(angle, found["value"], color=BLUE, label=name)
        lobe.legend(loc="upper right", fontsize=8)
        lobe.set_title("highlight")
        size.plot(angle, np.maximum(np.abs(found["error"]), FLOOR), color=VERMILION)
        size.set_ylim(FLOOR, max(1.0, 2.0 * float(np.abs(found["error"]).max())))
        log_axis(size.yaxis)
        budget_lines(size, side="right")
        size.set_title(f"absolute error, at most {number(float(np.abs(found['error']).max()))}")
        for axes in (lobe, size):
            axes.set_xlim(0.0, float(angle[-1]))
            axes.set_xlabel("angle between R and V (degrees)")
        footnote(figure, f"α\u00a0=\u00a0{alpha:g}; in float64 at {len(angle)} angles; unit vectors, coplanar")
        return svg_pair(figure, "lobe")[0]
