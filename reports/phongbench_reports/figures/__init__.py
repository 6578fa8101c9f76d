"""Every figure of the report, in page order: one file each, one line each here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from phongbench.analysis.rows import Rows
from phongbench_reports.figures import (
    causes,
    error_angle,
    error_gamma,
    front,
    ghost,
    heatmap,
    meshes,
    precision,
    speed,
    split,
    stability,
    widths,
)
from phongbench_reports.plots import Plate
from phongbench_reports.table import Absent


@dataclass(frozen=True)
class Drawing:
    """One figure of the report.

    name    str        file name of its SVG and CSV, its anchor on the page
    title   str        heading on the page
    draw    function   Rows -> Plate, or Absent where the run has no rows for it
    """

    name: str
    title: str
    draw: Callable[[Rows], Plate | Absent]


FIGURES = (
    Drawing("error_angle", "Error against angle", error_angle.draw),
    Drawing("error_gamma", "Largest error against γ, with the law", error_gamma.draw),
    Drawing("heatmap", "Largest error over α and γ", heatmap.draw),
    Drawing("front", "Error against time", front.draw),
    Drawing("stability", "Vectors that are not unit length", stability.draw),
    Drawing("causes", "Why lengths are wrong", causes.draw),
    Drawing("meshes", "Normals interpolated over a mesh", meshes.draw),
    Drawing("precision", "Error against precision", precision.draw),
    Drawing("widths", "The best γ of each precision", widths.draw),
    Drawing("ghost", "The second highlight of the cross form", ghost.draw),
    Drawing("split", "Where the error comes from", split.draw),
    Drawing("speed", "Time per element and working set", speed.draw),
)
