"""Files of a finished report: only those that are there by name, only from its own folder."""

import hashlib
import io
import re
import threading
from collections import OrderedDict
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from phongbench.results.runs import Run
from phongbench_api.http import media as wire
from phongbench_api.http import middleware
from phongbench_api.http.problems import NotFoundError
from phongbench_api.service import Service

#: what a report is made of, by suffix; anything else in its folder is not told
MEDIA = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": wire.SVG,
    ".csv": "text/csv; charset=utf-8",
    ".png": wire.PNG,
}
#: predicted seconds of reading a file, and of drawing a figure anew as PNG
READING, DRAWING = 0.001, 2.0
_STEM = re.compile(r"[A-Za-z0-9_-]{1,64}")
_PICTURES = 32


def listed(run: Run) -> dict[str, Path]:
    """The report's files by the path they are asked for: index.html, style.css, figures/x.svg, data/x.csv.

    A request's path is only compared with these names. Symbolic links are left out, wherever they lead.
    """
    root = run.path / "report"
    places = [root, root / "figures", root / "data"]
    if any(place.is_symlink() for place in places):
        return {}
    files = [file for place in places if place.is_dir() for file in place.iterdir()]
    plain = (f for f in files if f.suffix in MEDIA and _STEM.fullmatch(f.stem) and f.is_file() and not f.is_symlink())
    return {file.relative_to(root).as_posix(): file for file in plain}


def report_file(service: Service, name: str, path: str) -> tuple[bytes, str]:
    """A file of a run's report and its media type; NotFoundError says how a report is made."""
    found = listed(service.store.find(name)).get(path)
    if found is None:
        raise NotFoundError("the report of this run has no such file", fix="phongbench report RUN draws it")
    return found.read_bytes(), MEDIA[found.suffix]


def figure(service: Service, name: str, stem: str, kind: str) -> tuple[bytes, str]:
    """A figure of a run's report as SVG, or drawn from its rows as PNG."""
    if f"figures/{stem}.svg" not in listed(service.store.find(name)):
        raise NotFoundError("the report of this run has no such figure", fix="phongbench report RUN draws it")
    if kind == "svg":
        return report_file(service, name, f"figures/{stem}.svg")
    return _PAINTER.png(service, name, stem), wire.PNG


def answer(request: Request, found: tuple[bytes, str], spans: wire.Spans, *, stored: bool = True) -> Response:
    """The file, or 304 where the client has it already."""
    content, media = found
    tag = f'"{hashlib.sha256(content).hexdigest()[:32]}"'
    headers = {"etag": tag, "cache-control": "no-cache"}
    headers |= {"content-security-policy": middleware.STORED_POLICY} if stored else {}
    known = [one.strip().removeprefix("W/") for one in request.headers.get("if-none-match", "").split(",")]
    if tag in known:
        return Response(None, 304, headers)
    spans.mark("encode")
    return Response(content, headers=headers | spans.header(), media_type=media)


class _Painter:
    """Draws figures of runs as PNG, one at a time (matplotlib's settings belong to the process), and keeps the last."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._kept: OrderedDict[Any, bytes] = OrderedDict()

    def png(self, service: Service, name: str, stem: str) -> bytes:
        """The figure; CorruptRunError if its rows are not those that were written."""
        run = service.store.intact(name)
        key = (run.path, service.store.stamp(run), stem)
        with self._lock:
            if key not in self._kept:
                self._kept[key] = _drawn(run, stem)
            while len(self._kept) > _PICTURES:
                self._kept.popitem(last=False)
            return self._kept[key]


def _drawn(run: Run, stem: str) -> bytes:
    from phongbench.analysis.rows import Rows
    from phongbench_reports.figures import FIGURES
    from phongbench_reports.plots import Plate, ink

    draw = next((figure.draw for figure in FIGURES if figure.name == stem), None)
    if draw is None:
        raise NotFoundError("this figure exists as SVG only")
    with ink():
        plate = draw(Rows(run))
        if not isinstance(plate, Plate):
            raise NotFoundError("the run holds no rows for this figure")
        out = io.BytesIO()
        plate.figure.savefig(out, format="png", dpi=160, metadata={"Software": "phongbench"})
    return out.getvalue()


_PAINTER = _Painter()
