"""A request for a picture from its bytes to its answer; what it means is phongbench.scenes.requests's business."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import orjson
from starlette.requests import Request
from starlette.responses import Response

from phongbench.errors import CancelledError, InputError, UnknownNameError
from phongbench.scenes import images
from phongbench.scenes.requests import Drawn, RenderRequest, render_request
from phongbench_api.http import media as wire
from phongbench_api.http.problems import Cancelled, RequestError, TooLargeError, UnsupportedMediaError
from phongbench_api.service import Service
from phongbench_api.settings import Settings
from phongbench_api.work import render_cost, request_bodies

FAMILY = (wire.PNG, wire.JSON, wire.NPY)
EXAMPLE: dict[str, Any] = {"scene": "chequerboard", "size": [16, 9], "specular": "lyon:difference:8", "depth": 2}
EXAMPLE_ANSWER: dict[str, Any] = {
    "scene": "chequerboard",
    "width": 16,
    "height": 9,
    "rays": 144,
    "seconds": {"total": 0.01, "tracing": 0.004, "shading": 0.003},
    "ledger": [{"name": "background", "kind": "exact", "unit": "rays", "of": 144, "skipped": 24, "bound": 0.0}],
}


@dataclass(frozen=True, slots=True)
class Rendering:
    """A request for a picture, read and checked, with the media type of its answer and its predicted seconds."""

    request: RenderRequest
    media: str
    cost: float
    service: Service

    def evaluate(self, gone: Callable[[], bool]) -> Drawn:
        """Picture and ledger, on one thread: other requests have the other cores."""
        with _fields():
            try:
                self.service.kernels.compile_rendering(self.request)
                return self.request.draw(threads=1, tile=render_cost.tile(self.request), cancelled=gone)
            except CancelledError:
                raise Cancelled from None

    def answer(self, found: Drawn, spans: wire.Spans) -> Response:
        """The picture, its ledger in a header; or as JSON the ledger, and the picture's error if it is compared."""
        if self.media == wire.JSON:
            return wire.json(found.as_dict(), spans)
        skipped = {line.name: line.skipped for line in found.done.ledger}
        if self.media == wire.NPY:
            response = wire.binary(found.done.picture, wire.NPY, spans)
        else:
            body = images.png(found.picture)
            spans.mark("encode")
            response = Response(body, headers=spans.header(), media_type=wire.PNG)
        response.headers["phongbench-skipped"] = orjson.dumps(skipped).decode()
        return response


async def read(request: Request, service: Service) -> Rendering:
    """The request; RequestError of some kind for what is wrong with it.

    A scene may hold thousands of objects, so it is read in a thread, as work of its own.
    """
    if wire.media_type(request.headers.get("content-type")) != wire.JSON:
        headers = {"accept-post": wire.JSON}
        raise UnsupportedMediaError("no such body is read here", "Content-Type", f"send {wire.JSON}", headers=headers)
    media = wire.negotiate(request.headers.get("accept"), FAMILY)
    service.office.check()
    settings = service.settings
    body = await request_bodies.read(request, settings.max_scene, service.office)
    document = wire.parsed(body)
    asked = await service.office.do(
        request,
        render_cost.reading(body),
        lambda gone: _asked(document, settings),
        lambda found, spans: found,
        wire.Spans(),
    )
    return Rendering(asked, media, service.kernels.render_cost(asked), service)


def _asked(document: Any, settings: Settings) -> RenderRequest:
    with _fields():
        asked = render_request(document, settings.max_triangles)
    if asked.pixels > settings.max_pixels:
        raise TooLargeError(f"more than {settings.max_pixels} pixels", "size", "ask for a smaller picture")
    if len(asked.scene.lights) > settings.max_lights:
        raise TooLargeError(f"more than {settings.max_lights} lights", "scene.lights", "leave some out")
    return asked


@contextmanager
def _fields() -> Iterator[None]:
    """What the library says of a field becomes a problem that names it, and the member of a list if it is in one."""
    try:
        yield
    except UnknownNameError as problem:
        known = f"known: {', '.join(problem.known)}"
        raise RequestError(f"unknown {problem.kind}", problem.where, known, index=_index(problem)) from None
    except InputError as problem:
        raise RequestError(problem.what, problem.where, problem.fix, index=_index(problem)) from None


def _index(problem: InputError) -> int | None:
    place = re.match(r"scene\.(?:objects|lights|materials)\[(\d+)\]", problem.where or "")
    return int(place[1]) if place else None
