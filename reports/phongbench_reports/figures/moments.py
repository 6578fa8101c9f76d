"""What lobes send where: their light and width over the exponent, and what the horizon leaves of them."""

import pandas as pd
from matplotlib.axes import Axes

from phongbench.analysis.rows import Rows, at, near, near_gamma, ordered
from phongbench_reports.plots import INK, MUTED, STYLES, Plate, end_labels, footnote, sheet
from phongbench_reports.table import Absent
from phongbench_reports.text import alpha_is, label, listed, number, records, share
from phongbench_reports.ticks import log_axis

#: the squarings that Lyon's lobe is shown with, or the nearest measured
GAMMA = 8
#: formula, slope and pair of the lobes that are shown, Phong's apart
SHOWN = (
    ("lyon", "taylor", "reflect"),
    ("lyon", "minimax", "reflect"),
    ("gaussian", "taylor", "reflect"),
    ("blinn", "taylor", "half"),
    ("schlick", "none", "reflect"),
)
#: of ratios of half widths, which differ little, and of ratios of light
FINE_TICKS, TICKS = (0.9, 0.95, 1.0, 1.05, 1.1, 1.15, 1.2, 1.3, 1.4, 1.5), (0.7, 0.8, 0.9, 1.0, 1.2, 1.5, 2, 3, 5, 8)
COMMAND = "phongbench run --probe lobes --no-timing"
BASIS = "integrals by quadrature in float64, the closed forms where there are any agreeing; unit vectors"


def rows_of(study: Rows) -> pd.DataFrame:
    """Phong's rows, and those of SHOWN in their first lambda form, Lyon's at one gamma."""
    rows = at(study.moments, lambda_form=("dot", "none"))
    picked = [at(rows, approximation="phong")]
    for name, slope, space in SHOWN:
        mine = at(rows, approximation=name, beta_policy=slope, space=space)
        picked.append(near_gamma(mine, GAMMA) if name == "lyon" else mine)
    data = pd.concat(picked, ignore_index=True)
    return data.assign(name=[label(row) for row in records(data)])


def draw(study: Rows) -> Plate | Absent:
    """Light and half width over exact Phong's, along the normal; light above the horizon over the incidence."""
    data = rows_of(study)
    names = [name for name in dict.fromkeys(data["name"]) if name != "phong"]
    if not names or not (data["name"] == "phong").any():
        return Absent("The run holds no moments of lobes beside Phong's.", "Run with --probe lobes.")
    figure, (light, width, horizon) = sheet(3.7, 1, 3, right=0.855, wspace=0.24, bottom=0.185)
    styles = dict(zip(names, STYLES, strict=False))
    upright = ordered(at(data, incidence_degrees=0.0), ["name", "alpha"])
    for axes, column, title in (
        (light, "energy_ratio", "light over Phong's"),
        (width, "half_width_ratio", "half width over Phong's"),
    ):
        _over_alpha(axes, upright, column, styles)
        axes.set_title(title)
    shown = ordered(near(data, "alpha", study.alpha), ["name", "incidence_degrees"])
    ends = _over_incidence(horizon, shown, styles)
    end_labels(horizon, ends, gap=0.075)
    alpha = float(shown["alpha"].iloc[0])
    horizon.set_title(f"above the horizon, {alpha_is(alpha)}")
    footnote(figure, f"left and middle: light along the normal; {BASIS}")
    takeaway, alt = _sentence(shown, names), _alt(upright, shown, names)
    return Plate(figure, data.drop(columns="name"), takeaway, alt, BASIS, COMMAND)


def _over_alpha(axes: Axes, rows: pd.DataFrame, column: str, styles: dict[str, tuple[str, str, object]]) -> None:
    axes.axhline(1.0, color=MUTED, linewidth=0.9, linestyle=(0, (4, 3)))
    axes.set_xscale("log")
    for name, (colour, marker, dash) in styles.items():
        mine = at(rows, name=name)
        axes.plot(mine["alpha"], mine[column], color=colour, marker=marker, linestyle=dash, markersize=3.5)
    log_axis(axes.xaxis)
    # Schlick's tail holds several times Phong's light: on a straight axis the others would be one line
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    ticks = FINE_TICKS if high < 1.6 else TICKS
    axes.set_yticks([t for t in ticks if low <= t <= high], labels=[f"{t:g}" for t in ticks if low <= t <= high])
    axes.set_yticks([], minor=True)
    axes.set_xlabel("α")


def _over_incidence(
    axes: Axes, rows: pd.DataFrame, styles: dict[str, tuple[str, str, object]]
) -> list[tuple[float, float, str, str]]:
    """Lines of what is left of Phong's light along the normal; their ends, for the labels."""
    whole = float(at(rows, name="phong", incidence_degrees=0.0)["energy"].iloc[0])
    ends = []
    for name, (colour, marker, dash) in {"phong": (INK, "", "-"), **styles}.items():
        mine = at(rows, name=name)
        left = mine["energy"] / whole
        axes.plot(mine["incidence_degrees"], left, color=colour, marker=marker, linestyle=dash, markersize=3.5)
        ends.append((float(mine["incidence_degrees"].iloc[-1]), float(left.iloc[-1]), name, str(colour)))
    axes.set_ylim(bottom=0.0)
    axes.set_xlim(0.0, 90.0)
    axes.set_xticks(range(0, 91, 30))
    axes.set_xlabel("incidence (degrees)")
    return ends


def _sentence(shown: pd.DataFrame, names: list[str]) -> str:
    upright = at(shown, incidence_degrees=0.0)
    parts = [f"{name} {number(at(upright, name=name)['energy_ratio'].iloc[0])}" for name in names]
    far = float(shown["incidence_degrees"].max())
    mine = {name: at(shown, name=name) for name in ("phong", "blinn")}
    left = {name: _light(rows, far) / _light(rows, 0.0) for name, rows in mine.items() if len(rows)}
    kept = listed(f"{share(part)} of {name}'s" for name, part in left.items())
    return (
        f"At {alpha_is(shown['alpha'].iloc[0])} the lobes hold, over Phong's light: {listed(parts)}; at {number(far)}° "
        f"of incidence the horizon leaves {kept}."
    )


def _light(rows: pd.DataFrame, incidence: float) -> float:
    return float(at(rows, incidence_degrees=incidence)["energy"].iloc[0])


def _alt(upright: pd.DataFrame, shown: pd.DataFrame, names: list[str]) -> str:
    parts = []
    for name in names:
        mine = at(upright, name=name)
        light = (f"{number(row['energy_ratio'])} at {alpha_is(row['alpha'])}" for row in records(mine.iloc[[0, -1]]))
        parts.append(f"{name} {listed(light)}, half width {number(mine['half_width_ratio'].iloc[-1])}")
    return (
        f"Line charts over the exponent of the lobes' light and half width over those of Phong: {'; '.join(parts)}. A "
        f"third chart shows the light above the horizon at {alpha_is(shown['alpha'].iloc[0])}, which falls towards "
        "grazing incidence."
    )
