"""The machines that a formula may run on."""

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response

from phongbench.targets.listing import listing
from phongbench_api.answers import TARGETS
from phongbench_api.http import media
from phongbench_api.http.openapi import described
from phongbench_api.service import service

router = APIRouter(prefix="/v1", tags=["formulas"])


@router.get("/targets", summary="Every target", **described(TARGETS))
async def targets(request: Request) -> Response:
    """The machines that costs are known of: what each rests on, and what it lacks here."""
    # the first asks a driver what adapter there is, in a process of its own
    return media.json({"targets": await run_in_threadpool(listing, service(request).store.root)})
