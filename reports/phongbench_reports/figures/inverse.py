"""What a formula does to normals: errors of pictures that were inverted with it, over the exponent."""

import pandas as pd

from phongbench.analysis.rows import Rows, at, near, near_gamma, ordered
from phongbench_reports.plots import INK, STYLES, Plate, end_labels, footnote, sheet
from phongbench_reports.table import Absent
from phongbench_reports.text import alpha_is, label, listed, number, records, span
from phongbench_reports.ticks import log_axis

#: formula, slope, and gamma or the nearest measured, of the models that are shown; `matt` has no highlight
SHOWN = (
    ("matt", "none", None), ("schlick", "none", None), ("gaussian", "taylor", None), ("lyon", "taylor", 8),
    ("lyon", "minimax", 8), ("lyon", "minimax", 32),
)  # fmt: skip
#: errors below are drawn at the lower edge
FLOOR = 1e-4
COMMAND = "phongbench run --probe inverse --no-timing"


def rows_of(study: Rows) -> pd.DataFrame:
    """Rows of the sphere without noise under four lights, of the models shown in their first lambda form."""
    rows = at(study.inverse, surface="sphere", lights=4, noise="none", lambda_form=("dot", "none"), space="reflect")
    picked = []
    for name, slope, gamma in SHOWN:
        mine = at(rows, approximation=name, beta_policy=slope)
        picked.append(mine if gamma is None else near_gamma(mine, gamma))
    data = pd.concat(picked, ignore_index=True).drop_duplicates(ignore_index=True)
    return data.assign(name=["no highlight" if row["approximation"] == "matt" else label(row) for row in records(data)])


def draw(study: Rows) -> Plate | Absent:
    """Mean and largest angle between normals and the true ones, over the exponent."""
    if study.inverse.empty:
        return Absent("No pictures were inverted.", "Run with --probe inverse.")
    data = rows_of(study)
    if data.empty:
        return Absent("The run holds none of the formulas that are shown.", "Run with --only lyon,gaussian,schlick.")
    figure, panels = sheet(3.7, 1, 2, right=0.83, wspace=0.16, bottom=0.185)
    data = ordered(data, ["name", "alpha"])
    for axes, column, title in zip(
        panels, ("mean_degrees", "max_degrees"), ("mean error of normals (degrees)", "largest"), strict=True
    ):
        ends = []
        for name, (colour, marker, dash) in zip(data["name"].unique(), STYLES, strict=False):
            mine = at(data, name=name)
            values = mine[column].clip(lower=FLOOR)
            axes.plot(mine["alpha"], values, color=colour, marker=marker, linestyle=dash, markersize=3.5)
            ends.append((float(mine["alpha"].iloc[-1]), float(values.iloc[-1]), str(name), str(colour)))
        axes.set(xscale="log", yscale="log", xlabel="α", title=title)
        log_axis(axes.xaxis)
        log_axis(axes.yaxis)
        axes.axhline(1.0, color=INK, linewidth=0.8)
    end_labels(panels[1], ends, gap=0.075)
    basis = f"sphere, {span(data['samples'])} pixels within 0.9 of its radius, exact pictures, kd 0.7, ks 0.5, no noise"
    footnote(figure, f"{basis}; 4 lights 30° from the viewer; started at the true normals")
    shown = near(data, "alpha", study.alpha)
    parts = [f"{row['name']} {number(row['mean_degrees'])}° ({number(row['max_degrees'])}°)" for row in records(shown)]
    mean = f"at {alpha_is(shown['alpha'].iloc[0])}, mean and largest: {listed(parts)}"
    alt = f"Line charts over the exponent of the mean and the largest error of normals in degrees; {mean}."
    return Plate(figure, data.drop(columns="name"), f"Normals from pictures are off {mean}.", alt, basis, COMMAND)
