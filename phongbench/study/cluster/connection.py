"""The way to a cluster: its address, a client, and which workers are there."""

import re
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from phongbench.errors import InputError, MeasurementError
from phongbench.support.process import cores
from phongbench.support.progress import Progress

#: how many seconds work waits for a first worker or a new one, and for how many an answer about them holds
PATIENCE, LOOK = 60.0, 1.0
#: Dask looks at the stacks of its workers every 10 ms, and at its own pace every 20: it costs them 2 % of a core each
#: that does nothing else, and nobody here asks for it
QUIET = {"distributed.worker.profile.enabled": False, "distributed.admin.tick.interval": "500ms"}


class Connection:
    """A client of a cluster, and what was last known of its workers.

    workers    address of each -> its threads
    dashboard  where a browser sees the cluster; None without one
    fix        what a user can do when the cluster is lost
    """

    def __init__(self, client: Any, fix: str, progress: Progress) -> None:
        self.client, self.fix, self._progress = client, fix, progress
        self.workers: dict[str, int] = {}
        self.dashboard: str | None = None
        self._looked, self._absent = 0.0, None  # type: tuple[float, float | None]
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError as problem:
            what = f"no worker came within {PATIENCE:.0f} seconds"
            raise MeasurementError(what, "--cluster", "start some: dask worker ADDRESS") from problem
        except OSError as problem:
            raise self.lost() from problem
        with suppress(KeyError):
            self.dashboard = client.dashboard_link or None
        self._ask()
        at = f"; dashboard {self.dashboard}" if self.dashboard else ""
        progress.note(f"cluster: {counted(len(self.workers), 'worker')}, {counted(self.threads, 'thread')}{at}")

    @property
    def threads(self) -> int:
        """Of all workers, at least one."""
        return max(1, sum(self.workers.values()))

    def look(self) -> None:
        """Ask who is there, unless that was just done; who has come and who has gone is noted.

        Raises MeasurementError where the scheduler is gone, or where no worker has come for long.
        """
        if self.client.status != "running":
            raise self.lost()
        now = time.monotonic()
        if now - self._looked < LOOK:
            return
        before = self.workers
        self._ask()
        if self.workers.keys() != before.keys():
            told = [f"{name} is gone" for name in before.keys() - self.workers.keys()]
            told += [f"{name} has come" for name in self.workers.keys() - before.keys()]
            self._progress.note(f"cluster: {', '.join(sorted(told))}; {counted(len(self.workers), 'worker')}")
        if self.workers:
            self._absent = None
        elif self._absent is None:
            self._absent = now
        elif now - self._absent > PATIENCE:
            raise self.lost(f"there was no worker for {PATIENCE:.0f} seconds, and their own words tell why")

    def _ask(self) -> None:
        told = self.client.scheduler_info(-1)["workers"]
        self.workers = {name: int(worker["nthreads"]) for name, worker in told.items()}
        self._looked = time.monotonic()

    def lost(self, what: str = "its scheduler is gone") -> MeasurementError:
        """The error that the cluster is lost."""
        return MeasurementError(f"the cluster is lost: {what}", "--cluster", self.fix)


def counted(number: int, noun: str) -> str:
    """So many of them: 1 worker, 2 workers."""
    return f"{number} {noun}{'s' * (number != 1)}"


def checked(address: str) -> str:
    """The address, if it may be one: tcp://host:8786, a scheduler's file, or local:N for N worker processes here.

    Raises InputError, also where Dask is not installed.
    """
    from importlib.util import find_spec

    if find_spec("distributed") is None:
        raise InputError("Dask is not installed", "--cluster", "pip install 'phongbench[cluster]'")
    known = re.fullmatch(r"local:[1-9][0-9]{0,3}|(tcp|tls|ws|wss|ucx)://\S+|(?!local:)[\w.-]+:[0-9]+", address)
    if not known and not Path(address).is_file():
        fix = "give tcp://host:8786, the file of `dask scheduler --scheduler-file`, or local:4"
        raise InputError(f"{address!r} is no cluster", "--cluster", fix)
    return address


@contextmanager
def connected(address: str, jobs: int, *, fix: str, progress: Progress) -> Iterator[Connection]:
    """A connection with a worker at least; worker processes of our own end with it.

    jobs  threads of them all
    fix   what a user can do when the cluster is lost
    """
    quieten()
    opened = _own(address, jobs) if address.startswith("local:") else _remote(address)
    with opened as client:
        yield Connection(client, fix, progress)


def quieten() -> None:
    """Have Dask say nothing beside our own errors, which tell what matters, and watch its workers little."""
    import logging

    import dask
    import distributed  # noqa: F401  sets levels of its own, which ours have to follow

    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    dask.config.set({"distributed.comm.timeouts.connect": "10s"} | QUIET)


@contextmanager
def _own(address: str, jobs: int) -> Iterator[Any]:
    import logging

    from distributed import Client, LocalCluster

    count = int(address.removeprefix("local:"))
    threads = max(1, min(jobs, cores()) // count)
    quiet: dict[str, Any] = {"dashboard_address": "127.0.0.1:0", "silence_logs": logging.CRITICAL}
    with (
        LocalCluster(n_workers=count, threads_per_worker=threads, **quiet) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        yield client


@contextmanager
def _remote(address: str) -> Iterator[Any]:
    from distributed import Client

    where: dict[str, Any] = {"scheduler_file": address} if Path(address).is_file() else {"address": address}
    try:
        client = Client(**where, set_as_default=False, timeout="10s")
    except (OSError, ValueError, TimeoutError) as problem:
        raise InputError(f"no scheduler answers: {problem}", address, "start one: dask scheduler") from problem
    with client:
        yield client
