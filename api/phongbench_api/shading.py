"""A shading request from its bytes to its answer; what it means is phongbench.shading.requests's business."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import orjson
from starlette.requests import Request
from starlette.responses import Response

from phongbench.errors import CancelledError, InputError, UnknownNameError
from phongbench.shading.requests import ShadingRequest, shading_request
from phongbench.shading.shade import Shaded
from phongbench_api.http import media as wire
from phongbench_api.http import multipart
from phongbench_api.http.problems import Cancelled, RequestError, TooLargeError, UnsupportedMediaError
from phongbench_api.service import Service
from phongbench_api.work import request_bodies

READS = (wire.JSON, wire.MULTIPART)
_POST = ", ".join(READS)

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
EXAMPLE_ANSWER: dict[str, Any] = {"colours": [[1.7, 1.6, 1.5]], "skipped": {"pairs": 1}}


@dataclass(frozen=True, slots=True)
class Shading:
    """A shading request, read and checked, with the media type of its answer and its predicted seconds."""

    request: ShadingRequest
    media: str
    cost: float
    service: Service

    def evaluate(self, gone: Callable[[], bool]) -> Shaded:
        """Colours and ledger, on one thread: other requests have the other cores."""
        self.service.kernels.compile_shading(self.request)
        with _fields():
            try:
                return self.request.shade(threads=1, cancelled=gone)
            except CancelledError:
                raise Cancelled from None

    def answer(self, found: Shaded, spans: wire.Spans) -> Response:
        """Colours and ledger; in binary the ledger is a header."""
        skipped = found.ledger.as_dict()
        if self.media == wire.JSON:
            return wire.json({"colours": found.colours, "skipped": skipped}, spans)
        response = wire.binary(found.colours, self.media, spans)
        response.headers["phongbench-skipped"] = orjson.dumps(skipped).decode()
        return response


async def read(request: Request, service: Service) -> Shading:
    """The request; RequestError of some kind for what is wrong with it."""
    header = request.headers.get("content-type")
    kind = wire.media_type(header)
    if kind not in READS:
        headers = {"accept-post": _POST}
        raise UnsupportedMediaError("no such body is read here", "Content-Type", f"send {_POST}", headers=headers)
    offered = (wire.JSON, wire.NPY, wire.OCTETS) if kind == wire.JSON else (wire.NPY, wire.OCTETS, wire.JSON)
    media = wire.negotiate(request.headers.get("accept"), offered)
    service.office.check()
    settings = service.settings
    body = await request_bodies.read(
        request, settings.max_json if kind == wire.JSON else settings.max_body, service.office
    )
    asked = _of_json(body) if kind == wire.JSON else _of_parts(body, header or "", settings.max_json)
    request_bodies.check_count(len(asked.points), "points", media, settings)
    if len(asked.arguments["lights"]) > settings.max_lights:
        raise TooLargeError(f"more than {settings.max_lights} lights", "lights", "ask for some of them at a time")
    return Shading(asked, media, service.kernels.shading_cost(asked), service)


def _of_json(body: bytes) -> ShadingRequest:
    document = wire.parsed(body)
    with _fields():
        return shading_request(document)


def _of_parts(body: bytes, header: str, most: int) -> ShadingRequest:
    found = multipart.parts(body, header, ("request", "vectors"))
    if len(found["request"]) > most:
        raise TooLargeError(f"the part is larger than {most} bytes", "request")
    document, both = wire.parsed(bytes(found["request"])), wire.npy(found["vectors"], "vectors")
    with _fields():
        return shading_request(document, (both[0], both[1]))


@contextmanager
def _fields() -> Iterator[None]:
    """What the library says of a field becomes a problem that names it, and does not repeat what was sent."""
    try:
        yield
    except UnknownNameError as problem:
        raise RequestError(f"unknown {problem.kind}", problem.where, f"known: {', '.join(problem.known)}") from None
    except InputError as problem:
        place = re.fullmatch(r"(points|normals)\[(\d+)\]", problem.where or "")
        index = int(place[2]) if place else None
        raise RequestError(problem.what, problem.where, problem.fix, index=index) from None
