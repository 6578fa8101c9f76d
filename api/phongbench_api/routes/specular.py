"""The specular term of pairs of directions."""

from fastapi import APIRouter, Request
from starlette.responses import Response

from phongbench_api import pairs
from phongbench_api.http import media
from phongbench_api.http.openapi import described, query
from phongbench_api.models import BinaryAsk
from phongbench_api.service import service

router = APIRouter(prefix="/v1", tags=["shading"])


@router.post(
    "/specular",
    summary="Highlights of pairs",
    **described(pairs.EXAMPLE_ANSWER, 400, 406, 408, 413, 415, 422, 503, also=(media.OCTETS, media.NPY))
    | {"openapi_extra": {"parameters": query(BinaryAsk, optional=True), "requestBody": pairs.REQUEST_BODY}},
)
async def specular(request: Request) -> Response:
    """One value for each pair (a, b), by any registered formula; with `compare` the exact term beside it.

    As JSON all is in the body. As octets (all of a, then all of b) or .npy of shape (2, N, 3) the parameters are in
    the query, and the answer is of the same family unless Accept asks otherwise.
    """
    spans = media.Spans()
    ask = await pairs.read(request, service(request))
    spans.mark("parse")
    return await service(request).office.do(request, ask.cost, ask.evaluate, ask.answer, spans)
