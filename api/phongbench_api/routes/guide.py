"""The guide: the Markdown pages of reports/docs as pages without scripts."""

import re
from functools import cache
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Any

from fastapi import APIRouter, Request
from jinja2 import Environment, PackageLoader
from markdown_it import MarkdownIt
from starlette.responses import Response

from phongbench import __version__
from phongbench_api.http import media
from phongbench_api.http.problems import NotFoundError

router = APIRouter(include_in_schema=False)
_HTML = "text/html; charset=utf-8"
#: marks of generated parts, and links out of the folder, which are not served
_MARKS, _OUTSIDE = re.compile(r"<!--.*?-->\n?", re.DOTALL), re.compile(r"\[([^\]]+)\]\(\.\./[^)]*\)")


@router.get("/guide/")
async def contents(request: Request) -> Response:
    """The list of pages."""
    return media.file(request, {}, (_page("Guide", _listed()), _HTML))


@router.get("/guide/{name}")
async def page(request: Request, name: str) -> Response:
    """A page, under the name of its file, so that links between files lead to pages."""
    if name not in texts():
        raise NotFoundError("the guide has no such page", fix="/guide/ lists them")
    title, body = _rendered(name)
    return media.file(request, {}, (_page(title, body), _HTML))


@cache
def texts() -> dict[str, str]:
    """The Markdown of every page by the name of its file; a request's path is only looked up here."""
    package = Path(str(resources.files("phongbench_reports")))
    # a wheel brings the pages inside the package, a checkout has them beside it
    folder = next(place for place in (package / "docs", package.parent / "docs") if place.is_dir())
    return {file.name: file.read_text(encoding="utf-8") for file in sorted(folder.glob("*.md"))}


@cache
def _rendered(name: str) -> tuple[str, str]:
    """The title of a page, and its body as HTML."""
    source = _OUTSIDE.sub(r"\1", _MARKS.sub("", texts()[name]))
    markdown = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = markdown.parse(source)
    title = next((text.content for mark, text in pairwise(tokens) if mark.tag == "h1"), name)
    for mark, text in pairwise(tokens):
        _adapt(mark, text)
    return title, str(markdown.renderer.render(tokens, markdown.options, {}))


def _adapt(mark: Any, text: Any) -> None:
    """Headings get the name that links use; columns are set by a class, since inline styles are not allowed."""
    if mark.type == "heading_open":
        mark.attrSet("id", text.content.lower().replace(" ", "-"))
    if style := mark.attrs.pop("style", ""):
        mark.attrSet("class", str(style).rpartition(":")[2])


def _listed() -> str:
    items = (f'<li><a href="{name}">{_rendered(name)[0]}</a></li>' for name in texts())
    return f"<h1>Guide</h1>\n<ul>\n{''.join(items)}\n</ul>"


def _page(title: str, body: str) -> bytes:
    templates = Environment(loader=PackageLoader("phongbench_api"), autoescape=True, trim_blocks=True)
    made = templates.get_template("guide.html.j2").render(title=title, body=body, version=__version__)
    return made.encode()
