"""What moving bytes costs by itself, for the load program; no server has it unless it is told to."""

from fastapi import APIRouter, Request
from starlette.responses import Response

from phongbench_api import bodies, wire
from phongbench_api.service import service

router = APIRouter(include_in_schema=False)


@router.post("/echo")
async def echo(request: Request, size: int) -> Response:
    """Reads the body, answers the first `size` bytes of it."""
    body = await bodies.read(request, service(request).settings.max_body, service(request).office)
    return Response(memoryview(body)[:size], media_type=wire.OCTETS)
