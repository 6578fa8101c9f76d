"""Signed and absolute error against the angle between the two directions, one line per formula."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from phongbench.analysis.rows import Rows, at, near
from phongbench.results.schema import CELL
from phongbench_reports.figures.measured import values
from phongbench_reports.names import title
from phongbench_reports.plots import INK, MUTED, STYLES, Plate, budget_lines, footnote, sheet
from phongbench_reports.reproduce import reproduce
from phongbench_reports.table import Absent
from phongbench_reports.text import BUDGETS, alpha_is, label, listed, number, records
from phongbench_reports.ticks import log_axis

POINTS = 361
#: Shown where the run has them; γ is the one nearest to 8. Then user-brought formulas, as far as styles last.
WANTED = (
    ("lyon", "dot", "taylor"),
    ("lyon", "cross", "taylor"),
    ("lyon", "dot", "minimax"),
    ("lyon-quadratic", "dot", ""),
    ("gaussian", "dot", "none"),
    ("gaussian", "dot", "taylor"),
    ("schlick", "none", ""),
    ("blinn", "none", ""),
)
#: An error below this is rounding of the curve's own float64 evaluation.
FLOOR = 1e-7


def chosen(study: Rows) -> pd.DataFrame:
    """The cells to draw at the headline exponent, at most one per style."""
    rows = at(study.highlight, alpha=study.alpha, precision=study.precision)
    rows = near(rows[rows["approximation"] != "phong"], "gamma", 8)
    picked = []
    for name, form, policy in WANTED:
        hit = rows[(rows["approximation"] == name) & (rows["lambda_form"] == form) & (rows["space"] == "reflect")]
        hit = hit[hit["beta_policy"] == policy] if policy else hit
        picked.append((hit if len(hit) else rows[(rows["approximation"] == name) & (name == "blinn")]).head(1))
    known = {name for name, _, _ in WANTED} | {"integer-power"}
    others = rows[~rows["approximation"].isin(known)].drop_duplicates("approximation")
    frame = pd.concat([*picked, others]).drop_duplicates(CELL)
    return frame.head(len(STYLES))


def curves(study: Rows, cells: pd.DataFrame) -> pd.DataFrame:
    """Angle, value, exact value and error of every chosen cell: one row per point, up to where the lobe has ended."""
    widest = float(np.arccos(np.exp(-9.0 / study.alpha)))
    angle = np.linspace(0.0, widest, POINTS)
    cosine = np.cos(angle)
    exact = np.exp(study.alpha * np.log(cosine))
    frames = []
    for _, cell in cells.iterrows():
        value = values(cell, cosine)
        if value is None:
            continue
        frame = pd.DataFrame(
            {"angle_degrees": np.degrees(angle), "value": value, "exact": exact, "error": value - exact}
        )
        frames.append(frame.assign(**{key: cell[key] for key in [*CELL, "alpha"]}, label=label(cell)))
    return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame()


def _paint(signed: Axes, absolute: Axes, data: pd.DataFrame) -> None:
    lines: dict[str, tuple[Any, float]] = {}
    for (name, line), (colour, marker, dash) in zip(data.groupby("label", sort=False), STYLES, strict=False):
        x, error = line["angle_degrees"].to_numpy(), line["error"].to_numpy()
        look: dict[str, Any] = {"color": colour, "linestyle": dash, "marker": marker, "markersize": 4}
        every = (10 + 8 * len(lines), 60)
        signed.plot(x, error, markevery=every, **look)
        drawn = absolute.plot(x, np.maximum(np.abs(error), FLOOR), markevery=every, **look)
        lines[f"{name}\n{number(float(np.abs(error).max()))}"] = (drawn[0], float(np.abs(error).max()))
    # All errors end at 0, where names beside the lines would lie on one another: a key instead, worst on top.
    order = sorted(lines, key=lambda name: (-lines[name][1], name))
    key: dict[str, Any] = {"fontsize": 8, "handlelength": 3.2, "labelspacing": 0.75, "borderaxespad": 0.0}
    key |= {"title": "largest error", "title_fontsize": 8, "alignment": "left"}
    absolute.legend([lines[name][0] for name in order], order, loc="upper left", bbox_to_anchor=(1.03, 1.03), **key)


def _range(data: pd.DataFrame) -> tuple[float, float]:
    """Limits of the signed axis: alternatives, which are another shape by design, do not squeeze the approximations."""
    kinds = {name: title(str(name))[1] for name in data["approximation"].unique()}
    near = data[data["approximation"].map(kinds) != "alternative"]
    shown = near if len(near) else data
    low, high = float(shown["error"].min()), float(shown["error"].max())
    room = 0.12 * max(high - low, 1e-3)
    return min(low, -BUDGETS[0][0]) - room, max(high, BUDGETS[0][0]) + room


def draw(study: Rows) -> Plate | Absent:
    """Two panels over the angle at the headline exponent: approximation - exact, and its size on a log axis."""
    cells = chosen(study)
    data = curves(study, cells)
    if data.empty:
        return Absent("The run holds no formula that this program can draw.", "Run with --only lyon,gaussian or more.")
    figure, (signed, absolute) = sheet(4.3, 1, 2, left=0.07, right=0.785, wspace=0.2, bottom=0.16)
    signed.axhline(0.0, color=INK, linewidth=0.8)
    absolute.set_ylim(1e-6, 1.0)
    log_axis(absolute.yaxis)
    budget_lines(absolute, side="right")
    for value, _ in BUDGETS[:1]:
        signed.axhspan(-value, value, color=MUTED, alpha=0.18, linewidth=0)
    for axes in (signed, absolute):
        axes.set_xlim(0.0, float(data["angle_degrees"].max()))
        axes.set_xlabel("angle between R and V (degrees)")
    signed.set_ylim(*_range(data))
    signed.set_title("approximation − exact; band: ±1/255")
    absolute.set_title("absolute error")
    _paint(signed, absolute, data)
    footnote(figure, f"{alpha_is(study.alpha)}; formulas in float64 at {POINTS} angles; unit vectors, coplanar pairs")
    return _described(study, figure, data, cells)


def _described(study: Rows, figure: Any, data: pd.DataFrame, cells: pd.DataFrame) -> Plate:
    size = data["error"].abs()
    worst = data.loc[size.groupby(data["label"], sort=True).idxmax()]
    worst = worst.assign(size=worst["error"].abs()).sort_values(["size", "label"], ascending=[False, True])
    top, least = worst.iloc[0], worst.iloc[-1]
    fine = worst[worst["size"] <= BUDGETS[0][0]]["label"].tolist()
    side = "too dark" if top["error"] < 0 else "too bright"
    verdict = (
        f"{listed(fine)} stay{'s' if len(fine) == 1 else ''} below 1/255 at these angles"
        if fine
        else "none stays below 1/255"
    )
    takeaway = (
        f"At {alpha_is(study.alpha)}, {top['label']} errs most, "
        f"{number(top['size'])} {side} at {number(top['angle_degrees'])}°; "
        f"{least['label']} errs least, {number(least['size'])}; of the {len(worst)} drawn, {verdict}."
    )
    lines = "; ".join(
        f"{row['label']} at most {number(row['size'])} at {number(row['angle_degrees'])}°" for row in records(worst)
    )
    charts = f"Two line charts of error against angle at {alpha_is(study.alpha)}"
    alt = f"{charts}, signed and absolute on a log axis: {lines}."
    basis = f"{POINTS} angles, formulas evaluated in float64, no sampling"
    return Plate(figure, data, takeaway, alt, basis, reproduce(study, cells))
