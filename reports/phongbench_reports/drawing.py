"""From a finished run to its report: a folder that opens by double click, or one self-contained file."""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

import numpy as np
import pandas as pd

from phongbench.analysis.rows import Rows
from phongbench.results.runs import require_rows
from phongbench.support.atomic_files import write_bytes
from phongbench.support.process import seldom_collected
from phongbench.support.user_paths import make_folder
from phongbench_reports.figures import FIGURES
from phongbench_reports.figures.pictures import SECTIONS
from phongbench_reports.kept import PAGE, is_current, origin, remember
from phongbench_reports.page import Links, Section, render, style_sheet
from phongbench_reports.plots import Plate, ink, svg_pair
from phongbench_reports.second_process import Drawn, Process, Shared, beside, drawn
from phongbench_reports.svg import of_both
from phongbench_reports.table import Absent, Part
from phongbench_reports.tables.adapter import adapter
from phongbench_reports.tables.behaviour import hostile, smoothness
from phongbench_reports.tables.by_target import by_target, turned
from phongbench_reports.tables.claims import claims
from phongbench_reports.tables.code import code
from phongbench_reports.tables.devices import devices
from phongbench_reports.tables.mesh_edges import mesh_edges
from phongbench_reports.tables.raw_verdict import raw_verdict
from phongbench_reports.tables.skipped import skipped
from phongbench_reports.tables.sureness import sureness
from phongbench_reports.tables.verdict import census, formulas, verdict, worst
from phongbench_reports.text import BUDGETS

if TYPE_CHECKING:
    from phongbench.results.runs import Run


#: is called with how many steps are done, and how many there are
Progressed = Callable[[int, int], None]
#: figures that take long, the longest last: a second process begins at the end of the list, and nobody waits for it
LONG = ("meshes", "raw_vectors", "targets")
#: figure -> the folded table that follows it
BESIDE = {"meshes": Part("mesh_edges", "How wide edges may be", mesh_edges, True)}
#: the tables after the figures, and those at the end of the page
BEHAVIOUR = (
    Part("census", "Values above 1, negative, not finite", census, True),
    Part("hostile", "Hostile inputs", hostile, True),
    Part("smoothness", "Smoothness of the lobes", smoothness, True),
)
CLAIMS = Part("claims", "The textbook claims", claims)
LAST = (
    Part("skipped", "Skipping what is dark", skipped),
    Part("sureness", "How sure the numbers are", sureness, True),
    Part("devices", "On every device", devices),
    Part("worst", "Worst inputs", worst, True),
    Part("formulas", "The formulas", formulas, True),
)


def sections_of(
    study: Rows, shared: Shared | None = None, progress: Progressed | None = None
) -> tuple[list[Section], dict[str, tuple[bytes, bytes]]]:
    """All sections in page order, and the SVGs (light, dark) of the figures among them.

    shared    the figures, where another process draws some of them
    progress  called with (done, total) before each figure that this process draws
    """
    # the tables first: meanwhile the other process draws
    answers, judged = _answers(study), section_of(CLAIMS, study)
    behaviour, last = ([section_of(part, study) for part in parts] for parts in (BEHAVIOUR, LAST))
    with ink():
        figures, pictures = _figures(study, shared, progress or (lambda done, total: None))
        scenes = [section_of(part, study) for part in SECTIONS]
        pictures |= {
            one.name: svg_pair(one.content.figure, one.name) for one in scenes if isinstance(one.content, Plate)
        }
    if all(isinstance(section.content, Absent) for section in scenes):
        scenes = [Section("pictures", "Pictures of scenes", scenes[0].content)]
    speed = figures.pop("speed")
    answers += [Section("adapter", "On this machine's adapter", adapter(study))] if "gpu" in study.run.manifest else []
    return [*answers, *figures.values(), *behaviour, *scenes, judged, speed, *last], pictures


def section_of(part: Part, study: Rows) -> Section:
    """The section that this part is for a run."""
    return Section(part.name, part.title, part.make(study), part.folded)


def _answers(study: Rows) -> list[Section]:
    """The verdicts: on every target with code, on this machine for both budgets, and for the other precisions."""
    (budget, within), (fine, fine_name) = BUDGETS
    first, *others = study.precisions
    targets, here = by_target(study, budget, within), verdict(study, first, budget, within)
    raw, finer = raw_verdict(study, first, budget, within), verdict(study, first, fine, fine_name)
    answers = [
        Section("by_target", f"The answer by target, within {within}", turned(targets), stacked=True),
        Section("code", "The code", code(targets)),
        Section("verdict", f"The answer on this machine, within {within}", here, stacked=True),
        Section("raw_verdict", f"From raw N, L and V, within {within}", raw, stacked=True),
        Section("verdict_fine", f"The answer on this machine, within {fine_name}", finer, folded=True, stacked=True),
    ]
    for p in others:
        content = verdict(study, p, budget, within)
        answers.append(Section(f"verdict_{p}", f"The answer in {p}, within {within}", content, True, True))
    return answers


