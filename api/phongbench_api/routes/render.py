"""Pictures of scenes; what a request means is phongbench.scenes.requests's business."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import orjson
from fastapi import APIRouter, Request
from starlette.responses import Response

from phongbench.errors import CancelledError
from phongbench.formulas.formula import MODELS
from phongbench.inputs import meshes
from phongbench.scenes import scene
from phongbench.scenes.mesh_objects import COARSEST, FINEST_UNTRUSTED, SMOOTH
from phongbench.scenes.requests import SKIPS, Drawn, RenderRequest, render_request
from phongbench.scenes.scene_files import BRIGHTEST, examples
from phongbench.support import image_files
from phongbench.support.documents import LARGEST
from phongbench_api.http import arrays, media
from phongbench_api.http.openapi import described, object_schema
from phongbench_api.http.problems import Cancelled, TooLargeError, request_errors
from phongbench_api.http.shapes import answer
from phongbench_api.models import FORMULA_SCHEMA, FRESNEL_SCHEMA, SPELLING_SCHEMA
from phongbench_api.service import Service, service
from phongbench_api.settings import Settings
from phongbench_api.work import render_cost, request_bodies

router = APIRouter(prefix="/v1", tags=["shading"])
FAMILY = (media.PNG, media.JSON, media.NPY)
EXAMPLE: dict[str, Any] = {"scene": "chequerboard", "size": [16, 9], "specular": "lyon:difference:8", "depth": 2}
EXAMPLE_ANSWER: dict[str, Any] = {
    "scene": "chequerboard",
    "width": 16,
    "height": 9,
    "rays": 144,
    "seconds": {"total": 0.01, "tracing": 0.004, "shading": 0.003},
    "ledger": [{"name": "background", "kind": "exact", "unit": "rays", "of": 144, "skipped": 24, "bound": 0.0}],
}


def _number(low: float = -LARGEST, high: float = LARGEST) -> dict[str, Any]:
    return {"type": "number", "minimum": low, "maximum": high}


def _list(count: int, of: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": of, "minItems": count, "maxItems": count}


def _whole(low: int, high: int) -> dict[str, Any]:
    return {"type": "integer", "minimum": low, "maximum": high}


def _named(*names: str) -> dict[str, Any]:
    return {"type": "string", "enum": list(names)}


_THREE, _COLOUR, _FLAG = _list(3, _number()), _list(3, _number(0, 1)), {"type": "boolean"}
_TEXT, _LENGTH = {"type": "string", "minLength": 1}, _number(scene.SHORTEST)
_SIZE = _list(2, _whole(1, scene.MOST_PIXELS))
_DEPTH, _SAMPLES = _whole(0, scene.MOST_DEPTH), _whole(1, scene.MOST_SUPERSAMPLING)
_CAMERA = object_schema(
    {"position": _THREE, "target": _THREE, "up": _THREE, "field_of_view": _number(1, 170)}, "position", "target"
)
_MATERIAL = object_schema(
    {
        "like": _TEXT | {"description": "a classic OpenGL material, such as gold"},
        "ambient": _COLOUR,
        "diffuse": _COLOUR,
        "specular": _COLOUR,
        "shininess": _number(0, 1e5),
        "reflectivity": _number(0, 1),
        "approximation": SPELLING_SCHEMA,
        "fresnel": FRESNEL_SCHEMA,
    }
)
_BOARD = object_schema({"chequerboard": _list(2, _TEXT), "side": _LENGTH}, "chequerboard")
_LIGHT = object_schema(
    {
        "direction": _THREE | {"description": "towards a light that is far away"},
        "position": _THREE,
        "attenuation": _list(3, _number(0)),
        "reach": _LENGTH,
        "colour": _COLOUR,
        "highlight": _COLOUR,
        "ambient": _COLOUR,
        "intensity": _number(0, BRIGHTEST),
    }
)
_SPHERE = object_schema(
    {"shape": _named("sphere"), "centre": _THREE, "radius": _LENGTH, "material": _TEXT},
    "shape",
    "centre",
    "radius",
    "material",
)
_PLANE = object_schema(
    {"shape": _named("plane"), "point": _THREE, "normal": _THREE, "material": _TEXT}, "shape", "material"
)
_MATRIX = {"type": "array", "items": _list(4, _number()), "minItems": 3, "maxItems": 4}
_MESH = object_schema(
    {
        "shape": _named("mesh"),
        "surface": _named(*meshes.TESSELLATIONS),
        "degrees": _number(FINEST_UNTRUSTED, COARSEST),
        "material": _TEXT,
        "matrix": _MATRIX,
        "scale": {"anyOf": [_number(), _THREE]},
        "rotate": _THREE,
        "translate": _THREE,
        "normals": _named("unit", "raw"),
        "smooth": _named(*SMOOTH),
    },
    "shape",
    "surface",
    "material",
)
_SCENE = object_schema(
    {
        "camera": _CAMERA,
        "materials": {"type": "object", "additionalProperties": {"anyOf": [_MATERIAL, _BOARD]}},
        "lights": {"type": "array", "items": _LIGHT, "maxItems": scene.MOST_LIGHTS},
        "ambient_light": _COLOUR,
        "objects": {
            "type": "array",
            "items": {"oneOf": [_SPHERE, _PLANE, _MESH]},
            "minItems": 1,
            "maxItems": scene.MOST_OBJECTS,
        },
        "background": _list(3, _number(0, BRIGHTEST)),
        "picture": object_schema({"size": _SIZE, "depth": _DEPTH, "supersampling": _SAMPLES, "shadows": _FLAG}),
    },
    "camera",
    "materials",
    "objects",
) | {"description": "the data of a scene file"}
_REQUEST = object_schema(
    {
        "scene": {"anyOf": [_named(*examples()), _SCENE]},
        "size": _SIZE,
        "depth": _DEPTH,
        "supersampling": _SAMPLES,
        "shadows": _FLAG,
        "specular": FORMULA_SCHEMA,
        "model": _named(*MODELS),
        "skip": _named(*SKIPS) | {"description": "what may be left out; exact: what changes no bit"},
        "compare": _FLAG | {"description": "draw exact Phong too"},
    },
    "scene",
)
REQUEST_BODY = {"required": True, "content": {media.JSON: {"schema": _REQUEST, "example": EXAMPLE}}}


@router.post(
    "/render",
    summary="The picture of a scene",
    openapi_extra={"requestBody": REQUEST_BODY},
    **described(answer(EXAMPLE_ANSWER), 400, 406, 408, 413, 422, 503, also=(media.PNG, media.NPY)),
)
async def render(request: Request) -> Response:
    """A scene, shipped or sent, drawn with any registered formula, and what was left out on the way.

    As image/png 8-bit sRGB; with `compare` exact Phong, this formula and their difference side by side, with captions
    and a scale. As application/x-npy linear light, float32 (height, width, 3), of this formula alone. As
    application/json no picture but the ledger, and with `compare` the picture's error against exact Phong. A scene
    that is sent names no files: its meshes are tessellated surfaces.
    """
    spans, here = media.Spans(), service(request)
    rendering = await _read(request, here)
    spans.mark("parse")
    cost = here.kernels.render_cost(rendering.request)
    return await here.admission.run(request, cost, rendering.evaluate, rendering.answer, spans)


@dataclass(frozen=True, slots=True)
class Rendering:
    """A request for a picture, read and checked, with the media type of its answer."""

    request: RenderRequest
    media_type: str
    service: Service

    def evaluate(self, cancelled: Callable[[], bool]) -> Drawn:
        """Picture and ledger, on one thread: other requests have the other cores."""
        with request_errors():
            try:
                self.service.kernels.compile_rendering(self.request)
                return self.request.draw(threads=1, tile=render_cost.tile(self.request), cancelled=cancelled)
            except CancelledError:
                raise Cancelled from None

    def answer(self, drawn: Drawn, spans: media.Spans) -> Response:
        """The picture, its ledger in a header; or as JSON the ledger, and the picture's error if it is compared."""
        if self.media_type == media.JSON:
            return media.json(drawn.as_dict(), spans)
        if self.media_type == media.NPY:
            response = arrays.binary(drawn.done.picture, media.NPY, spans)
        else:
            response = media.response(image_files.png(drawn.picture), media.PNG, spans)
        skipped = {line.name: line.skipped for line in drawn.done.ledger}
        response.headers["phongbench-skipped"] = orjson.dumps(skipped).decode()
        return response


async def _read(request: Request, here: Service) -> Rendering:
    """The request; RequestError of some kind for what is wrong with it.

    A scene may hold thousands of objects, so it is read in a thread, as work of its own.
    """
    media.body_type(request, (media.JSON,))
    media_type = media.negotiate(request.headers.get("accept"), FAMILY)
    here.admission.check()
    body = await request_bodies.read(request, here.settings.max_scene, here.admission)
    document, cost = media.parsed(body), render_cost.reading(body)
    work = lambda cancelled: _checked(document, here.settings)  # noqa: E731
    checked = await here.admission.run(request, cost, work, lambda result, spans: result, media.Spans())
    return Rendering(checked, media_type, here)


def _checked(document: Any, settings: Settings) -> RenderRequest:
    with request_errors():
        request = render_request(document, settings.max_triangles)
    if request.pixels > settings.max_pixels:
        raise TooLargeError(f"more than {settings.max_pixels} pixels", "size", "ask for a smaller picture")
    if len(request.scene.lights) > settings.max_lights:
        raise TooLargeError(f"more than {settings.max_lights} lights", "scene.lights", "leave some out")
    return request
