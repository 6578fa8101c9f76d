"""Normals and heights from shading; what a request means is phongbench.inverse.line_files's business."""

from collections.abc import Callable
from functools import partial
from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import Response

from phongbench.inverse.branches import PRIORS
from phongbench.inverse.line import RULES, STARTS, InverseLine
from phongbench.inverse.line_files import line_request
from phongbench.support.document_paths import UNTRUSTED
from phongbench_api.formula_answers import INVERSE_LINE
from phongbench_api.http import media
from phongbench_api.http.openapi import described, object_schema
from phongbench_api.http.problems import TooLargeError, request_errors
from phongbench_api.service import service
from phongbench_api.work import request_bodies

router = APIRouter(prefix="/v1", tags=["shading"])
EXAMPLE = {"intensity": [0.6, 0.8, 0.6], "ambient": 0.1, "diffuse": 0.7, "light": [0.0, 1.0], "prior": "convex"}
#: predicted seconds of a sample
SECONDS = 2e-5
_NUMBER = {"type": "number"}
_POSITIVE = {"type": "number", "minimum": 0}
_FLAG = {"type": "boolean", "default": False}
_BODY = object_schema(
    {
        "intensity": {"type": "array", "items": {"type": "number", "minimum": 0, "maximum": 1}},
        "x": {"type": ["array", "null"], "items": _NUMBER, "description": "growing; left out: 1 apart"},
        "ambient": _POSITIVE,
        "diffuse": _POSITIVE,
        "light": {"type": "array", "items": _NUMBER, "minItems": 2, "maxItems": 2, "description": "x, z; z >= 0"},
        "prior": {"type": "string", "enum": list(PRIORS), "default": "convex"},
        "noise": _POSITIVE | {"description": "standard deviation of intensities", "default": 0},
        "rule": {"type": "string", "enum": list(RULES), "default": "simpson"},
        "start": {"type": "string", "enum": list(STARTS), "default": "left"},
        "bridge": _FLAG,
        "unit_light": _FLAG,
    },
    "intensity",
    "ambient",
    "diffuse",
    "light",
)
REQUEST_BODY = {"required": True, "content": {media.JSON: {"schema": _BODY, "example": EXAMPLE}}}


@router.post(
    "/inverse/line",
    summary="Normals and heights along a line across a cylinder",
    openapi_extra={"requestBody": REQUEST_BODY},
    **described(INVERSE_LINE, 400, 406, 408, 413, 422, 503),
)
async def inverse_line(request: Request) -> Response:
    """Both normals that explain each intensity, the one that the prior means first, and heights with their band.

    x to the right, z and heights to the viewer. null stands for what shading does not say; `marks` tells why.
    """
    spans, here = media.Spans(), service(request)
    media.body_type(request, (media.JSON,))
    media.negotiate(request.headers.get("accept"), (media.JSON,))
    here.admission.check()
    body = await request_bodies.read(request, here.settings.max_json, here.admission)
    with request_errors():
        count, work = line_request(media.parsed(body), UNTRUSTED)
    if count > here.settings.max_json_points:
        raise TooLargeError(f"more than {here.settings.max_json_points} samples", "intensity", "ask in parts")
    spans.mark("parse")
    return await here.admission.run(request, SECONDS * count, partial(_evaluate, work), _answer, spans)


def _evaluate(work: Callable[[], InverseLine], _cancelled: object) -> dict[str, Any]:
    with request_errors():
        return work().as_dict()


def _answer(line: dict[str, Any], spans: media.Spans) -> Response:
    return media.json(line, spans)
