"""The explorer page and the documentation."""

from fastapi import APIRouter, Request
from starlette.responses import Response

from phongbench_api import pages, stored_files
from phongbench_api.http import media

router = APIRouter(include_in_schema=False)


@router.get("/")
async def explorer(request: Request) -> Response:
    """The explorer."""
    return stored_files.answer(request, pages.file("index.html"), media.Spans(), stored=False)


@router.get("/docs")
async def docs(request: Request) -> Response:
    """The documentation."""
    return stored_files.answer(request, pages.documentation(request.app), media.Spans(), stored=False)


@router.get("/web/{path:path}")
async def asset(request: Request, path: str) -> Response:
    """A script, style or picture of the pages."""
    return stored_files.answer(request, pages.file(path), media.Spans(), stored=False)
