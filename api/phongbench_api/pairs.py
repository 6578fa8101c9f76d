"""A specular request from its bytes to its answer."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from starlette.requests import Request
from starlette.responses import Response

from phongbench.compiler.lowering import Precision, precision_named
from phongbench.compiler.precisions import Array
from phongbench_api.http import media as wire
from phongbench_api.http.problems import RequestError, UnsupportedMediaError
from phongbench_api.models import BinaryAsk, SpecularAsk
from phongbench_api.service import Service
from phongbench_api.work import evaluation, request_bodies
from phongbench_api.work.evaluation import Formula

FAMILY = (wire.JSON, wire.OCTETS, wire.NPY)
_POST = ", ".join(FAMILY)

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
_VECTORS = {"type": "array", "items": {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}}


@dataclass(frozen=True, slots=True)
class Pairs:
    """A specular request, read and checked.

    a, b   (n, 3)  directions in the precision they came in; views of the body where it was binary
    media  str     of the answer
    cost   float   predicted seconds
    """

    formula: Formula
    precision: Precision
    a: Array
    b: Array
    compare: bool
    media: str
    cost: float
    service: Service

    def evaluate(self, gone: Callable[[], bool]) -> dict[str, Any]:
        """`values`, and with `compare` what they are compared with."""
        self.service.kernels.compile_pairs(self.formula, self.precision)
        a, b = (np.ascontiguousarray(v, dtype=self.precision.carrier) for v in (self.a, self.b))
        found = evaluation.values(self.formula, a, b, self.precision, gone)
        more = evaluation.compared(self.formula, self.a, self.b, found, gone) if self.compare else {}
        return {"values": found} | more

    def answer(self, found: dict[str, Any], spans: wire.Spans) -> Response:
        """The values in the media type that was asked for."""
        return wire.json(found, spans) if self.media == wire.JSON else wire.binary(found["values"], self.media, spans)


async def read(request: Request, service: Service) -> Pairs:
    """The request; RequestError of some kind for what is wrong with it."""
    kind = wire.media_type(request.headers.get("content-type"))
    if kind not in FAMILY:
        fix = f"send {_POST}"
        raise UnsupportedMediaError("no such body is read here", "Content-Type", fix, headers={"accept-post": _POST})
    media = wire.negotiate(request.headers.get("accept"), (kind, *(m for m in FAMILY if m != kind)))
    service.office.check()
    ask, a, b = await (_of_json if kind == wire.JSON else _of_binary)(request, service, kind)
    if len(a) != len(b):
        raise RequestError(f"there are {len(a)} vectors a and {len(b)} vectors b", "b", "one of each for every pair")
    request_bodies.check_count(len(a), "a", media, service.settings)
    if ask.compare and media != wire.JSON:
        raise RequestError("a comparison is told in JSON only", "compare", f"Accept: {wire.JSON}")
    formula, precision = evaluation.asked(ask), precision_named(ask.precision)
    cost = service.kernels.pairs_cost(formula, precision, len(a), compare=ask.compare)
    return Pairs(formula, precision, a, b, ask.compare, media, cost, service)


async def _of_json(request: Request, service: Service, kind: str) -> tuple[SpecularAsk, Array, Array]:
    if request.query_params:
        raise RequestError("with a JSON body every parameter is in the body", "(query)")
    data = wire.parsed(await request_bodies.read(request, service.settings.max_json, service.office))
    if not isinstance(data, dict):
        raise RequestError("the body must be an object", "(body)")
    a, b = (wire.vectors(data.pop(name, None), name) for name in ("a", "b"))
    return SpecularAsk.model_validate(data, strict=True), a, b


async def _of_binary(request: Request, service: Service, kind: str) -> tuple[SpecularAsk, Array, Array]:
    ask = BinaryAsk.model_validate(dict(request.query_params))
    evaluation.asked(ask)  # what is wrong with the query is told before the body is read
    body = await request_bodies.read(request, service.settings.max_body, service.office)
    if kind == wire.NPY:
        both = wire.npy(body)
        return ask, both[0], both[1]
    return ask, *wire.raw_pairs(body, ask.dtype)


def _body_schema() -> dict[str, Any]:
    schema = SpecularAsk.model_json_schema(by_alias=True)
    schema["properties"] = schema["properties"] | {"a": _VECTORS, "b": _VECTORS}
    schema["required"] = [*schema["required"], "a", "b"]
    return schema


_BINARY = {"schema": {"type": "string", "format": "binary"}}
REQUEST_BODY = {
    "required": True,
    "content": {wire.JSON: {"schema": _body_schema(), "example": EXAMPLE}, wire.OCTETS: _BINARY, wire.NPY: _BINARY},
}
