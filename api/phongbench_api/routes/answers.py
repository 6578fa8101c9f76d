"""What to ship: recommendations, fronts and claims; answers are cached until a file of the run changes."""

from collections.abc import Callable
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from phongbench.analysis import promises
from phongbench.analysis.claims import answer as judged
from phongbench.analysis.compare_times import compare_times
from phongbench.analysis.front import points
from phongbench.analysis.recommend import recommend as cheapest
from phongbench.results.runs import Run
from phongbench_api.answers import CLAIMS, COMPARISON, FRONT, RECOMMEND
from phongbench_api.http import media
from phongbench_api.http.openapi import described
from phongbench_api.models import CompareParameters, FrontParameters, RecommendParameters
from phongbench_api.service import Service, service

router = APIRouter(prefix="/v1", tags=["answers"])
_STORED = (404, 409, 422, 503)
#: predicted seconds of a question that has not been answered yet: reading and checking a run's files
SECONDS = 0.2


@router.get(
    "/recommend",
    summary="The cheapest formula within an error budget",
    **described(RECOMMEND, *_STORED, 413, ask="/v1/recommend?alpha=50&max_error=1/255"),
)
async def recommend(request: Request, parameters: Annotated[RecommendParameters, Query()]) -> Response:
    """The cheapest formula whose largest error is within the budget, the next one, and the nearest miss.

    Without `run` the newest whole run with times answers; where there is none, the closed-form laws. What is within is
    proven; a formula that cannot be proven is not searched here, so nothing is promised of it.
    """
    here, budget = service(request), parameters.model_dump(exclude={"run"})

    def work(_cancelled: object) -> Any:
        run = here.store.newest_timed() if parameters.run is None else here.store.intact(parameters.run)
        return _cached(here, run, parameters, lambda: cheapest(run, **budget, search=False, root=here.store.root))

    cost = SECONDS + promises.seconds(parameters.budget())
    return await here.admission.run(request, cost, work, media.json, media.Spans())


@router.get(
    "/runs/{run}/front",
    summary="The error/time front of a run",
    **described(FRONT, *_STORED, ask="/v1/runs/latest/front?alpha=50"),
)
async def front(request: Request, run: str, parameters: Annotated[FrontParameters, Query()]) -> Response:
    """Every timed formula with its error, its time, and whether another one beats it in both."""
    options, root = parameters.model_dump(), service(request).store.root
    return await _answer(request, run, parameters, lambda stored: points(stored, **options, root=root))


@router.get(
    "/runs/{run}/claims",
    summary="The textbook claims, judged",
    **described(CLAIMS, *_STORED, ask="/v1/runs/latest/claims"),
)
async def claims(request: Request, run: str) -> Response:
    """Each claim with its verdict, its conditions and the rows that decide it."""
    return await _answer(request, run, "claims", judged)


@router.get(
    "/runs/{run}/compare",
    summary="How the times of a run differ from another's",
    **described(COMPARISON, *_STORED, ask="/v1/runs/latest/compare?against=latest"),
)
async def compare(request: Request, run: str, parameters: Annotated[CompareParameters, Query()]) -> Response:
    """Each kernel's time over exact Phong's, in the run `against` and in this one, and the ratio of the two ratios.

    Only of runs that one machine timed: `why_not` says so of others, and `rows` is empty then.
    """
    here = service(request)

    def work(_cancelled: object) -> Any:
        before, after = here.store.intact(parameters.against), here.store.intact(run)
        named = {"run": after.id, "against": before.id}
        return _cached(
            here, after, (before.path, here.store.stamp(before)), lambda: named | compare_times(before, after)
        )

    return await here.admission.run(request, SECONDS, work, media.json, media.Spans())


async def _answer(request: Request, name: str, question: object, answer: Callable[[Run], Any]) -> Response:
    here = service(request)

    def work(_cancelled: object) -> Any:
        run = here.store.intact(name)
        return _cached(here, run, question, lambda: answer(run))

    return await here.admission.run(request, SECONDS, work, media.json, media.Spans())


def _cached(here: Service, run: Run | None, question: object, make: Callable[[], Any]) -> Any:
    state = None if run is None else (run.path, here.store.stamp(run))
    return here.answers.get((state, here.store.added_stamp(getattr(question, "target", "")), question), make)
