"""Pictures of scenes."""

from fastapi import APIRouter, Request
from starlette.responses import Response

from phongbench_api import render_schema, rendering
from phongbench_api.http import media
from phongbench_api.http.openapi import described
from phongbench_api.service import service

router = APIRouter(prefix="/v1", tags=["shading"])

_ANSWERS = described(rendering.EXAMPLE_ANSWER, 400, 406, 408, 413, 422, 503, also=(media.PNG, media.NPY))


@router.post(
    "/render", summary="The picture of a scene", openapi_extra={"requestBody": render_schema.REQUEST_BODY}, **_ANSWERS
)
async def render(request: Request) -> Response:
    """A scene, shipped or sent, drawn with any registered formula, and what was left out on the way.

    As image/png 8-bit sRGB; with `compare` exact Phong, this formula and their amplified difference side by side. As
    application/x-npy linear light, float32 (height, width, 3), of this formula alone. As application/json no picture
    but the ledger, and with `compare` the picture's error against exact Phong. A scene that is sent names no files:
    its meshes are tessellated surfaces.
    """
    spans = media.Spans()
    ask = await rendering.read(request, service(request))
    spans.mark("parse")
    return await service(request).office.do(request, ask.cost, ask.evaluate, ask.answer, spans)
