"""What to ship: recommendations, fronts and claims."""

from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from phongbench_api import questions
from phongbench_api.http.openapi import described
from phongbench_api.models import FrontAsk, RecommendAsk
from phongbench_api.service import service

router = APIRouter(prefix="/v1", tags=["answers"])
_POINT: dict[str, Any] = {"points": []}


@router.get(
    "/recommend",
    summary="The cheapest formula within an error budget",
    **described({"choices": [], "nearest_miss": None}, 404, 409, 422, 503),
)
async def recommend(request: Request, ask: Annotated[RecommendAsk, Query()]) -> Response:
    """The cheapest formula whose largest error is within the budget, the next one, and the nearest miss.

    Without `run` the newest whole run with times answers; where there is none, the closed-form laws.
    """
    return await questions.answered(request, service(request), lambda: questions.recommended(service(request), ask))


@router.get("/runs/{run}/front", summary="The error/time front of a run", **described(_POINT, 404, 409, 422, 503))
async def front(request: Request, run: str, ask: Annotated[FrontAsk, Query()]) -> Response:
    """Every timed formula with its error, its time, and whether another one beats it in both."""
    return await questions.answered(request, service(request), lambda: questions.front_of(service(request), run, ask))


@router.get(
    "/runs/{run}/claims", summary="The textbook claims, judged", **described({"claims": []}, 404, 409, 422, 503)
)
async def claims(request: Request, run: str) -> Response:
    """Each claim with its verdict, its conditions and the rows that decide it."""
    return await questions.answered(request, service(request), lambda: questions.claims_of(service(request), run))
