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
from phongbench.support.user_paths import make_folder
from phongbench_reports.figures import FIGURES
from phongbench_reports.figures.pictures import SECTIONS
from phongbench_reports.kept import PAGE, is_current, origin, remember
from phongbench_reports.page import Links, Section, render, style_sheet
from phongbench_reports.parts import BEHAVIOUR, BESIDE, CLAIMS, LAST
from phongbench_reports.plots import ink
from phongbench_reports.second_process import Drawn, Process, Shared, beside, drawn
from phongbench_reports.svg import of_both
from phongbench_reports.table import Absent, Part
from phongbench_reports.tables.adapter import adapter
from phongbench_reports.tables.by_target import by_target, turned
from phongbench_reports.tables.code import code
from phongbench_reports.tables.raw_verdict import raw_verdict
from phongbench_reports.tables.verdict import verdict
from phongbench_reports.text import BUDGETS

if TYPE_CHECKING:
    from phongbench.results.runs import Run


#: is called with how many steps are done, and how many there are
Progressed = Callable[[int, int], None]
#: figures of what the answers are made of, too: who has made those draws them sooner
FIRST = ("targets", "front", "raw_vectors")


def sections_of(
    study: Rows, shared: Shared | None = None, progress: Progressed | None = None
) -> tuple[list[Section], dict[str, tuple[bytes, bytes]]]:
    """All sections in page order, and the SVGs (light, dark) of the figures among them.

    shared    the parts, where another process makes some of them
    progress  called with (done, total) before each part that this process makes
    """
    answers = _answers(study)  # meanwhile the other process makes parts
    with ink():
        made = _made(study, shared, progress or (lambda done, total: None))
    sections = {part.name: Section(part.name, part.title, made[part.name].content, part.folded) for part in shareable()}
    figures = []
    for part in FIGURES:
        figures += [sections[part.name], *(sections[one.name] for name, one in BESIDE.items() if name == part.name)]
    speed = next(one for one in figures if one.name == "speed") if "speed" in sections else None
    scenes = [sections[part.name] for part in SECTIONS]
    if all(isinstance(section.content, Absent) for section in scenes):
        scenes = [Section("pictures", "Pictures of scenes", scenes[0].content)]
    answers += [Section("adapter", "On this machine's adapter", adapter(study))] if "gpu" in study.run.manifest else []
    behaviour, last = ([sections[part.name] for part in group] for group in (BEHAVIOUR, LAST))
    figures = [one for one in figures if one is not speed]
    order = [*answers, *figures, *behaviour, *scenes, sections[CLAIMS.name], *([speed] if speed else []), *last]
    return order, {name: one.pair for name, one in made.items() if one.pair}


def shareable() -> list[Part]:
    """What two processes share, one from the front and the other from the end: there is what takes the other long."""
    figures = sorted(FIGURES, key=lambda part: part.name not in FIRST)
    return [*SECTIONS, *figures, *BESIDE.values(), *BEHAVIOUR, *LAST, CLAIMS]


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


def _made(study: Rows, shared: Shared | None, progress: Progressed) -> dict[str, Drawn]:
    """Every part by its name."""
    todo = {part.name: part for part in shareable()}
    made: dict[str, Drawn] = {}
    if shared is not None:
        for name in shared.mine():
            progress(len(todo) - 1 - shared.left, len(todo))
            made[name] = drawn(study, todo[name])
        made |= shared.theirs()
    for index, (name, part) in enumerate(todo.items()):
        if name not in made:
            progress(index, len(todo))
            made[name] = drawn(study, part)
    return made


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


def draw(
    run: Run, out: Path, *, single_file: bool = False, other: Process | None = None, progress: Progressed | None = None
) -> Path:
    """See `phongbench_reports.build`.

    other  the process that makes some of the parts, see `second_process.begun`
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
        with beside(other, [part.name for part in shareable()]) as shared:
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
