"""A formula over the angle."""

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from phongbench_api import curves
from phongbench_api.http import media as wire
from phongbench_api.http.openapi import described
from phongbench_api.models import CurveAsk
from phongbench_api.service import service

router = APIRouter(prefix="/v1", tags=["shading"])


@router.get(
    "/curve",
    summary="Value and error against the angle",
    **described(curves.EXAMPLE, 406, 413, 422, 503, also=(wire.CSV, wire.SVG)),
)
async def curve(request: Request, ask: Annotated[CurveAsk, Query()]) -> Response:
    """The lobe of a formula, exact Phong's, and their difference, over the angle between R and V."""
    spans = wire.Spans()
    media = wire.negotiate(request.headers.get("accept"), curves.FAMILY)
    cost, work = curves.plan(service(request), ask, media)
    spans.mark("parse")
    encode = partial(curves.answer, media)
    return await service(request).office.do(request, cost, work, encode, spans)
