"""One server: routes, guard, problem documents, and kernels that are warm before it says it is ready."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import anyio.to_thread
from fastapi import FastAPI

from phongbench import __version__
from phongbench_api import errors, openapi
from phongbench_api.guard import Guard
from phongbench_api.routes import ROUTERS
from phongbench_api.service import Service
from phongbench_api.settings import Settings


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    service: Service = app.state.service
    await anyio.to_thread.run_sync(service.kernels.warm)
    service.warm = True
    yield
    service.office.draining = True


def create_app(settings: Settings | None = None) -> FastAPI:
    """The application; its kernels are compiled when it starts, not when it is made."""
    chosen = settings or Settings()
    app = FastAPI(
        title="phongbench", version=__version__, lifespan=_lifespan,
        docs_url=None, redoc_url=None, redirect_slashes=False,
        telemetry={"tracing": False, "metrics": False, "logs": False},
    )  # fmt: skip
    app.state.service = Service(chosen)
    app.add_middleware(Guard, settings=chosen)
    errors.install(app)
    for router in ROUTERS:
        app.include_router(router)
    openapi.install(app)
    return app
