"""One formula's lobe and its error against the angle: the picture that the service draws of a curve."""

import threading
from collections.abc import Mapping

import numpy as np

from phongbench_reports.plots import BLUE, INK, VERMILION, Vector, budget_lines, footnote, ink, sheet, svg_pair
from phongbench_reports.text import alpha_is, number
from phongbench_reports.ticks import log_axis

#: errors below this are rounding of the curve's own float64 evaluation
FLOOR = 1e-7
#: matplotlib's settings belong to the process
_ONE_AT_A_TIME = threading.Lock()


def svg(name: str, alpha: float, curve: Mapping[str, Vector]) -> bytes:
    """The lobe beside exact Phong's, and the size of their difference on a log axis, as SVG for a light page.

    name   str    the formula's spelling
    alpha  float  exponent of exact Phong
    curve  arrays angle_degrees, value, exact, error of equal length
    """
    angle, size = curve["angle_degrees"], np.abs(curve["error"])
    largest = float(size.max())
    with _ONE_AT_A_TIME, ink():
        figure, (lobe, error) = sheet(3.6, 1, 2, left=0.07, wspace=0.18, bottom=0.2, top=0.88)
        lobe.plot(angle, curve["exact"], color=INK, linestyle=(0, (5, 2)), label="exact Phong")
        lobe.plot(angle, curve["value"], color=BLUE, label=name)
        lobe.legend(loc="upper right", fontsize=8)
        lobe.set_title("highlight")
        error.plot(angle, np.maximum(size, FLOOR), color=VERMILION)
        error.set_ylim(FLOOR, max(1.0, 2.0 * largest))
        log_axis(error.yaxis)
        budget_lines(error, side="right")
        error.set_title(f"absolute error, at most {number(largest)}")
        for axes in (lobe, error):
            axes.set_xlim(0.0, float(angle[-1]))
            axes.set_xlabel("angle between R and V (degrees)")
        footnote(figure, f"{alpha_is(alpha)}; in float64 at {len(angle)} angles; unit vectors, coplanar")
        return svg_pair(figure, "lobe")[0]
