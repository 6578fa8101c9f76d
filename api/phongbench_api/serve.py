"""The server process: a socket, uvicorn, and what uvicorn lacks - a deadline for request heads, and exit code 0."""

import json
import logging
import os
import signal
import socket
import sys
from asyncio import TimerHandle, Transport
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI
from uvicorn.config import STARTUP_FAILURE
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.supervisors import Multiprocess

from phongbench.errors import InputError, PhongbenchError
from phongbench.support.user_paths import reading
from phongbench_api.app import create_app
from phongbench_api.http.cross_origin import origin
from phongbench_api.settings import Settings

log = logging.getLogger("phongbench.api")
#: how workers, which are fresh processes, learn their settings
ENVIRONMENT = "PHONGBENCH_SERVE"
#: seconds that requests under way may take once the server got its signal
GRACE = 30
#: seconds that a worker may not answer its supervisor before it counts as dead, starting on a busy machine included
HEALTHCHECK = 60


def serve(settings: Settings, app: FastAPI | None = None) -> None:
    """Serve until SIGTERM or SIGINT; then requests under way finish, and it returns.

    Raises InputError if it cannot listen, where the runs are in no folder that can be read, and for what is no origin.
    PhongbenchError where a worker cannot start: the next one could not either.
    app  what to serve by one worker instead of the usual application, as load programs do
    """
    for text in settings.cors:
        origin(text)
    if os.path.lexists(settings.runs):
        with reading(settings.runs, "folder of the runs", "give one with --runs; it may be missing as yet"):
            os.scandir(settings.runs).close()
    listening = _listen(settings)
    host, port = listening.getsockname()[:2]
    shown = f"[{host}]" if ":" in host else host
    _log_to_stderr()
    log.info("phongbench serves http://%s:%d/ from %s", shown, port, settings.runs)
    with listening:
        if settings.workers > 1:
            os.environ[ENVIRONMENT] = json.dumps(asdict(settings), default=str)
            config = _config(f"{__name__}:from_environment", settings, factory=True)
            _supervise(Multiprocess(config, sockets=[listening]))
            return
        # uvicorn raises the signal again once it is done: this is what it then meets
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: None)
        served = app or create_app(settings)
        served.state.service.give_up = partial(os._exit, 1)
        uvicorn.Server(_config(served, settings)).run(sockets=[listening])


def _supervise(workers: Multiprocess) -> None:
    """Replace workers that die, until a signal ends all; PhongbenchError once one cannot even start."""
    workers.run()
    if any(worker.exitcode == STARTUP_FAILURE for worker in workers.processes):
        raise PhongbenchError("a worker could not start", None, "its reason stands above; phongbench doctor tells more")


def from_environment() -> FastAPI:
    """The application of a worker process, by the settings of the one that started it.

    What cannot start ends with the exit code that says so: for any other the next one would be tried, without end.
    """
    _log_to_stderr()
    try:
        members: dict[str, Any] = json.loads(os.environ[ENVIRONMENT])
        members |= {"runs": Path(members["runs"])} | {name: tuple(members[name]) for name in ("allowed_hosts", "cors")}
        app = create_app(Settings(**members))
    except Exception:
        log.exception("a worker cannot start")
        sys.exit(STARTUP_FAILURE)
    app.state.service.give_up = partial(os._exit, STARTUP_FAILURE)
    return app


def _log_to_stderr() -> None:
    """The service logs to stderr; stdout belongs to data."""
    if not log.handlers:
        log.addHandler(logging.StreamHandler())
        log.setLevel(logging.INFO)


def _config(app: Any, settings: Settings, *, factory: bool = False) -> uvicorn.Config:
    return uvicorn.Config(
        app,
        factory=factory,
        workers=settings.workers,
        http=TimedProtocol,
        ws="none",
        lifespan="on",
        log_level="warning",
        access_log=False,
        server_header=False,
        proxy_headers=False,
        timeout_graceful_shutdown=GRACE,
        timeout_worker_healthcheck=HEALTHCHECK,
    )


def _listen(settings: Settings) -> socket.socket:
    """A listening socket, whose connections inherit that small answers are not held back.

    asyncio turns Nagle's algorithm off only on sockets made with a protocol number; with it, every answer on a reused
    connection waits 40 ms for the client's delayed acknowledgement.
    """
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        listening.bind((settings.host, settings.port))
        listening.listen(2048)
    except (OSError, OverflowError) as problem:
        listening.close()
        reason = getattr(problem, "strerror", None) or str(problem)
        where = f"{settings.host}:{settings.port}"
        raise InputError(f"cannot listen: {reason}", where, "give another --host or --port") from problem
    return listening


class TimedProtocol(H11Protocol):
    """uvicorn's HTTP with a deadline for every request's head: a client that sends it a byte a minute is cut off."""

    _head: TimerHandle | None = None

    def connection_made(self, transport: Transport) -> None:  # type: ignore[override]  # as uvicorn has it
        """A client connected: its first head is due."""
        super().connection_made(transport)
        self._start_deadline()

    def data_received(self, data: bytes) -> None:
        """Bytes came: of a head, which stays due, or of a request under way."""
        super().data_received(data)
        cycle: Any = self.cycle  # None before the first request, against uvicorn's annotation
        if cycle is None or cycle.response_complete:
            self._start_deadline()
        elif self._head is not None:
            self._head.cancel()
            self._head = None

    def connection_lost(self, exc: Exception | None) -> None:
        """The client disconnected."""
        if self._head is not None:
            self._head.cancel()
        super().connection_lost(exc)

    def _start_deadline(self) -> None:
        if self._head is None and not self.transport.is_closing():
            app: Any = self.config.loaded_app
            seconds = app.state.service.settings.head_seconds
            self._head = self.loop.call_later(seconds, self.transport.close)
