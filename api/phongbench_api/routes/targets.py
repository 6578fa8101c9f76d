"""The machines that a formula may run on."""

from fastapi import APIRouter
from starlette.responses import Response

from phongbench.targets.listing import listing
from phongbench_api.http import media
from phongbench_api.http.openapi import described

router = APIRouter(prefix="/v1", tags=["formulas"])
_EXAMPLE = {"name": "rdna2", "cost_kind": "compiled", "available": True, "why_not": None, "unit": "cycles"}


@router.get("/targets", summary="Every target", **described({"targets": [_EXAMPLE]}))
async def targets() -> Response:
    """The machines that costs are known of: what each rests on, and what it lacks here."""
    return media.json({"targets": listing()})