def _figures(
    study: Rows, shared: Shared | None, progress: Progressed
) -> tuple[dict[str, Section], dict[str, tuple[bytes, bytes]]]:
    """The figures in page order, with the tables beside them, and their SVGs."""
    plates: dict[str, Drawn] = {}
    if shared is not None:
        entries = {part.name: part for part in FIGURES}
        for name in shared.mine():
            progress(len(FIGURES) - 1 - shared.left, len(FIGURES))
            plates[name] = drawn(study, entries[name])
        plates |= shared.theirs()
    sections: dict[str, Section] = {}
    pictures: dict[str, tuple[bytes, bytes]] = {}
    for part in FIGURES:
        if shared is None:
            progress(FIGURES.index(part), len(FIGURES))
        one = plates.get(part.name) or drawn(study, part)
        sections[part.name] = Section(part.name, part.title, one.content)
        if part.name in BESIDE:
            sections[BESIDE[part.name].name] = section_of(BESIDE[part.name], study)
        if one.pair:
            pictures[part.name] = one.pair
    return sections, pictures


#: what an address may hold as it is, besides letters and digits
_PLAIN = "/:;,()[]{}|^*!?@$=+-._~"
#: a report is made again where a machine went down meanwhile: waiting for the disk would be most of the time of writing
_write = partial(write_bytes, sync=False)


def csv_of(frame: pd.DataFrame) -> bytes:
    """The frame as UTF-8 CSV with unix line ends and six significant digits; the run's own tables have them all."""
    floats = {name: _as_text(frame[name]) for name in frame.columns if frame[name].dtype == np.float64}
    return frame.assign(**floats).to_csv(index=False, lineterminator="\n", float_format="%.6g").encode("utf-8")


def _as_text(column: pd.Series) -> list[str]:
    """What pandas would write with the same format, in a third of its time."""
    return ["" if value != value else f"{value:.6g}" for value in column.tolist()]


def _data_address(media: str, content: bytes) -> str:
    """The content in an address: numbers are shorter as they are, pictures as base64."""
    plain = f"data:{media};charset=utf-8,{quote(content, safe=_PLAIN)}"
    coded = f"data:{media};base64,{base64.b64encode(content).decode('ascii')}"
    return min(plain, coded, key=len)


@seldom_collected()
def draw(
    run: Run, out: Path, *, single_file: bool = False, other: Process | None = None, progress: Progressed | None = None
) -> Path:
    """See `phongbench_reports.build`.

    other  the process that draws some of the figures, see `second_process.begun`
    """
    study = Rows(require_rows(run))
    named = single_file and out.suffix.lower() in (".html", ".htm") and not out.is_dir()
    index = out if named else out / PAGE
    make_folder(index.parent)
    drawn_here = [part.name for part in FIGURES]
    of = None if single_file else origin(run, drawn_here)
    if of is not None and is_current(out, of):
        return index
    if other is not None:
        names = [part.name for part in FIGURES if part.name not in LONG]
        with beside(other, [*names, *LONG]) as shared:
            sections, pictures = sections_of(study, shared, progress)
    else:
        sections, pictures = sections_of(study, progress=progress)
    sheets = {section.name: csv_of(section.data) for section in sections if section.data is not None}
    if single_file:
        figures = {name: (_data_address("image/svg+xml", of_both(*pair)), "") for name, pair in pictures.items()}
        data = {name: _data_address("text/csv", content) for name, content in sheets.items()}
        links = Links(style_sheet(), figures, data)
    else:
        figures = {name: (f"figures/{quote(name)}.svg", f"figures/{quote(name)}-dark.svg") for name in pictures}
        links = Links("", figures, {name: f"data/{quote(name)}.csv" for name in sheets})
        parts = _write_parts(out, pictures, sheets, [section.name for section in sections])
    _write(index, render(study, sections, links).encode("utf-8"))
    if of is not None:
        remember(out, of, drawn_here, [index.name, *parts])
    return index


def _write_parts(
    out: Path, pictures: Mapping[str, tuple[bytes, bytes]], sheets: Mapping[str, bytes], names: list[str]
) -> list[str]:
    """Style sheet, figures and CSVs, and their names; those of sections that are absent now are taken away."""
    files: dict[str, bytes | None] = {"style.css": style_sheet().encode("utf-8")}
    for name in names:
        light, dark = pictures.get(name, (None, None))
        files[f"data/{name}.csv"] = sheets.get(name)
        files |= {f"figures/{name}.svg": light, f"figures/{name}-dark.svg": dark}
    for part, content in files.items():
        if content is not None:
            _write(out / part, content)
        else:
            (out / part).unlink(missing_ok=True)
    return [part for part, content in files.items() if content is not None]
