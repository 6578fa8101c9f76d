"""The pages the package brings: the explorer and the documentation, read once, with no outside host."""

from functools import cache
from importlib import resources
from typing import Any

from fastapi import FastAPI
from jinja2 import Environment, PackageLoader

from phongbench import __version__
from phongbench_api.http import problems
from phongbench_api.http.problems import NotFoundError

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


@cache
def files() -> dict[str, tuple[bytes, str]]:
    """Every file of the folder web by its path there, with its media type; a request's path is only looked up here."""
    found: dict[str, tuple[bytes, str]] = {}
    _collect(resources.files("phongbench_api") / "web", "", found)
    return found


def _collect(folder: Any, prefix: str, found: dict[str, tuple[bytes, str]]) -> None:
    for entry in folder.iterdir():
        if entry.is_dir():
            _collect(entry, f"{prefix}{entry.name}/", found)
        elif entry.name.rpartition(".")[2] in _MEDIA:
            found[prefix + entry.name] = (entry.read_bytes(), _MEDIA[entry.name.rpartition(".")[2]])
        elif "LICENSE" in entry.name:
            found[prefix + entry.name] = (entry.read_bytes(), _MEDIA["txt"])


def file(path: str) -> tuple[bytes, str]:
    """A file of the page."""
    if path not in files():
        raise NotFoundError("the page has no such file")
    return files()[path]


def documentation(app: FastAPI) -> tuple[bytes, str]:
    """The documentation as a page without scripts, made from the OpenAPI document once."""
    if not hasattr(app.state, "documentation"):
        loader = PackageLoader("phongbench_api")
        box = Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
        kinds = sorted(
            {kind for _, kind in problems.STATUS} | set(problems.KINDS.values()), key=lambda kind: kind.status
        )
        page = box.get_template("docs.html.j2").render(api=app.openapi(), kinds=kinds, version=__version__)
        app.state.documentation = page.encode()
    return app.state.documentation, _MEDIA["html"]
