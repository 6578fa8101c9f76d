"""Questions that a stored run answers; answers are kept until a file of the run changes."""

from collections.abc import Callable
from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from phongbench.analysis import claims, front, recommend
from phongbench_api.http import media
from phongbench_api.models import FrontAsk, RecommendAsk
from phongbench_api.service import Service

#: predicted seconds of a question that has not been answered yet: reading and checking a run's files
QUESTION = 0.2


async def answered(request: Request, service: Service, question: Callable[[], Any]) -> Response:
    """The answer as JSON, worked out on a core."""
    spans = media.Spans()
    spans.mark("parse")
    return await service.office.do(request, QUESTION, lambda gone: question(), media.json, spans)


def front_of(service: Service, name: str, ask: FrontAsk) -> dict[str, Any]:
    """The front of a stored run."""
    run = service.store.intact(name)
    key = ("front", run.path, service.store.stamp(run), ask)
    return dict(service.answers.get(key, lambda: front.points(run, **ask.model_dump())))


def recommended(service: Service, ask: RecommendAsk) -> dict[str, Any]:
    """The formula for a budget, from a stored run or from the laws."""
    run = service.store.newest_timed() if ask.run is None else service.store.intact(ask.run)
    wish = ask.model_dump(exclude={"run"})
    key = ("recommend", None if run is None else (run.path, service.store.stamp(run)), ask)
    return dict(service.answers.get(key, lambda: recommend.recommend(run, **wish)))


def claims_of(service: Service, name: str) -> dict[str, Any]:
    """The textbook claims as a stored run judges them."""
    run = service.store.intact(name)
    key = ("claims", run.path, service.store.stamp(run))
    return dict(service.answers.get(key, lambda: claims.answer(run)))
