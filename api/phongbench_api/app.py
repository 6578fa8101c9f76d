"""One server: routes, guard, problem documents, and kernels that are warm before it is ready."""

import asyncio
import logging
import signal
import threading
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from types import FrameType

import anyio
import anyio.to_thread
from fastapi import FastAPI

from phongbench import __version__
from phongbench_api.http import openapi, problems
from phongbench_api.http.cross_origin import CrossOrigin, origin
from phongbench_api.http.middleware import Guard
from phongbench_api.routes import ROUTERS
from phongbench_api.service import Service
from phongbench_api.settings import Settings

log = logging.getLogger("phongbench.api")


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    """Warm up beside the event loop, so that health answers meanwhile; listen for the signal to go down."""
    service: Service = app.state.service
    async with anyio.create_task_group() as group:
        group.start_soon(_warm_up, service)
        with _draining_on_signals(service):
            yield
        service.admission.draining = True
    service.cool_down()


async def _warm_up(service: Service) -> None:
    """Compile the kernels; where that fails the server would never be ready, so its process gives up, if it may."""
    try:
        await anyio.to_thread.run_sync(service.warm_up)
    except Exception:
        if service.give_up is None:
            raise
        log.exception("the kernels cannot be compiled")
        service.give_up()


@contextmanager
def _draining_on_signals(service: Service) -> Iterator[None]:
    """While it lasts, SIGTERM and SIGINT turn `/readyz` to 503 at once and reach the server after `drain_seconds`."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    loop, before = asyncio.get_running_loop(), {s: signal.getsignal(s) for s in (signal.SIGTERM, signal.SIGINT)}

    def drain(number: int, frame: FrameType | None) -> None:
        service.admission.draining = True
        handler = before[signal.Signals(number)]
        if callable(handler) and not service.settings.drain_seconds:
            handler(number, frame)
        elif callable(handler):
            loop.call_later(service.settings.drain_seconds, handler, number, frame)

    for number in before:
        signal.signal(number, drain)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def create_app(settings: Settings | None = None) -> FastAPI:
    """The application; its kernels are compiled when it starts, not when it is made.

    Raises InputError for a setting of `cors` that is no origin.
    """
    chosen = settings or Settings()
    app = FastAPI(
        title="phongbench",
        version=__version__,
        lifespan=_lifespan,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        telemetry={"tracing": False, "metrics": False, "logs": False},
    )
    app.state.service = Service(chosen)
    app.add_middleware(Guard, settings=chosen)
    if chosen.cors:  # around the guard, whose refusals a page may read too
        app.add_middleware(CrossOrigin, origins=tuple(map(origin, chosen.cors)))
    problems.install(app)
    for router in ROUTERS:
        app.include_router(router)
    openapi.install(app)
    return app
