"""The specular term of pairs of directions."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from fastapi import APIRouter, Request
from starlette.responses import Response

from phongbench.compiler.lowering import Precision, precision_named
from phongbench.compiler.precisions import Array
from phongbench_api.http import arrays, media
from phongbench_api.http.openapi import described, query
from phongbench_api.http.problems import RequestError
from phongbench_api.http.shapes import answer
from phongbench_api.models import BinaryParameters, SpecularParameters
from phongbench_api.service import Service, service
from phongbench_api.work import evaluation, request_bodies
from phongbench_api.work.evaluation import Lobe

router = APIRouter(prefix="/v1", tags=["shading"])
FAMILY = (media.JSON, media.OCTETS, media.NPY)
EXAMPLE = {
    "approximation": "lyon",
    "lambda": "cross",
    "gamma": 8,
    "alpha": 50,
    "beta": "taylor",
    "precision": "float32",
    "a": [[0, 0, 1], [0, 0, 1]],
    "b": [[0, 0, 1], [0.6, 0, 0.8]],
    "compare": True,
}
EXAMPLE_ANSWER = {"values": [1.0, 0.0], "exact": [1.0, 1.4e-05], "max_abs_error": 1.4e-05, "worst_index": 1}


def _request_body() -> dict[str, Any]:
    vectors = {"type": "array", "items": {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}}
    schema = SpecularParameters.model_json_schema(by_alias=True)
    schema["properties"] = schema["properties"] | {"a": vectors, "b": vectors}
    schema["required"] = [*schema["required"], "a", "b"]
    schema["anyOf"] = [{"required": ["approximation"]}, {"required": ["formula"]}]
    binary = {"schema": {"type": "string", "format": "binary"}}
    content = {media.JSON: {"schema": schema, "example": EXAMPLE}, media.OCTETS: binary, media.NPY: binary}
    return {"required": True, "content": content}


@router.post(
    "/specular",
    summary="Highlights of pairs",
    **described(answer(EXAMPLE_ANSWER), 400, 406, 408, 413, 415, 422, 503, also=(media.OCTETS, media.NPY))
    | {"openapi_extra": {"parameters": query(BinaryParameters, optional=True), "requestBody": _request_body()}},
)
async def specular(request: Request) -> Response:
    """One value for each pair (a, b), by any registered formula; with `compare` the exact term beside it.

    As JSON all is in the body. As octets (all of a, then all of b) or .npy of shape (2, N, 3) the parameters are in
    the query, and the answer is of the same family unless Accept asks otherwise.
    """
    spans, here = media.Spans(), service(request)
    pairs = await _read(request, here)
    spans.mark("parse")
    return await here.admission.run(request, pairs.cost, pairs.evaluate, pairs.answer, spans)


@dataclass(frozen=True, slots=True)
class _Pairs:
    """A specular request, read and checked.

    a, b        (n, 3)  directions in the precision they came in; views of the body where it was binary
    media_type  str     of the answer
    """

    lobe: Lobe
    precision: Precision
    a: Array
    b: Array
    compare: bool
    media_type: str
    service: Service

    @property
    def cost(self) -> float:
        """Predicted seconds."""
        return self.service.kernels.pairs_cost(self.lobe, self.precision, len(self.a), compare=self.compare)

    def evaluate(self, cancelled: Callable[[], bool]) -> dict[str, Any]:
        """`values`, and with `compare` what they are compared with."""
        self.service.kernels.compile_pairs(self.lobe, self.precision)
        a, b = (np.ascontiguousarray(v, dtype=self.precision.carrier) for v in (self.a, self.b))
        values = evaluation.values(self.lobe, a, b, self.precision, cancelled)
        more = evaluation.compared(self.lobe, self.a, self.b, values, cancelled) if self.compare else {}
        return {"values": values} | more

    def answer(self, result: dict[str, Any], spans: media.Spans) -> Response:
        """The values in the media type of the answer."""
        if self.media_type == media.JSON:
            return media.json(result, spans)
        return arrays.binary(result["values"], self.media_type, spans)


async def _read(request: Request, here: Service) -> _Pairs:
    """The request; RequestError of some kind for what is wrong with it."""
    kind = media.body_type(request, FAMILY)
    media_type = media.negotiate(request.headers.get("accept"), (kind, *(m for m in FAMILY if m != kind)))
    here.admission.check()
    parameters, a, b = await (_of_json if kind == media.JSON else _of_binary)(request, here, kind)
    if len(a) != len(b):
        raise RequestError(f"there are {len(a)} vectors a and {len(b)} vectors b", "b", "one of each for every pair")
    request_bodies.check_count(len(a), "a", media_type, here.settings)
    if parameters.compare and media_type != media.JSON:
        raise RequestError("a comparison is answered in JSON only", "compare", f"Accept: {media.JSON}")
    lobe, precision = evaluation.requested(parameters), precision_named(parameters.precision)
    return _Pairs(lobe, precision, a, b, parameters.compare, media_type, here)


async def _of_json(request: Request, here: Service, kind: str) -> tuple[SpecularParameters, Array, Array]:
    if request.query_params:
        raise RequestError("with a JSON body every parameter is in the body", "(query)")
    document = media.parsed(await request_bodies.read(request, here.settings.max_json, here.admission))
    if not isinstance(document, dict):
        raise RequestError("the body must be an object", "(body)")
    a, b = (arrays.vectors(document.pop(name, None), name) for name in ("a", "b"))
    return SpecularParameters.model_validate(document, strict=True), a, b


async def _of_binary(request: Request, here: Service, kind: str) -> tuple[SpecularParameters, Array, Array]:
    parameters = BinaryParameters.model_validate(dict(request.query_params))
    evaluation.requested(parameters)  # errors of the query are reported before the body is read
    body = await request_bodies.read(request, here.settings.max_body, here.admission)
    if kind == media.NPY:
        both = arrays.npy(body)
        return parameters, both[0], both[1]
    return parameters, *arrays.raw_pairs(body, parameters.dtype)
