"""What the routes of one server share: its settings, runs, kernels and cores."""

import gc
import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from starlette.requests import Request

from phongbench_api.runs.answer_cache import AnswerCache
from phongbench_api.runs.run_store import RunStore
from phongbench_api.runs.table_cache import TableCache
from phongbench_api.settings import Settings
from phongbench_api.work.admission import Admission
from phongbench_api.work.warm_kernels import Kernels

log = logging.getLogger("phongbench.api")


@dataclass
class Service:
    """One server's state.

    warm     set once its kernels are compiled
    give_up  what ends its process where they cannot be; None: it has none of its own
    """

    settings: Settings
    warm: threading.Event = field(default_factory=threading.Event)
    kernels: Kernels = field(default_factory=Kernels)
    answers: AnswerCache = field(default_factory=AnswerCache)
    give_up: Callable[[], object] | None = None

    def warm_up(self) -> None:
        """Compile and time the kernels; stops between two of them once the server goes down.

        What lives by then lives as long as the server, so the garbage collector need not look at it again: a full
        collection of it stops every thread, health included, for some 100 ms.
        """
        started = time.perf_counter()
        if self.kernels.warm(lambda: self.admission.draining):
            gc.collect()
            gc.freeze()
            self.admission.open = True
            self.warm.set()
            log.info("ready: kernels warm after %.1f s", time.perf_counter() - started)

    def cool_down(self) -> None:
        """Give back to the garbage collector what `warm_up` took from it."""
        gc.unfreeze()

    @cached_property
    def store(self) -> RunStore:
        """The runs."""
        return RunStore(self.settings.runs)

    @cached_property
    def tables(self) -> TableCache:
        """Columns of stored tables in memory."""
        return TableCache(self.settings.table_bytes)

    @cached_property
    def admission(self) -> Admission:
        """Who may use the cores."""
        return Admission(self.settings)


def service(request: Request) -> Service:
    """The state of the server that got this request."""
    state: Any = request.app.state.service
    assert isinstance(state, Service)
    return state
