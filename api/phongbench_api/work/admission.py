"""Who may use a core, and when: work is admitted by its predicted cost, done at once or in a thread, and dropped when
its client is gone.

A running thread cannot be killed, so what would take too long is refused before it starts. Health never passes here.
"""

import asyncio
import math
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import TypeVar

import anyio
import anyio.to_thread
from starlette.requests import Request

from phongbench_api.http.media import Spans
from phongbench_api.http.problems import BusyError, Cancelled, TooLargeError
from phongbench_api.settings import Settings

T = TypeVar("T")
R = TypeVar("R")
#: what work gets: a function that says whether to stop, to be called now and then
Cancelling = Callable[[], bool]


class Admission:
    """Admits work by its predicted cost, and does it.

    pending   predicted seconds of core time that are admitted and not done
    reading   bytes of bodies that are on their way in
    open      kernels are warm, so predictions mean something
    draining  the server goes down: what is here is done, nothing new is begun
    """

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.pending, self.reading, self.open, self.draining = 0.0, 0, False, False
        self._jobs = 0
        self._limiter = anyio.CapacityLimiter(settings.cores)

    @property
    def wait(self) -> float:
        """Predicted seconds until a core is free for new work."""
        return self.pending / self.settings.cores if self._jobs >= self.settings.cores else 0.0

    def check(self) -> None:
        """BusyError while there is more to do than may be waited for; called before a body is read."""
        if self.draining:
            raise BusyError("the server is going down", headers={"retry-after": "5"})
        if not self.open:
            raise BusyError("the kernels are not warm yet", headers={"retry-after": "5"})
        if self.wait > self.settings.max_wait:
            seconds = max(1, math.ceil(self.wait))
            what = f"every core is taken for about {self.wait:.1f} s"
            raise BusyError(what, fix=f"come back in {seconds} s", headers={"retry-after": str(seconds)})

    @asynccontextmanager
    async def receiving(self, size: int) -> AsyncIterator[None]:
        """While a body of this many bytes comes in: BusyError if too many do already."""
        if self.reading and self.reading + size > self.settings.max_reading:
            raise BusyError("too many bodies are on their way in", headers={"retry-after": "1"})
        self.reading += size
        try:
            yield
        finally:
            self.reading -= size

    async def run(
        self,
        request: Request,
        cost: float,
        work: Callable[[Cancelling], T],
        encode: Callable[[T, Spans], R],
        spans: Spans,
    ) -> R:
        """What `encode` makes of the work's result, by one core that is predicted to take `cost` seconds.

        TooLargeError where that is more than one request may take, BusyError where the wait would be too long;
        Cancelled once the client is gone.
        """
        if cost <= self.settings.inline_cost:
            return _encoded(work, encode, spans, lambda: False)
        if cost > self.settings.max_cost:
            what = f"this would take about {cost:.1f} s; a request may take {self.settings.max_cost:g} s"
            raise TooLargeError(what, fix="ask for less")
        self.check()
        self.pending, self._jobs = self.pending + cost, self._jobs + 1
        try:
            return await self._in_thread(request, work, encode, spans)
        finally:
            self.pending, self._jobs = self.pending - cost, self._jobs - 1

    async def _in_thread(
        self, request: Request, work: Callable[[Cancelling], T], encode: Callable[[T, Spans], R], spans: Spans
    ) -> R:
        cancelled = threading.Event()

        def start() -> R:
            spans.mark("queue")
            return _encoded(work, encode, spans, cancelled.is_set)

        with anyio.CancelScope() as scope:
            watcher = asyncio.create_task(_watch(request, cancelled, scope))
            try:
                return await anyio.to_thread.run_sync(start, limiter=self._limiter)
            finally:
                watcher.cancel()
        raise Cancelled


def _encoded(
    work: Callable[[Cancelling], T], encode: Callable[[T, Spans], R], spans: Spans, cancelled: Cancelling
) -> R:
    result = work(cancelled)
    spans.mark("kernel")
    return encode(result, spans)


async def _watch(request: Request, cancelled: threading.Event, scope: anyio.CancelScope) -> None:
    """Wait for the client to leave; work that waits is dropped at once, work that runs stops at its next look."""
    while (await request.receive())["type"] != "http.disconnect":
        pass
    cancelled.set()
    scope.cancel()
