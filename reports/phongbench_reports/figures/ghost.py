"""The second highlight of the cross form: what a missing test of a.b > 0 does to a sphere lit from the camera."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from phongbench.analysis.rows import Rows
from phongbench_reports.figures import spheres
from phongbench_reports.figures.measured import lyon, values
from phongbench_reports.plots import BLUE, INK, MUTED, VERMILION, Plate, Vector, footnote, sheet
from phongbench_reports.reproduce import reproduce
from phongbench_reports.table import Absent
from phongbench_reports.text import alpha_is, basis, label, number, share

#: a wide lobe, or the measured one nearest to it: a narrow one's ghost is a thin line along the silhouette
ALPHA, GAMMA = 10.0, 8
POINTS = 361


def cell_of(study: Rows) -> pd.DataFrame:
    """The run's row of Lyon's ungated cross form beyond 90 degrees, at a wide lobe; empty if there is none."""
    rows = lyon(
        study.cut(precision=study.precision, stratum="grazing", gated=False),
        alpha=ALPHA,
        gamma=GAMMA,
        lambda_form="cross",
        beta_policy=("taylor", "minimax", "energy"),
    )
    return rows.sort_values(["beta_policy", "max_abs"], ascending=[False, True], kind="stable").head(1)


def gated_values(row: pd.Series, cosine: Vector, *, gated: bool) -> Vector:
    """The cell's formula over cosines from -1 to 1, with or without the test of a.b > 0."""
    each, places = np.unique(cosine, return_inverse=True)  # a sphere has every angle several times
    highlight = values(row, each)
    assert highlight is not None  # it is ours
    return np.where(cosine > 0.0, highlight[places], 0.0) if gated else highlight[places]


def sphere(row: pd.Series, *, gated: bool) -> Vector:
    """A picture of a sphere with the cell's highlight, with or without the test of a.b > 0."""
    return spheres.sphere(lambda facing_squared: gated_values(row, 2.0 * facing_squared - 1.0, gated=gated))


def draw(study: Rows) -> Plate | Absent:
    """The lobe over all angles with and without the test, and the two spheres."""
    cell = cell_of(study)
    if cell.empty:
        return Absent(
            "The run holds no rows of lyon's cross form without its test of a.b.",
            "Run with --only lyon --lambda cross.",
        )
    row = cell.iloc[0]
    angle = np.linspace(0.0, 180.0, POINTS)
    cosine = np.cos(np.radians(angle))
    data = pd.DataFrame(
        {
            "angle_degrees": angle,
            "exact": np.maximum(cosine, 0.0) ** float(row["alpha"]),
            "gated": gated_values(row, cosine, gated=True),
            "ungated": gated_values(row, cosine, gated=False),
        }
    )
    figure, (lobe, first, second) = sheet(
        3.5, 1, 3, left=0.06, right=0.99, bottom=0.2, top=0.88, wspace=0.1, width_ratios=(1.7, 1.0, 1.0)
    )
    _lobe(lobe, data)
    for axes, gated in ((first, True), (second, False)):
        spheres.show(axes, sphere(row, gated=gated), "lit only where a·b > 0" if gated else "a·b not tested")
    where = f"{label(row)}, {alpha_is(row['alpha'])}"
    footnote(figure, f"{where}; {POINTS} angles in float64; spheres: Lambert's diffuse term and this highlight")
    return Plate(figure, data, _sentence(row, data), _alt(row, data), basis(cell), reproduce(study, cell))


def _lobe(axes: Axes, data: pd.DataFrame) -> None:
    x = data["angle_degrees"]
    axes.plot(x, data["exact"], color=INK, linewidth=0.9)
    axes.plot(x, data["ungated"], color=VERMILION, linestyle=(0, (5, 2)), marker="s", markevery=(20, 60), linewidth=2.0)
    axes.plot(x, data["gated"], color=BLUE, marker="o", markevery=(10, 60))
    look: dict[str, Any] = {"fontsize": 8, "textcoords": "offset points", "va": "center"}
    half = int(np.argmin(np.abs(data["gated"] - 0.5)))
    axes.annotate("with the test,\nand exact Phong", (float(x[half]), 0.5), (8, 0), color=BLUE, **look)
    far = POINTS - 1 - half
    axes.annotate("without it", (float(x[far]), 0.5), (-8, 0), color=VERMILION, ha="right", **look)
    axes.axvline(90.0, color=MUTED, linewidth=0.9, linestyle=(0, (4, 3)))
    axes.text(91.5, 1.0, "a·b = 0", color=MUTED, fontsize=7.5, va="center")
    axes.set_xticks(range(0, 181, 30))
    axes.set_xlim(0.0, 180.0)
    axes.set_ylim(0.0, 1.06)
    axes.set_xlabel("angle between a and b (degrees)")
    axes.set_ylabel("highlight")
    axes.set_title("cross form over all angles")


def _sentence(row: pd.Series, data: pd.DataFrame) -> str:
    last = data.iloc[-1]
    back = data.loc[data["angle_degrees"] > 90.0, "ungated"]
    return (
        f"|a × b| cannot tell a from −a: without a test of a·b the cross form shines again, as bright as "
        f"{number(last['ungated'])} at 180° where Phong is {number(last['exact'])}, and a sphere lit from the camera "
        f"gets a bright rim; the run measured an error of {number(row['max_abs'])} there. The test takes away all "
        f"light beyond 90°, where {share(float((back > 1 / 255).mean()))} of the angles exceed one 8-bit "
        "code without it."
    )


def _alt(row: pd.Series, data: pd.DataFrame) -> str:
    half = float(data["angle_degrees"].iloc[int(np.argmin(np.abs(data["ungated"] - 0.5)))])
    return (
        f"Line chart of the cross form's highlight from 0 to 180 degrees at {alpha_is(row['alpha'])}, and two spheres "
        f"lit from the camera. With a test of a·b the lobe is one half at {number(min(half, 180.0 - half))} degrees "
        "and is 0 beyond 90, and the sphere has one highlight in its middle. Without it the lobe is symmetric about 90 "
        "degrees, and the sphere also has a bright rim."
    )
