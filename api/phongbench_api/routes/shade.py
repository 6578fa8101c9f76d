"""The full reflection model over points and lights; what a request means is phongbench.shading.requests's business."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import orjson
from fastapi import APIRouter, Request
from starlette.responses import Response

from phongbench.errors import CancelledError
from phongbench.formulas.spec import ALPHA
from phongbench.shading.requests import ShadingRequest, shading_request
from phongbench.shading.shade import Shaded
from phongbench.support.document_paths import UNTRUSTED
from phongbench_api.http import arrays, media, multipart
from phongbench_api.http.openapi import described, object_schema
from phongbench_api.http.problems import Cancelled, TooLargeError, request_errors
from phongbench_api.http.shapes import REAL, WHOLE, Answer, by_name, list_of, record
from phongbench_api.models import FORMULA_SCHEMA, FRESNEL_SCHEMA
from phongbench_api.service import Service, service
from phongbench_api.work import request_bodies

router = APIRouter(prefix="/v1", tags=["shading"])
READS = (media.JSON, media.MULTIPART)
MATERIAL = {"ambient": [0.1, 0.1, 0.1], "diffuse": [0.6, 0.5, 0.4], "specular": [1, 1, 1], "shininess": 50}
EXAMPLE = {
    "model": "phong",
    "specular": {"approximation": "lyon", "lambda": "dot", "gamma": 8},
    "material": MATERIAL,
    "ambient_light": [1, 1, 1],
    "lights": [{"direction": [0, 0, 1], "diffuse": [1, 1, 1], "specular": [1, 1, 1]}],
    "viewer": {"direction": [0, 0, 1]},
    "points": [[0, 0, 0]],
    "normals": [[0, 0, 1]],
    "normalise": True,
}
ANSWER = Answer(
    record({"colours": list_of(list_of(REAL)), "skipped": by_name(WHOLE, "pairs left out, by reason")}),
    {"colours": [[1.7, 1.6, 1.5]], "skipped": {"pairs": 1}},
)

_NUMBER = {"type": "number"}
_THREE = {"type": "array", "items": _NUMBER, "minItems": 3, "maxItems": 3}
_COLOUR = {"type": "array", "items": {"type": "number", "minimum": 0}, "minItems": 3, "maxItems": 3}
_VECTORS = {"type": "array", "items": _THREE}


_MATERIAL = object_schema(
    {
        "ambient": _COLOUR,
        "diffuse": _COLOUR,
        "specular": _COLOUR,
        "shininess": {"type": "number", "minimum": 0, "maximum": ALPHA.high},
        "fresnel": FRESNEL_SCHEMA,
    },
    "ambient",
    "diffuse",
    "specular",
    "shininess",
)
_LIGHT = object_schema(
    {
        "direction": _THREE | {"description": "from the surface to the light"},
        "position": _THREE,
        "attenuation": _COLOUR | {"description": "c, l, q of 1 / (c + l d + q d^2)"},
        "diffuse": _COLOUR,
        "specular": _COLOUR,
        "ambient": _COLOUR | {"description": "added to ambient_light, attenuated as the light's other terms"},
        "reach": {"type": "number", "minimum": 0},
    }
)
_COMMON: dict[str, Any] = {
    "model": {"type": "string", "enum": ["phong", "blinn-phong"], "default": "phong"},
    "specular": FORMULA_SCHEMA,
    "material": _MATERIAL,
    "ambient_light": _COLOUR,
    "lights": {"type": "array", "items": _LIGHT},
    "viewer": object_schema({"position": _THREE, "direction": _THREE}),
    "normalise": {"type": "boolean", "default": True},
}
_BULK = {"points": _VECTORS, "normals": _VECTORS, "precision": {"type": "string", "enum": ["float32", "float64"]}}
_PLAIN = object_schema(_COMMON | _BULK, "material", "lights", "viewer", "points", "normals")
_FORM = object_schema(
    {
        "request": object_schema(_COMMON, "material", "lights", "viewer"),
        "vectors": {"type": "string", "format": "binary"},
    },
    "request",
    "vectors",
)
REQUEST_BODY = {
    "required": True,
    "content": {
        media.JSON: {"schema": _PLAIN, "example": EXAMPLE},
        media.MULTIPART: {
            "schema": _FORM,
            "encoding": {"request": {"contentType": media.JSON}, "vectors": {"contentType": media.NPY}},
        },
    },
}


@router.post(
    "/shade",
    summary="Colours of points",
    openapi_extra={"requestBody": REQUEST_BODY},
    **described(ANSWER, 400, 406, 408, 413, 422, 503, also=(media.NPY, media.OCTETS)),
)
async def shade(request: Request) -> Response:
    """Ambient, diffuse and specular terms of many lights, by Phong or Blinn-Phong, with any registered formula.

    As JSON all is in the body. As a form, `request` is that JSON without points and normals, and `vectors` a .npy of
    shape (2, N, 3): points, then normals; the answer is a .npy (N, 3) then, unless Accept asks otherwise. `skipped`
    tells how many (point, light) pairs were left out because they add nothing.
    """
    spans, here = media.Spans(), service(request)
    shading = await _read(request, here)
    spans.mark("parse")
    cost = here.kernels.shading_cost(shading.request)
    return await here.admission.run(request, cost, shading.evaluate, shading.answer, spans)


@dataclass(frozen=True, slots=True)
class Shading:
    """A shading request, read and checked, with the media type of its answer."""

    request: ShadingRequest
    media_type: str
    service: Service

    def evaluate(self, cancelled: Callable[[], bool]) -> Shaded:
        """Colours and ledger, on one thread: other requests have the other cores."""
        self.service.kernels.compile_shading(self.request)
        with request_errors():
            try:
                return self.request.shade(threads=1, cancelled=cancelled)
            except CancelledError:
                raise Cancelled from None

    def answer(self, shaded: Shaded, spans: media.Spans) -> Response:
        """Colours and ledger; in binary the ledger is a header."""
        skipped = shaded.ledger.as_dict()
        if self.media_type == media.JSON:
            return media.json({"colours": shaded.colours, "skipped": skipped}, spans)
        response = arrays.binary(shaded.colours, self.media_type, spans)
        response.headers["phongbench-skipped"] = orjson.dumps(skipped).decode()
        return response


async def _read(request: Request, here: Service) -> Shading:
    """The request; RequestError of some kind for what is wrong with it."""
    kind = media.body_type(request, READS)
    offered = (media.JSON, media.NPY, media.OCTETS) if kind == media.JSON else (media.NPY, media.OCTETS, media.JSON)
    media_type = media.negotiate(request.headers.get("accept"), offered)
    here.admission.check()
    settings = here.settings
    limit = settings.max_json if kind == media.JSON else settings.max_body
    body = await request_bodies.read(request, limit, here.admission)
    if kind == media.JSON:
        document, vectors = media.parsed(body), None
    else:
        document, vectors = _parts(body, request.headers["content-type"], settings.max_json)
    with request_errors():
        shading = shading_request(document, vectors, source=UNTRUSTED)
    request_bodies.check_count(len(shading.points), "points", media_type, settings)
    if len(shading.arguments["lights"]) > settings.max_lights:
        raise TooLargeError(f"more than {settings.max_lights} lights", "lights", "ask for some of them at a time")
    return Shading(shading, media_type, here)


def _parts(body: bytes, content_type: str, limit: int) -> tuple[Any, tuple[Any, Any]]:
    """The document of a form, and its points and normals."""
    parts = multipart.parts(body, content_type, ("request", "vectors"))
    if len(parts["request"]) > limit:
        raise TooLargeError(f"the part is larger than {limit} bytes", "request")
    document, both = media.parsed(bytes(parts["request"])), arrays.npy(parts["vectors"], "vectors")
    return document, (both[0], both[1])
