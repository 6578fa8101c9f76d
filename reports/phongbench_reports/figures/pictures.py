"""Pictures of scenes in the report: what an error of a lobe means in them, and what they did not need.

The rows are the run's; the pictures themselves are drawn anew, small, from the shipped scenes.
"""

from typing import Any

import pandas as pd
from matplotlib.axes import Axes

from phongbench.analysis.rows import Rows, ordered
from phongbench.errors import PhongbenchError
from phongbench.formulas.formula import Formula
from phongbench_reports.plots import INK, MUTED, STYLES, Plate, end_labels, footnote, sheet
from phongbench_reports.table import Absent, Part, Table
from phongbench_reports.text import INTERVAL, label, listed, number, ratio, records, share
from phongbench_reports.ticks import log_axis

MISSING = Absent("No scene was drawn.", "Run with --scenes, or with --preset full.")
#: pixels of a picture in the report: six of them and their page stay below 300 kB
SIZE = (320, 180)
COMMAND = "phongbench run --scenes"


def errors_of(study: Rows) -> pd.DataFrame:
    """Rows of formulas that fit their scene, with their names and times over exact Phong's; empty without scenes."""
    rows = study.scenes
    rows = rows[rows["left_out"].isna()] if len(rows) else rows
    if rows.empty:
        return rows
    named = rows.assign(formula=[label(row) for row in records(rows)])
    times = study.scene_times
    times = times[times["kind"] == "formula"][["scene", "name", "seconds", "ratio", "ratio_low", "ratio_high"]]
    times = times.assign(formula=times.pop("name").map(_spelled))
    both = named.merge(times, on=["scene", "formula"], how="left")
    return ordered(both, ["scene", "max_abs", "formula"])


def differences(study: Rows) -> Plate | Absent:
    """The test card by three formulas, and the difference of each to exact Phong, on one scale."""
    if errors_of(study).empty:
        return MISSING
    from phongbench_reports.figures import scene_images  # late: it renders

    shown = scene_images.formulas(size=SIZE)
    data = pd.DataFrame(list(shown.facts))
    errors = [f"{row['formula']} is off by {row['max_codes']} codes at most" for row in records(data)]
    sentence = f"On a card of spheres from α\u00a0=\u00a02 to 4096, {listed(errors)}."
    alt = (
        "Pictures of twelve spheres of growing shininess, drawn by three formulas, each beside its difference to "
        f"exact Phong, all on one scale. {sentence}"
    )
    return Plate(scene_images.figure_of(shown, native=True), data, sentence, alt, shown.note, COMMAND)


def reflections(study: Rows) -> Plate | Absent:
    """The chequerboard with 0 to 3 reflections in a row."""
    rows = study.skips
    cut = rows[rows["name"] == "cutoff"] if len(rows) else rows
    if cut.empty:
        return MISSING
    from phongbench_reports.figures import scene_images  # late: it renders

    shown = scene_images.depths(size=SIZE)
    data = pd.DataFrame(list(shown.facts))
    parts = [f"{row['pixels_changed']:.1%} by reflection {row['reflections']}" for row in records(data.iloc[1:])]
    sentence = f"Pixels that a further reflection changes by a code or more: {listed(parts)}."
    alt = f"Four pictures of reflecting spheres on a chequerboard, with no reflection and with one to three. {sentence}"
    return Plate(scene_images.figure_of(shown, native=True), data, sentence, alt, shown.note, COMMAND)


def interpolation(study: Rows) -> Plate | Absent:
    """One sphere in triangles, flat, Gouraud and Phong shaded."""
    if errors_of(study).empty:
        return MISSING
    from phongbench_reports.figures import scene_images  # late: it renders

    shown = scene_images.interpolation()
    titles = [title.rpartition(", ") for title in shown.titles]
    data = pd.DataFrame({"shading": [t[0] for t in titles], "edges": [t[2] for t in titles]})
    sentence = "One highlight on triangles from coarse to fine, by what is interpolated: nothing, colours, or normals."
    alt = f"Nine pictures of a sphere: triangles from coarse to fine, flat, Gouraud and Phong shaded. {sentence}"
    return Plate(scene_images.figure_of(shown, native=True), data, sentence, alt, shown.note, COMMAND)


