"""Is the server there, is it ready, and what is it?"""

from fastapi import APIRouter, Request
from starlette.responses import Response

from phongbench_api import facts
from phongbench_api.http import media
from phongbench_api.http.openapi import described
from phongbench_api.http.problems import BusyError
from phongbench_api.service import service

router = APIRouter(tags=["server"])


@router.get("/healthz", summary="Is the server there?", **described({"status": "ok"}))
async def healthz() -> Response:
    """Answers as long as the process runs, however busy the cores are."""
    return media.json({"status": "ok"})


@router.get("/readyz", summary="May requests be sent here?", **described({"status": "ok"}, 503))
async def readyz(request: Request) -> Response:
    """503 until the kernels are warm, and again while the server goes down."""
    if not service(request).office.open or service(request).office.draining:
        raise BusyError("not ready", headers={"retry-after": "1"})
    return media.json({"status": "ok"})


@router.get("/v1/meta", summary="Versions, limits, media types", **described(facts.EXAMPLE))
async def meta(request: Request) -> Response:
    """What this server is, what it reads and writes, and how much of it."""
    return media.json(facts.meta(service(request).settings))
