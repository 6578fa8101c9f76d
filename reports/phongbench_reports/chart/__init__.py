"""Charts as SVG, drawn here: matplotlib takes most of a second for a figure, and a report has twenty.

`Figure` and `Axes` know the part of matplotlib's vocabulary that the figures use, with its meaning, sizes and places:
one program draws for a page here and, within `plots.ink`, for pixels there. What they do not know is a TypeError.
Places are points of 1/72 inch from the upper left.
"""

from phongbench_reports.chart.axes import Axes
from phongbench_reports.chart.figure import Figure
from phongbench_reports.chart.scale import Scale

__all__ = ["Axes", "Figure", "Scale"]
