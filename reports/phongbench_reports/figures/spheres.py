"""Spheres seen and lit from the front, with any highlight: what a formula does over all angles in one picture."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes

from phongbench_reports.plots import Vector

#: pixels across a picture, the sphere's diffuse colour at full light, and what is behind it: dark, to show a rim
ACROSS, DIFFUSE, BACKDROP = 320, (0.16, 0.30, 0.48), (0.05, 0.06, 0.08)
#: the sphere's radius, where the picture reaches from -1 to 1
RADIUS = 0.94

#: (N.V)^2, which is 1 in the middle and 0 along the silhouette, to the highlight; R.V = 2 (N.V)^2 - 1, N.H = N.V
Highlight = Callable[[Vector], Vector]


def sphere(highlight: Highlight) -> Vector:
    """An RGB picture of a sphere with Lambert's diffuse term and this highlight."""
    x, y = np.meshgrid(*2 * [((np.arange(ACROSS) + 0.5) / ACROSS * 2.0 - 1.0) / RADIUS])
    facing_squared = 1.0 - x * x - y * y
    inside = facing_squared > 0.0
    facing = np.sqrt(facing_squared[inside])[:, None]
    light = highlight(facing_squared[inside])[:, None]
    picture = np.tile(np.array(BACKDROP), (ACROSS, ACROSS, 1))
    picture[inside] = np.minimum(np.array(DIFFUSE) * (0.08 + 0.92 * facing) + 0.85 * light, 1.0)
    return picture


def show(axes: Axes, picture: Vector, title: str) -> None:
    """Draw a picture without axes, its title above."""
    axes.imshow(np.round(255.0 * picture).astype(np.uint8), interpolation="nearest", aspect="equal")
    axes.set_axis_off()
    axes.set_title(title, loc="center")
