"""Answers for a device that was measured a moment ago and is sent with the question; nothing of it is kept."""

from collections.abc import Callable, Mapping
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from phongbench import __version__
from phongbench.analysis import promises
from phongbench.analysis.front import points
from phongbench.analysis.recommend import recommend as cheapest
from phongbench.targets.measured import MeasuredTable, of_document
from phongbench_api.answers import FRONT, RECOMMEND
from phongbench_api.http import media
from phongbench_api.http.openapi import ASK, described
from phongbench_api.http.problems import request_errors
from phongbench_api.models import FrontParameters, RecommendParameters
from phongbench_api.service import service
from phongbench_api.work import request_bodies

router = APIRouter(prefix="/v1", tags=["answers"])
#: bytes that a measurement may have: that of the most rows has about half as many
LARGEST = 256 << 10
#: predicted seconds of answering: reading and checking a run's files
SECONDS = 0.2
#: predicted seconds of reading a byte: a row's formula is written as code, to know it again
READING = 3e-5
_STORED = (400, 404, 406, 408, 409, 413, 422, 503)
_TIME = {"cost": 0.2, "low": 0.19, "high": 0.21}
EXAMPLE = {
    "schema": 1, "target": "page-adreno-740", "cost_kind": "measured", "unit": "ns", "precision": "float32",
    "adapter": "Adreno (TM) 740", "tool": "WebGPU", "tool_version": "Chrome 142", "phongbench": __version__,
    "dot": _TIME, "rows": [{"formula": "phong", "alpha": 50, **_TIME}],
}  # fmt: skip
_SCHEMA = {
    "type": "object",
    "description": "what the explorer measured and `phongbench targets add` reads",
    "required": list(EXAMPLE),
}
_BODY = {"requestBody": {"required": True, "content": {media.JSON: {"schema": _SCHEMA, "example": EXAMPLE}}}}


@router.post(
    "/recommend",
    summary="The cheapest formula on a device that was just measured",
    openapi_extra=_BODY | {ASK: "/v1/recommend?alpha=50&max_error=1/255"},
    **described(RECOMMEND, *_STORED),
)
async def recommend_measured(request: Request, parameters: Annotated[RecommendParameters, Query()]) -> Response:
    """As GET answers, by the times in the body; `target` is the body's."""
    here, options = service(request), parameters.model_dump(exclude={"run"})

    def work(table: MeasuredTable) -> Any:
        run = here.store.newest_timed() if parameters.run is None else here.store.intact(parameters.run)
        return cheapest(run, **options | {"target": table.name}, search=False, root=table)

    return await _answer(request, SECONDS + promises.seconds(parameters.budget()), work)


@router.post(
    "/runs/{run}/front",
    summary="The error/time front of a run on a device that was just measured",
    openapi_extra=_BODY | {ASK: "/v1/runs/latest/front?alpha=50"},
    **described(FRONT, *_STORED),
)
async def front_measured(request: Request, run: str, parameters: Annotated[FrontParameters, Query()]) -> Response:
    """As GET answers, by the run's errors and the times in the body; `target` is the body's."""
    here, options = service(request), parameters.model_dump()

    def work(table: MeasuredTable) -> Any:
        return points(here.store.intact(run), **options | {"target": table.name}, root=table)

    return await _answer(request, SECONDS, work)


async def _answer(request: Request, cost: float, answer: Callable[[MeasuredTable], Mapping[str, Any]]) -> Response:
    """What `answer` makes of the measurement in the body, at a predicted cost besides that of reading it."""
    spans, here = media.Spans(), service(request)
    media.body_type(request, (media.JSON,))
    media.negotiate(request.headers.get("accept"), (media.JSON,))
    here.admission.check()
    body = await request_bodies.read(request, LARGEST, here.admission)
    document = media.parsed(body)
    spans.mark("parse")

    def work(_cancelled: object) -> Any:
        with request_errors():
            table = of_document(document)
        return answer(table)

    return await here.admission.run(request, cost + READING * len(body), work, media.json, spans)
