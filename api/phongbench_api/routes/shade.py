"""The full reflection model over points and lights."""

from fastapi import APIRouter, Request
from starlette.responses import Response

from phongbench_api import shade_schema, shading
from phongbench_api.http import media
from phongbench_api.http.openapi import described
from phongbench_api.service import service

router = APIRouter(prefix="/v1", tags=["shading"])


_ANSWERS = described(shading.EXAMPLE_ANSWER, 400, 406, 408, 413, 422, 503, also=(media.NPY, media.OCTETS))


@router.post(
    "/shade", summary="Colours of points", openapi_extra={"requestBody": shade_schema.REQUEST_BODY}, **_ANSWERS
)
async def shade(request: Request) -> Response:
    """Ambient, diffuse and specular terms of many lights, by Phong or Blinn-Phong, with any registered formula.

    As JSON all is in the body. As a form, `request` is that JSON without points and normals, and `vectors` a .npy of
    shape (2, N, 3): points, then normals; the answer is a .npy (N, 3) then, unless Accept asks otherwise. `skipped`
    tells how many (point, light) pairs were left out because they add nothing.
    """
    spans = media.Spans()
    ask = await shading.read(request, service(request))
    spans.mark("parse")
    return await service(request).office.do(request, ask.cost, ask.evaluate, ask.answer, spans)
