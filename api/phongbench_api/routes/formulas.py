"""The catalogue of formulas."""

from fastapi import APIRouter
from starlette.responses import Response

from phongbench.formulas.registry import REGISTRY, describe
from phongbench_api.formula_answers import APPROXIMATION, APPROXIMATIONS
from phongbench_api.http import media
from phongbench_api.http.openapi import described
from phongbench_api.http.problems import NotFoundError

router = APIRouter(prefix="/v1", tags=["formulas"])


@router.get("/approximations", summary="Every formula", **described(APPROXIMATIONS))
async def approximations() -> Response:
    """The registry: formula, parameters with ranges, lambda forms, source, cost and support of each."""
    return media.json({"approximations": [describe(spec) for spec in REGISTRY.values()]})


@router.get(
    "/approximations/{name}", summary="One formula", **described(APPROXIMATION, 404, ask="/v1/approximations/lyon")
)
async def approximation(name: str) -> Response:
    """One entry of the registry."""
    if name not in REGISTRY:
        raise NotFoundError("no approximation of that name", fix=f"known: {', '.join(REGISTRY)}")
    return media.json(describe(REGISTRY[name]))
