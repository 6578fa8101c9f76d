"""What the routes of one server share: its settings, runs, kernels and cores."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from starlette.requests import Request

from phongbench_api.columns import Columns
from phongbench_api.kept import Answers
from phongbench_api.settings import Settings
from phongbench_api.store import Store
from phongbench_api.warm import Kernels
from phongbench_api.work import Office


@dataclass
class Service:
    """One server's state. `warm` turns true once its kernels are compiled."""

    settings: Settings
    warm: bool = False
    kernels: Kernels = field(default_factory=Kernels)
    answers: Answers = field(default_factory=Answers)

    @cached_property
    def store(self) -> Store:
        """The runs."""
        return Store(self.settings.runs)

    @cached_property
    def columns(self) -> Columns:
        """Columns of stored tables, kept in memory."""
        return Columns(self.settings.table_bytes)

    @cached_property
    def office(self) -> Office:
        """The cores."""
        return Office(self.settings)


def service(request: Request) -> Service:
    """The state of the server that got this request."""
    found: Any = request.app.state.service
    assert isinstance(found, Service)
    return found