def lobe_law(study: Rows) -> Plate | Absent:
    """The largest error of each picture against the lobe's: what the scalar table promises, and what comes of it."""
    data = errors_of(study)
    data = data[(data["max_abs"] > 0) & (data["lobe_max"] > 0)] if len(data) else data
    if data.empty:
        return MISSING
    half = _of_half_space(study)
    data = data.assign(share=data["max_abs"] / data["lobe_max"], lawful=~data["approximation"].isin(half)).reset_index(
        drop=True
    )
    figure, (axes,) = sheet(4.2, left=0.085, right=0.8, top=0.95, bottom=0.19)
    names = sorted(data["scene"].unique())
    ends = []
    for scene, (colour, marker, _) in zip(names, STYLES, strict=False):
        mine = data[data["scene"] == scene].sort_values("lobe_max", kind="stable")
        kept = mine["lawful"]
        axes.plot(mine["lobe_max"], mine["max_abs"], marker, color=colour, fillstyle="none", zorder=2)
        axes.plot(mine.loc[kept, "lobe_max"], mine.loc[kept, "max_abs"], marker, color=colour, zorder=3)
        last = mine.iloc[-1]
        ends.append((float(last["lobe_max"]), float(last["max_abs"]), scene, colour))
    _diagonal(axes, data)
    end_labels(axes, ends, gap=0.07)
    axes.set_xlabel("lobe's largest error × highlight's brightness")
    axes.set_ylabel("picture's largest error, linear light")
    outside = sorted(set(data.loc[~data["lawful"], "approximation"]))
    hollow = f"; hollow: {listed(outside)}, of (N, H), for which it is no law" if outside else ""
    footnote(figure, f"line: the law{hollow}")
    return Plate(figure, data, _law_sentence(data), _law_alt(data), _basis(data), COMMAND)


def errors(study: Rows) -> Table | Absent:
    """The error of the picture and its time, for each formula and scene."""
    data = errors_of(study)
    if data.empty:
        return MISSING
    timed = data["ratio"].notna().any()
    headings = ["scene", "formula", "largest error, codes", "pixels off by a code", "PSNR, dB", "FLIP", "energy"]
    headings += ["highlight's area", *(["time / exact"] if timed else [])]
    body = []
    for row in records(data):
        line = [str(row["scene"]), row["formula"], number(row["max_codes"]), share(row["visible"])]
        line += [number(row[name]) for name in ("psnr", "flip", "energy", "highlight_area")]
        body.append((*line, *([ratio(row)] if timed else [])))
    unseen = data[data["max_codes"] == 0]
    slight = data[data["max_codes"] <= 1]
    sentence = (
        f"Of {len(data)} pictures {len(slight)} are off by one 8-bit code at most, {len(unseen)} by none; the most is "
        f"{int(data['max_codes'].max())} codes."
    )
    basis = f"{_basis(data)}; against exact Phong; times are those of whole pictures, rays included, {INTERVAL}s"
    return Table(tuple(headings), tuple(body), data, sentence, basis, frozenset(range(2, len(headings))))


def saved(study: Rows) -> Table | Absent:
    """The ledger of every scene: what was left out, what that changes, and the time without each skip."""
    rows = study.skips
    if rows.empty:
        return MISSING
    times = study.scene_times
    times = times[times["kind"].isin(["skip", "cutoff"])]
    key = ["scene", "name", "setting", "depth"]
    data = rows.merge(
        times[[*key, "against", "rounds", "seconds", "ratio", "ratio_low", "ratio_high"]], on=key, how="left"
    )
    shown = data[(data["skipped"] > 0) | data["name"].str.startswith("all")]
    body = tuple(_saved_row(row) for row in records(shown))
    headings = ("scene", "left out", "of", "share", "bound", "largest change", "time with / without")
    exact = data[data["kind"] == "exact"]
    sentence = (
        f"{int(exact['same_bits'].sum())} of {len(exact)} exact skips leave every bit of the picture as it is; "
        f"bounded ones change a colour by {number(data['largest_change'].max())} at most."
    )
    deep = number(data["depth"].max())
    basis = f"{_basis(data)}; reflections are stopped at depth {deep}; lines that left something out, all in the CSV"
    return Table(headings, body, data, sentence, basis, frozenset({3, 4, 5, 6}))


