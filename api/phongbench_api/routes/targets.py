"""The machines that a formula may run on."""

from fastapi import APIRouter, Request
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
    return media.json({"targets": listing(service(request).store.root)})
