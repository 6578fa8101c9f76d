"""What normals interpolated over triangles and left raw change, against the angle of an edge."""

import shlex
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from phongbench.analysis.mesh_edges import CODE, PAIRS, in_words, raw_lyon, reaches
from phongbench.analysis.rows import STABILITY_ALPHA, Rows, nearest
from phongbench.formulas.lambda_forms import LAMBDA_FORMS
from phongbench.results.records import Records
from phongbench_reports.plots import BLUE, GREEN, MUTED, SURFACE, VERMILION, Plate, end_labels, footnote, sheet
from phongbench_reports.reproduce import reproduce
from phongbench_reports.table import Absent
from phongbench_reports.text import alpha_is, gamma_is, listed, number, records, span
from phongbench_reports.ticks import log_axis, named_ticks

#: exponents of the rows of panels, or the measured ones nearest to them
ALPHAS = (10.0, STABILITY_ALPHA, 1000.0)
#: name beside a line, colour, marker, dash
LOOKS: dict[str, tuple[str, str, str, Any]] = {
    "classic": ("R = 2(L·N)N−L", VERMILION, "s", "-"),
    "lengthwise": ("R = 2(N·L)N−(N·N)L", BLUE, "o", (0, (5, 2))),
    "half": ("(N,\u00a0H)", GREEN, "^", (0, (1.5, 1.5))),
}
OWN = ("icosphere", "torus", "uv-sphere")
LIMITS = (0.01, 300.0)
#: names of files of this length together do not fit below the figure
LONG = 24
COLUMNS = [
    "mesh", "edge_degrees", "triangles", "left_out", "pair", "lambda_form", "space", "alpha", "gamma", "samples",
    "codes_changed", "codes_raw", "codes_renormalised",
]  # fmt: skip


def rows_of(study: Rows) -> pd.DataFrame:
    """One row per mesh, edge, form and kind of pair, at three exponents: what raw normals change, and whole errors."""
    every = study.lyon_meshes
    known = Records.of(every)
    raw = raw_lyon(known).of_frame(every)
    if raw.empty:
        return raw
    wanted = {nearest(sorted(raw["alpha"].unique()), alpha) for alpha in ALPHAS}
    raw = raw[raw["alpha"].isin(wanted)]
    key = ["mesh", "edge_degrees", "pair", "lambda_form", "alpha"]
    unit = raw_lyon(known, "renormalised").of_frame(every)[[*key, "codes_8bit"]]
    both = raw.merge(unit, on=key, suffixes=("", "_renormalised"), how="left")
    both = both.assign(codes_changed=both["length_max"] / CODE, codes_raw=both["codes_8bit"])
    return both.rename(columns={"codes_8bit_renormalised": "codes_renormalised"})[COLUMNS].reset_index(drop=True)


def _envelope(part: pd.DataFrame) -> tuple[Any, Any]:
    """The worst of our own surfaces at each requested edge: their i-th finest belong together."""
    own = part[part["mesh"].isin(OWN)].sort_values(["mesh", "edge_degrees"], kind="stable")
    turn = own.groupby("mesh", sort=True).cumcount()
    each = own.groupby(turn)
    return each["edge_degrees"].mean().to_numpy(), each["codes_changed"].max().to_numpy()


def _panel(axes: Axes, rows: pd.DataFrame) -> list[tuple[float, float, str, str]]:
    own = float(rows["codes_renormalised"].max())
    axes.axhline(1.0, color=MUTED, linewidth=0.9, linestyle=(0, (4, 3)), zorder=1.5)
    axes.axhline(own, color=MUTED, linewidth=0.9, linestyle=(0, (1, 2)), zorder=1.5)
    ends = []
    for pair in PAIRS:
        part = rows[rows["pair"] == pair]
        if part.empty:
            continue
        name, colour, marker, dash = LOOKS[pair]
        x, y = _envelope(part)
        axes.plot(x, np.maximum(y, LIMITS[0]), color=colour, marker=marker, linestyle=dash, zorder=3)
        files = part[~part["mesh"].isin(OWN)]
        axes.plot(
            files["edge_degrees"],
            files["codes_changed"].clip(lower=LIMITS[0]),
            color=colour,
            marker=marker,
            linestyle="none",
            markerfacecolor=SURFACE,
            markersize=3.5,
            markeredgewidth=0.8,
            zorder=2.5,
        )
        if len(x):
            ends.append((float(x[-1]), float(max(y[-1], LIMITS[0])), name, colour))
    return ends


