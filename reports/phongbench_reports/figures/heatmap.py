"""Largest error of Lyon's formula over alpha and gamma, with the number in every cell; Taylor beside minimax slope."""

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.patches import Rectangle

from phongbench.analysis.rows import Rows, forms_of, ordered
from phongbench.results.schema import CELL
from phongbench_reports.figures.measured import finished, lyon
from phongbench_reports.plots import SURFACE, Plate, sheet
from phongbench_reports.table import Absent
from phongbench_reports.text import BUDGETS, number
from phongbench_reports.ticks import fixed_ticks

POLICIES = ("taylor", "minimax")
#: Errors beyond these ends share their colour: below a tenth of a 10-bit code nothing is worth telling apart.
LOW, HIGH = 1e-4, 0.2


def table(rows: pd.DataFrame) -> pd.DataFrame:
    """Errors as alpha (rows) x gamma (columns)."""
    return rows.pivot_table(index="alpha", columns="gamma", values="max_abs", aggfunc="max", observed=True).sort_index()


def _codes(value: float) -> str:
    codes = 255.0 * value
    return f"{codes:.0f}" if codes >= 9.95 else f"{codes:.1f}" if codes >= 0.095 else "<.1"


def _panel(axes: Axes, errors: pd.DataFrame) -> None:
    grid: npt.NDArray[np.float64] = errors.to_numpy(np.float64)
    norm = LogNorm(LOW, HIGH, clip=True)
    colours = mpl.colormaps["viridis_r"]
    axes.pcolormesh(np.ma.masked_invalid(grid), cmap=colours, norm=norm, edgecolors=SURFACE, linewidth=1.2)
    for row, column in np.argwhere(np.isfinite(grid)):
        red, green, blue, _ = colours(norm(grid[row, column]))
        dark = 0.2126 * red + 0.7152 * green + 0.0722 * blue < 0.45
        fits = grid[row, column] <= BUDGETS[0][0]
        axes.text(
            column + 0.5,
            row + 0.5,
            _codes(grid[row, column]),
            ha="center",
            va="center",
            fontsize=8,
            color="#ffffff" if dark else "#000000",
            fontweight="bold" if fits else "normal",
        )
        if fits:
            axes.add_patch(
                Rectangle((column + 0.05, row + 0.07), 0.9, 0.86, fill=False, edgecolor="#000000", linewidth=1.3)
            )
    fixed_ticks(axes.xaxis, np.arange(grid.shape[1]) + 0.5, [f"{int(gamma)}" for gamma in errors.columns])
    fixed_ticks(axes.yaxis, np.arange(grid.shape[0]) + 0.5, [f"{alpha:g}" for alpha in errors.index])
    axes.tick_params(length=0)
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set_xlabel("γ")


def draw(study: Rows) -> Plate | Absent:
    """One panel per slope; a frame and bold number mark cells sampled at most one 8-bit code."""
    rows = lyon(study.highlight, precision=study.precision, beta_policy=POLICIES)
    if rows.empty:
        return Absent("The run holds no lyon rows on unit vectors.", "Run with --only lyon.")
    rows = rows[rows["lambda_form"] == forms_of(rows)[0]]
    policies = [policy for policy in POLICIES if (rows["beta_policy"] == policy).any()]
    tables = {policy: table(rows[rows["beta_policy"] == policy]) for policy in policies}
    height = 1.35 + 0.25 * max(len(one) for one in tables.values())
    margins = {"bottom": 0.72 / height, "top": 1 - 0.34 / height}
    figure, panels = sheet(height, 1, len(policies), left=0.075, right=0.985, wspace=0.1, sharey=True, **margins)
    for axes, (policy, errors) in zip(panels, tables.items(), strict=True):
        _panel(axes, errors)
        axes.set_title(f"{policy} slope, {rows['lambda_form'].iloc[0]} form")
    panels[0].set_ylabel("α, exact exponent")
    note = f"largest error in 8-bit codes (255 × error), {study.precision}; framed: at most one code"
    columns = [*CELL, "alpha", "max_abs", "codes_8bit", "samples", "coverage"]
    data = ordered(rows[columns], ["beta_policy", "alpha", "gamma"])
    return finished(study, figure, data, note, _sentence(tables), _alt(tables))


def _sentence(tables: dict[str, pd.DataFrame]) -> str:
    """How many cells fit a code, per slope, and which exponents no gamma reaches."""
    parts = []
    for policy, errors in tables.items():
        fits = errors <= BUDGETS[0][0]
        hopeless = [f"{alpha:g}" for alpha in errors.index[~fits.any(axis=1)]]
        tail = f", no γ for α\u00a0=\u00a0{', '.join(hopeless)}" if hopeless else ", every α reached"
        parts.append(f"{policy}: {int(fits.to_numpy().sum())} of {int(errors.notna().to_numpy().sum())} cells{tail}")
    return f"Sampled at most one 8-bit code with {'; '.join(parts)}."


def _alt(tables: dict[str, pd.DataFrame]) -> str:
    parts = []
    for policy, errors in tables.items():
        low, high = float(np.nanmin(errors.to_numpy())), float(np.nanmax(errors.to_numpy()))
        parts.append(
            f"{policy} slope, {len(errors)} exponents by {errors.shape[1]} gammas, {number(low)} to {number(high)}"
        )
    return f"Heat map of the largest absolute error, number in every cell: {'; '.join(parts)}."
