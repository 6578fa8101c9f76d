"""The stored runs."""

from typing import Annotated

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from phongbench_api import listing
from phongbench_api.http import media
from phongbench_api.http.openapi import described
from phongbench_api.models import PageAsk
from phongbench_api.service import service

router = APIRouter(prefix="/v1/runs", tags=["runs"])


@router.get("", summary="Every stored run, newest first", **described(listing.EXAMPLE, 422, 503))
async def runs(request: Request, ask: Annotated[PageAsk, Query()]) -> Response:
    """Manifests; a run whose manifest cannot be read is listed with the state `corrupt`."""
    spans, home = media.Spans(), service(request)
    work = lambda gone: listing.page(home.store, ask)  # noqa: E731
    return await home.office.do(request, listing.LISTING, work, media.json, spans)


@router.get("/{run}", summary="One run", **described(listing.EXAMPLE_RUN, 404, 409, 503))
async def run(request: Request, run: str) -> Response:
    """The manifest of a run, by its id or `latest`."""
    spans, home = media.Spans(), service(request)
    work = lambda gone: home.store.told(home.store.find(run).path)  # noqa: E731
    return await home.office.do(request, listing.LISTING, work, media.json, spans)