def draw(study: Rows) -> Plate | Absent:
    """A row of panels per exponent, a panel per lambda form; lines are the ways in which a renderer makes its pair."""
    data = rows_of(study)
    if data.empty:
        return Absent(
            "The run holds no lyon rows on interpolated normals.", "Run with --probe meshes and --only lyon or more."
        )
    alphas = sorted(data["alpha"].unique())
    forms = [form for form in LAMBDA_FORMS if (data["lambda_form"] == form).any()]
    height = 1.0 + 2.0 * len(alphas)
    margins = {"left": 0.092, "right": 0.835, "wspace": 0.06, "hspace": 0.1}
    margins |= {"top": 1 - 0.33 / height, "bottom": 0.68 / height}
    figure, panels = sheet(height, len(alphas), len(forms), sharex=True, sharey=True, **margins)
    for index, axes in enumerate(panels):
        alpha, form = alphas[index // len(forms)], forms[index % len(forms)]
        log_axis(axes.yaxis)
        axes.set_ylim(*LIMITS)
        low, high = float(data["edge_degrees"].min()), float(data["edge_degrees"].max())
        ticks = [tick for tick in (0.5, 1, 2, 5, 10, 20, 50, 90) if 0.95 * low <= tick <= 1.05 * high]
        named_ticks(axes.xaxis, ticks, minor=range(1, 10))
        rows = data[(data["alpha"] == alpha) & (data["lambda_form"] == form)]
        ends = _panel(axes, rows)
        _words(axes, rows, first=index < len(forms), left=index % len(forms) == 0, alpha=alpha, form=form)
        if index % len(forms) == len(forms) - 1:
            end_labels(axes, ends, gap=0.1)
    for axes in panels[-len(forms) :]:
        axes.set_xlabel("widest edge (degrees)")
    files = listed(sorted(set(data["mesh"]) - set(OWN)))
    hollow = {"none": ""}.get(files, f"; hollow: {files if len(files) < LONG else 'files'}")
    footnote(
        figure,
        f"lyon, {gamma_is(data['gamma'].iloc[0])}; filled: worst of {listed(OWN)}{hollow}; dotted: the "
        f"formula's own error; below {LIMITS[0]:g} at the edge; {span(data['samples'])} samples each",
    )
    return Plate(figure, data, _sentence(study, data), _alt(data), _basis(data), _command(study, data))


def _words(axes: Axes, rows: pd.DataFrame, *, first: bool, left: bool, alpha: float, form: str) -> None:
    if first:
        axes.set_title(form)
    if not left:
        return
    axes.set_ylabel(f"{alpha_is(alpha)}\n8-bit codes changed")
    look: dict[str, Any] = {"color": MUTED, "fontsize": 7.5, "transform": axes.get_yaxis_transform(), "va": "bottom"}
    axes.text(0.99, 1.0, "1 code", ha="right", **look)
    axes.text(0.99, float(rows["codes_renormalised"].max()), "own error", ha="right", **look)


def _command(study: Rows, data: pd.DataFrame) -> str:
    """The command that measures these rows again, with the run's own meshes."""
    meshes = [word for path in study.run.manifest.get("plan", {}).get("meshes", []) for word in ("--mesh", str(path))]
    plain = reproduce(study, data.assign(approximation="lyon", precision="float32"))
    return f"{plain} {shlex.join(['--probe', 'meshes', *meshes])}"


def _basis(data: pd.DataFrame) -> str:
    left_out = int(data.drop_duplicates("mesh")["left_out"].sum())
    degenerate = f"; degenerate triangles left out: {left_out}" if left_out else ""
    return f"{span(data['samples'])} samples a cell and edge, coverage: sampled{degenerate}"


def _sentence(study: Rows, data: pd.DataFrame) -> str:
    """How wide edges may be for one code at the middle exponent, for each form and pair."""
    widest = reaches(Records.of(study.lyon_meshes))
    alpha = nearest(sorted(data["alpha"].unique()), STABILITY_ALPHA)
    parts = []
    for pair in PAIRS:
        mine = [row for row in widest if (row["alpha"], row["pair"]) == (alpha, pair)]
        if not mine:
            continue
        wide = listed(f"{in_words(row['degrees'], row['relation'])} ({row['lambda_form']})" for row in mine)
        parts.append(f"{LOOKS[pair][0]}: {wide}")
    return (
        f"At {alpha_is(alpha)}, normals left raw change the highlight by at most one 8-bit code up to edges of "
        f"{'; '.join(parts)}."
    )


def _alt(data: pd.DataFrame) -> str:
    parts = []
    for alpha, rows in data.groupby("alpha", sort=True):
        coarse = rows[rows["edge_degrees"] <= 10.5]
        worst = coarse.groupby(["lambda_form", "pair"], sort=True)["codes_changed"].max().reset_index()
        lines = ", ".join(
            f"{row['lambda_form']} {row['pair']} {number(row['codes_changed'])}" for row in records(worst)
        )
        parts.append(f"{alpha_is(alpha)}: {lines}")
    return (
        "Log-log charts of the change by raw normals against the widest edge, one per exponent and lambda form. "
        f"Codes changed by edges up to 10 degrees: {'; '.join(parts)}."
    )
