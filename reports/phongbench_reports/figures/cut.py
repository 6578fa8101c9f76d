"""The cut highlight: where R.V passes 90 degrees Phong's power ends, and at small exponents that shows as an edge."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from phongbench.analysis.rows import Rows, at, near_gamma, ordered
from phongbench_reports.figures import spheres
from phongbench_reports.figures.moments import COMMAND
from phongbench_reports.figures.spheres import Highlight
from phongbench_reports.plots import INK, STYLES, Plate, budget_lines, footnote, sheet
from phongbench_reports.table import Absent
from phongbench_reports.text import BUDGETS, alpha_is, label, number, records
from phongbench_reports.ticks import log_axis

#: the exponent of the spheres: small enough for an edge that no one overlooks
ALPHA, GAMMA = 0.5, 8
#: the formulas of (R, V) whose steps are drawn, Phong's first
SHOWN = ("phong", "lyon", "gaussian", "schlick")
#: the lowest step that is drawn: far below a code
FLOOR = 1e-4
BASIS = "by the formulas, in float64 at eighths of a degree; step: value one degree before R·V = 0"


def rows_of(study: Rows) -> pd.DataFrame:
    """Cuts of SHOWN, Lyon's at one gamma, and of Blinn's power."""
    rows = at(study.cuts, space="reflect")
    picked = [near_gamma(mine, GAMMA) for mine in (at(rows, approximation=name) for name in SHOWN)]
    data = pd.concat([*picked, at(study.cuts, approximation="blinn")], ignore_index=True)
    return ordered(data, ["approximation", "alpha"])


def draw(study: Rows) -> Plate | Absent:
    """The step at the cut against the exponent, and a sphere by Phong and by a power of N.H."""
    data = rows_of(study)
    if at(data, approximation="phong").empty:
        return Absent("The run did not look for cuts of lobes.", "Run with --probe lobes.")
    figure, (steps, first, second) = sheet(
        3.5, 1, 3, left=0.075, right=0.99, bottom=0.2, top=0.88, wspace=0.1, width_ratios=(1.7, 1.0, 1.0)
    )
    _steps(steps, data)
    spheres.show(first, spheres.sphere(phong(ALPHA)), "R·V to the power α")
    spheres.show(second, spheres.sphere(half_vector(ALPHA)), "N·H to the power 4α")
    footnote(
        figure, f"spheres: lit from the camera, {alpha_is(ALPHA)}, Lambert's diffuse term and this highlight; {BASIS}"
    )
    return Plate(figure, data, _sentence(data), _alt(data), BASIS, COMMAND)


def phong(alpha: float) -> Highlight:
    """The highlight of a sphere lit from the camera, where R.V = 2 (N.V)^2 - 1."""
    return lambda facing_squared: np.maximum(2.0 * facing_squared - 1.0, 0.0) ** alpha


def half_vector(alpha: float) -> Highlight:
    """The same by a power of N.H, which is N.V there."""
    return lambda facing_squared: facing_squared ** (2.0 * alpha)


def _steps(axes: Axes, data: pd.DataFrame) -> None:
    for name, (colour, marker, dash) in zip(SHOWN, ((INK, "o", "-"), *STYLES), strict=False):
        mine = at(data, approximation=name, cut_degrees=90.0)
        mine = mine[mine["alpha"] > 0]
        if len(mine):
            spelled = label(records(mine.iloc[:1])[0])
            look = {"color": colour, "marker": marker, "linestyle": dash, "markersize": 3.5, "label": spelled}
            axes.plot(mine["alpha"], mine["step"], **look)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(FLOOR, 1.3)
    axes.set_xlim(0.08, 50.0)
    log_axis(axes.xaxis)
    log_axis(axes.yaxis)
    budget_lines(axes, side="right")
    axes.legend(loc="lower left", fontsize=8)
    axes.set_xlabel("α")
    axes.set_ylabel("step at the cut")
    axes.set_title("what ends at R·V = 0, a degree before")


def _sentence(data: pd.DataFrame) -> str:
    exact = at(data, approximation="phong")
    seen = exact[(exact["step"] > BUDGETS[0][0]) & (exact["alpha"] > 0)]
    if seen.empty:
        return "Phong's highlight is cut nowhere visibly at the exponents that were looked at."
    first, last = (seen.iloc[n] for n in (0, -1))
    others = at(data, approximation=SHOWN[1:], cut_degrees=90.0)
    hard = others[others["step"] > BUDGETS[0][0]].sort_values(["alpha", "step"], kind="stable").tail(1)
    more = "".join(
        f"; {label(row)} is cut visibly up to {alpha_is(row['alpha'])}, by its test of a·b" for row in records(hard)
    )
    return (
        f"Phong's highlight ends at R·V = 0 with a step of {number(first['codes'])} codes at "
        f"{alpha_is(first['alpha'])} and {number(last['codes'])} at {alpha_is(last['alpha'])}, the largest exponent "
        f"looked at where it shows; "
        f"a power of N·H runs on{more}."
    )


def _alt(data: pd.DataFrame) -> str:
    exact = at(data, approximation="phong")
    steps = "; ".join(f"{number(row['step'])} at {alpha_is(row['alpha'])}" for row in records(exact.head(5)))
    return (
        f"Log-log chart of the highlight one degree before R.V = 0 over the exponent, for Phong ({steps}) and for "
        f"formulas whose test of a.b ends them there. Beside it two spheres lit from the camera at {alpha_is(ALPHA)}: "
        "by R.V the highlight is a disc with an edge, by N.H it fades towards the silhouette."
    )
