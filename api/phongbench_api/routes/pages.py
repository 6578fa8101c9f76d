"""The pages that the package brings, read once, with no outside host: explorer, rows of a run, documentation."""

import re
from functools import cache, partial
from importlib import resources
from typing import Any

from fastapi import APIRouter, FastAPI, Request
from starlette.responses import Response

from phongbench_api.http import documentation, media
from phongbench_api.http.problems import NotFoundError
from phongbench_api.service import service

router = APIRouter(include_in_schema=False)
#: predicted seconds of reading a manifest
READING = 0.01
_MEDIA = {
    "html": "text/html; charset=utf-8",
    "css": "text/css; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "mjs": "text/javascript; charset=utf-8",
    "svg": "image/svg+xml",
    "png": "image/png",
    "ico": "image/x-icon",
    "json": "application/json",
    "woff2": "font/woff2",
    "txt": "text/plain; charset=utf-8",
    "webmanifest": "application/manifest+json",
    "md": "text/plain; charset=utf-8",
}
#: comments that stand alone on their lines, in scripts and styles of our own: a tenth of what the page would load
_COMMENTS = re.compile(rb"(?m)^[ \t]*(?://[^\n]*|/\*(?:[^*]|\*(?!/))*\*/)[ \t]*\n")


@router.get("/")
async def explorer(request: Request) -> Response:
    """The explorer."""
    return media.file(request, {}, _file("index.html"))


@router.get("/docs")
async def docs(request: Request) -> Response:
    """The documentation."""
    return media.file(request, {}, _documentation(request.app))


@router.get("/runs/{run}/rows")
async def rows(request: Request, run: str) -> Response:
    """The page that filters, sorts and turns over the rows of a run; 404 where there is no such run."""
    here = service(request)

    def work(_cancelled: object) -> tuple[bytes, str]:
        here.store.find(run)
        return _file("rows.html")

    return await here.admission.run(request, READING, work, partial(media.file, request, {}), media.Spans())


@router.get("/web/{path:path}")
async def asset(request: Request, path: str) -> Response:
    """A script, style or picture of the pages."""
    return media.file(request, {}, _file(path))


@cache
def files() -> dict[str, tuple[bytes, str]]:
    """Every file of the folder web by its path there, with its media type; a request's path is only looked up here."""
    pages: dict[str, tuple[bytes, str]] = {}
    _collect(resources.files("phongbench_api") / "web", "", pages)
    return pages


def _collect(folder: Any, prefix: str, pages: dict[str, tuple[bytes, str]]) -> None:
    for entry in folder.iterdir():
        suffix = "txt" if "LICENSE" in entry.name else entry.name.rpartition(".")[2]
        if entry.is_dir():
            _collect(entry, f"{prefix}{entry.name}/", pages)
        elif suffix in _MEDIA:
            own = prefix != "vendor/" and suffix in ("js", "css")
            content = entry.read_bytes()
            pages[prefix + entry.name] = (_COMMENTS.sub(b"", content) if own else content, _MEDIA[suffix])


def _file(path: str) -> tuple[bytes, str]:
    if path not in files():
        raise NotFoundError("the page has no such file")
    return files()[path]


def _documentation(app: FastAPI) -> tuple[bytes, str]:
    """The documentation as a page without scripts, made from the OpenAPI document once."""
    if not hasattr(app.state, "documentation"):
        app.state.documentation = documentation.page(app.openapi()).encode()
    return app.state.documentation, _MEDIA["html"]
