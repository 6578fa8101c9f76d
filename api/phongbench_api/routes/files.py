"""Finished reports and their figures: only files that are there by name, only from the report's own folder."""

import io
import re
import threading
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from fastapi import APIRouter, Request
from fastapi import Path as PathParameter
from starlette.responses import Response

from phongbench.results.runs import Run
from phongbench_api.http import media, middleware
from phongbench_api.http.openapi import described
from phongbench_api.http.problems import NotFoundError
from phongbench_api.runs.answer_cache import AnswerCache
from phongbench_api.service import Service, service

router = APIRouter(tags=["reports"])
#: what a report is made of, by suffix; anything else in its folder is not served
MEDIA = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": media.SVG,
    ".csv": "text/csv; charset=utf-8",
    ".png": media.PNG,
}
#: predicted seconds of reading a file, and of drawing a figure anew as PNG
READING, DRAWING = 0.001, 2.0
_STEM = re.compile(r"[A-Za-z0-9_-]{1,64}")
_DRAWN = AnswerCache(32)
#: matplotlib's settings belong to the process: one figure at a time
_DRAWING_LOCK = threading.Lock()
_HEADERS = {"content-security-policy": middleware.STORED_POLICY}
_HOW = "phongbench report RUN draws it"


@router.get(
    "/v1/runs/{run}/figures/{name}.{kind}",
    summary="A figure of a finished report",
    **described(None, 404, 409, 503, also=(media.SVG, media.PNG), ask="/v1/runs/latest/figures/front.svg"),
)
async def figure(
    request: Request,
    run: str,
    name: Annotated[str, PathParameter(pattern=f"^{_STEM.pattern}$")],
    kind: Literal["svg", "png"],
) -> Response:
    """As it lies in the report (svg), or drawn from the run's rows (png)."""
    here = service(request)
    work = lambda cancelled: _figure(here, run, name, kind)  # noqa: E731
    cost = READING if kind == "svg" else DRAWING
    return await here.admission.run(request, cost, work, partial(media.file, request, _HEADERS), media.Spans())


@router.get(
    "/runs/{run}/report/{path:path}",
    summary="A finished report",
    **described(None, 404, 409, 503, also=("text/html", "text/css", media.SVG, media.CSV), ask="/runs/latest/report/"),
)
async def report(request: Request, run: str, path: str) -> Response:
    """The report as `phongbench report` drew it: its page, and the files the page names."""
    here = service(request)
    work = lambda cancelled: _report_file(here, run, path or "index.html")  # noqa: E731
    return await here.admission.run(request, READING, work, partial(media.file, request, _HEADERS), media.Spans())


def _files(run: Run) -> dict[str, Path]:
    """The report's files by their path in requests: index.html, style.css, figures/x.svg, data/x.csv.

    A request's path is only compared with these names. Symbolic links are left out, wherever they lead.
    """
    root = run.path / "report"
    places = [root, root / "figures", root / "data"]
    if any(place.is_symlink() for place in places):
        return {}
    files = [file for place in places if place.is_dir() for file in place.iterdir()]
    plain = (f for f in files if f.suffix in MEDIA and _STEM.fullmatch(f.stem) and f.is_file() and not f.is_symlink())
    return {file.relative_to(root).as_posix(): file for file in plain}


def _report_file(here: Service, name: str, path: str) -> tuple[bytes, str]:
    """A file of a run's report and its media type."""
    file = _files(here.store.find(name)).get(path)
    if file is None:
        raise NotFoundError("the report of this run has no such file", fix=_HOW)
    return file.read_bytes(), MEDIA[file.suffix]


def _figure(here: Service, name: str, stem: str, kind: str) -> tuple[bytes, str]:
    """A figure of a run's report as SVG, or drawn from its rows as PNG; CorruptRunError if the rows are damaged."""
    if f"figures/{stem}.svg" not in _files(here.store.find(name)):
        raise NotFoundError("the report of this run has no such figure", fix=_HOW)
    if kind == "svg":
        return _report_file(here, name, f"figures/{stem}.svg")
    run = here.store.intact(name)
    with _DRAWING_LOCK:
        return _DRAWN.get((run.path, here.store.stamp(run), stem), lambda: _drawn(run, stem)), media.PNG


def _drawn(run: Run, stem: str) -> bytes:
    from phongbench.analysis.rows import Rows
    from phongbench_reports.figures import FIGURES
    from phongbench_reports.plots import Plate, ink

    draw = next((figure.make for figure in FIGURES if figure.name == stem), None)
    if draw is None:
        raise NotFoundError("this figure exists as SVG only")
    with ink():
        plate = draw(Rows(run))
        if not isinstance(plate, Plate):
            raise NotFoundError("the run holds no rows for this figure")
        out = io.BytesIO()
        plate.figure.savefig(out, format="png", dpi=160, metadata={"Software": "phongbench"})
    return out.getvalue()
