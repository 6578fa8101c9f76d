"""The catalogue: what can be asked for."""

from fastapi import APIRouter
from starlette.responses import Response

from phongbench import summary
from phongbench.approximations import REGISTRY
from phongbench_api import wire
from phongbench_api.errors import NotFoundError
from phongbench_api.openapi import described

router = APIRouter(prefix="/v1", tags=["formulas"])
_EXAMPLE = summary.describe(REGISTRY["lyon"])


@router.get("/approximations", summary="Every formula", **described({"approximations": [_EXAMPLE]}))
async def approximations() -> Response:
    """The registry: formula, parameters with ranges, lambda forms, source, cost and support of each."""
    return wire.json({"approximations": [summary.describe(spec) for spec in REGISTRY.values()]})


@router.get("/approximations/{name}", summary="One formula", **described(_EXAMPLE, 404))
async def approximation(name: str) -> Response:
    """One entry of the registry."""
    if name not in REGISTRY:
        raise NotFoundError("no approximation of that name", mend=f"known: {', '.join(REGISTRY)}")
    return wire.json(summary.describe(REGISTRY[name]))
