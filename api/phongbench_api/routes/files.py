"""Finished reports and their figures."""

from functools import partial
from typing import Annotated, Literal

from fastapi import APIRouter, Path, Request
from starlette.responses import Response

from phongbench_api import stored_files
from phongbench_api.http import media
from phongbench_api.http.openapi import described
from phongbench_api.service import service

router = APIRouter(tags=["reports"])
_BYTES = described(None, 404, 409, 503, also=(media.SVG, media.PNG))
_FILES = described(None, 404, 409, 503, also=("text/html", "text/css", media.SVG, media.CSV))


@router.get("/v1/runs/{run}/figures/{name}.{kind}", summary="A figure of a finished report", **_BYTES)
async def figure(
    request: Request, run: str, name: Annotated[str, Path(pattern="^[A-Za-z0-9_-]{1,64}$")], kind: Literal["svg", "png"]
) -> Response:
    """As it lies in the report (svg), or drawn from the run's rows (png)."""
    spans = media.Spans()
    cost = stored_files.READING if kind == "svg" else stored_files.DRAWING
    work = lambda gone: stored_files.figure(service(request), run, name, kind)  # noqa: E731
    return await service(request).office.do(request, cost, work, partial(stored_files.answer, request), spans)


@router.get("/runs/{run}/report/{path:path}", summary="A finished report", **_FILES)
async def report(request: Request, run: str, path: str) -> Response:
    """The report as `phongbench report` drew it: its page, and the files the page names."""
    spans = media.Spans()
    work = lambda gone: stored_files.report_file(service(request), run, path or "index.html")  # noqa: E731
    encode = partial(stored_files.answer, request)
    return await service(request).office.do(request, stored_files.READING, work, encode, spans)