#: the sections, in page order
SECTIONS = (
    Part("differences", "Pictures: what an error looks like", differences),
    Part("lobe_law", "A picture's error against the lobe's", lobe_law),
    Part("reflections", "Reflections", reflections),
    Part("interpolation", "Flat, Gouraud and Phong shading", interpolation),
    Part("saved", "What pictures did not need", saved, True),
    Part("pictured", "Error and time of pictures", errors, True),
)


def _spelled(name: str) -> str:
    """A formula's name in the times as it is spelled now: runs made before wrote "lyon:dot:8 minimax"."""
    try:
        return str(Formula.parse(name.replace(" ", ":")))
    except PhongbenchError:  # a user's own, which this process does not know
        return name


def _saved_row(row: dict[str, Any]) -> tuple[str, ...]:
    cutoff = row["name"] == "cutoff"
    name = f"reflections below {number(row['setting'])}" if cutoff else str(row["name"]).replace("_", " ")
    of, skipped = (int(row[name]) for name in ("of", "skipped"))
    if not cutoff:  # skips are timed by leaving them out, cut-offs by putting them in
        row = row | {"ratio": 1 / row["ratio"], "ratio_low": 1 / row["ratio_high"], "ratio_high": 1 / row["ratio_low"]}
    bound = "exact" if row["kind"] == "exact" else number(row["bound"])
    part, unit = (share(skipped / of), f"{number(of)} {row['unit']}") if of else ("–", "–")
    return (str(row["scene"]), name, unit, part, bound, number(row["largest_change"]), ratio(row))


def _diagonal(axes: Axes, data: pd.DataFrame) -> None:
    log_axis(axes.xaxis)
    log_axis(axes.yaxis)
    low, high = float(data["lobe_max"].min()) / 1.5, float(data["lobe_max"].max()) * 1.5
    axes.set_xlim(low, high)
    bottom, top = float(data["max_abs"].min()) / 2, float(data["max_abs"].max()) * 2
    axes.set_ylim(bottom, top)
    axes.plot([low, high], [low, high], color=INK, linewidth=0.9, linestyle=(0, (4, 3)), zorder=1.5)
    axes.axhline(1 / 255, color=MUTED, linewidth=0.9, linestyle=(0, (1, 2)), zorder=1.5)
    axes.text(0.004, 1 / 255, "1/255", color=MUTED, fontsize=7.5, va="bottom", transform=axes.get_yaxis_transform())


def _of_half_space(study: Rows) -> set[str]:
    """Formulas that exist for (N, H) only, by the run's own rows: a user's own is in no registry of ours."""
    spaces = study.accuracy[["approximation", "space"]].drop_duplicates()
    reflect = set(spaces.loc[spaces["space"] == "reflect", "approximation"])
    return set(spaces["approximation"]) - reflect if reflect else {"blinn"}


def _law_sentence(data: pd.DataFrame) -> str:
    kept = data[data["lawful"]]
    met = kept[kept["share"] > 0.95]
    broken = kept[kept["max_abs"] > 1.001 * kept["lobe_max"] + 1e-6]
    outside = sorted(set(data.loc[~data["lawful"], "approximation"]))
    others = f" but those by {listed(outside)}" if outside else ""
    start = f"No picture{others} errs" if broken.empty else f"{len(broken)} of {len(kept)} pictures err"
    scenes_met = listed(sorted(met["scene"].unique()))
    return (
        f"{start} by more than the lobe's largest error times the highlight's brightness; in {len(met)} of {len(kept)} "
        f"pictures ({scenes_met}) it errs by just that, to 5 %."
    )


def _law_alt(data: pd.DataFrame) -> str:
    shares = data.groupby("scene", sort=True)["share"].max()
    parts = ", ".join(f"{scene} {number(share)}" for scene, share in shares.items())
    return (
        "Log-log chart of the picture's largest error against the lobe's law, a point for each formula and scene. "
        f"Largest share of the law that is reached: {parts}."
    )


def _basis(data: pd.DataFrame) -> str:
    sizes = sorted({f"{row['width']} × {row['height']}" for row in records(data)})
    return f"pictures of {listed(sizes)} pixels; largest errors are of all their pixels"
