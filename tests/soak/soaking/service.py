"""Random and hostile requests to a service of two workers, from clients that also stall, vanish and trickle.

Looked at are every answer, the memory and open files of each process, whether everything is free once all clients
have left, and whether a worker that is killed while it serves is replaced.
"""

import asyncio
import contextlib
import os
import random
import re
import signal
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psutil
from soaking.clients import PER_VISIT, Requests, Seen, asked, client
from soaking.disk_tries import PLAN, here

from fuzzing.requests import Sent, Source
from fuzzing.run import GROWTH
from phongbench.errors import PhongbenchError
from phongbench_api.app import create_app

WORKERS, CLIENTS = 2, 12
#: the requests are sent in so many parts; a worker is killed in the middle of one of them
PARTS, KILLED_IN = 10, 3
#: memory of a process is judged from the end of the first whole part that it lived through, if a part has so many
#: requests: kernels and tables are loaded when they are first asked for
_JUDGED_FROM = 2_000
#: seconds until all is free, or a worker is ready or replaced: a busy machine is no fault
_SETTLES = 900.0
_TOLD = 20
_CURVE = Sent("GET", "/v1/curve", "approximation=lyon&lambda=cross&gamma=8&alpha=50")
_PAIRS = Sent(
    "POST",
    "/v1/specular",
    "approximation=lyon&lambda=cross&gamma=8&alpha=50",
    (("content-type", "application/octet-stream"), ("content-length", str(2 * 2000 * 12))),
    bytes(2 * 2000 * 12),
)


@dataclass
class Found(Seen):
    """What was seen.

    memory     MiB of each process at the end of each part that it lived through, by its number
    files      that the workers hold open, before the first client and after the last
    replaced   seconds until a killed worker had a successor
    exit_code  of the service after SIGTERM; left, how many of its processes then live
    """

    memory: dict[int, list[float]] = field(default_factory=dict)
    files: list[int] = field(default_factory=list)
    replaced: list[float] = field(default_factory=list)
    exit_code: int | None = None
    left: int = 0

    def remember(self, processes: list[psutil.Process]) -> None:
        """The memory of the processes now."""
        for process in processes:
            self.memory.setdefault(process.pid, []).append(round(process.memory_info().rss / 2**20, 1))

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        told = {"requests": self.clients.total(), "statuses": dict(sorted(self.statuses.items()))}
        told |= {"clients": dict(self.clients), "memory": list(self.memory.values()), "files": self.files}
        told |= {"replaced": self.replaced, "exit_code": self.exit_code, "left": self.left}
        return told | {"faults": self.faults[:_TOLD], "fault_count": len(self.faults)}

    def missed(self) -> Iterator[str]:
        """The bars that were missed, in words."""
        for first, *later in (seen[1:] for seen in self.memory.values() if len(seen) > 2):
            if self.clients.total() >= PARTS * _JUDGED_FROM and later[-1] > first * (1 + GROWTH):
                yield f"a process grew from {first} to {later[-1]} MiB"
        if self.files[-1] > self.files[0]:
            yield f"the workers held {self.files[0]} files open, and hold {self.files[-1]} afterwards"
        yield from ("a worker that was killed was not replaced" for took in self.replaced if took == float("inf"))
        if self.exit_code != 0:
            yield f"exit code {self.exit_code} after SIGTERM"
        if self.left:
            yield f"{self.left} processes outlive the service"


class Service:
    """`phongbench serve --workers 2` on a free port, over a folder with one small run."""

    def __init__(self, folder: Path) -> None:
        (folder / "plan.toml").write_text(PLAN)
        here(
            [
                "run",
                str(folder / "plan.toml"),
                "--no-report",
                "--out",
                str(folder / "runs" / "20260101-000000-0123abcd"),
            ]
        )
        self.log = folder / "log"
        words = [
            sys.executable,
            "-m",
            "phongbench",
            "serve",
            "--port",
            "0",
            "--workers",
            str(WORKERS),
            "--runs",
            "runs",
        ]
        with self.log.open("wb") as log:  # a pipe that nobody reads would stop it
            self.process = subprocess.Popen(words, cwd=folder, stdout=subprocess.DEVNULL, stderr=log)
        self.port = 0
        self._known: dict[int, psutil.Process] = {}

    def started(self) -> None:
        """Wait until it has its workers, and each of them has said that it is ready."""
        self.port = int(self._awaited(lambda: re.search(r"http://127\.0\.0\.1:(\d+)/", self.log.read_text()))[1])
        self._awaited(lambda: self.log.read_text().count("ready: ") == WORKERS)

    def workers(self) -> list[psutil.Process]:
        """Its worker processes."""
        alive = psutil.Process(self.process.pid).children()
        found = [one for one in alive if "spawn_main" in " ".join(_words(one))]
        self._known |= {one.pid: one for one in found}
        return found

    def processes(self) -> list[psutil.Process]:
        """All of its processes that serve or watch."""
        return [psutil.Process(self.process.pid), *self.workers()]

    def files(self) -> int:
        """How many files and connections the workers hold, but for those of packages, such as fonts."""
        return sum(
            worker.num_fds() - sum(file.path.startswith(sys.prefix) for file in worker.open_files())
            for worker in self.workers()
        )

    def kill_one(self) -> float:
        """Kill a worker; seconds until there is another one, ready, or infinity."""
        victim, began, ready = self.workers()[0], time.monotonic(), self.log.read_text().count("ready: ")
        os.kill(victim.pid, signal.SIGKILL)
        with contextlib.suppress(PhongbenchError):
            self._awaited(lambda: self.log.read_text().count("ready: ") > ready and len(self.workers()) == WORKERS)
            return round(time.monotonic() - began, 1)
        return float("inf")

    def stop(self, found: Found) -> None:
        """SIGTERM; its exit code, and what outlives it."""
        workers = self.workers()
        self.process.terminate()
        found.exit_code = self.process.wait(_SETTLES)
        found.left = sum(worker.is_running() and worker.status() != psutil.STATUS_ZOMBIE for worker in workers)

    def kill(self) -> None:
        """End what is left of it."""
        self.process.kill()
        self.process.wait()
        for one in self._known.values():
            with contextlib.suppress(psutil.NoSuchProcess):
                one.kill()

    def _awaited(self, asked: Callable[[], Any]) -> Any:
        end = time.monotonic() + _SETTLES
        while time.monotonic() < end and self.process.poll() is None:
            if answer := asked():
                return answer
            time.sleep(0.1)
        ended = "" if self.process.poll() is None else f"ended with exit code {self.process.poll()}, "
        what = f"{ended}did not happen within {_SETTLES:g} s: {self.log.read_text()[-2000:]}"
        raise PhongbenchError(what, "phongbench serve")


def _words(process: psutil.Process) -> list[str]:
    try:
        return process.cmdline()
    except psutil.Error:
        return []


def soak(count: int, minutes: float, seed: int, folder: Path, say: Callable[[str], None]) -> Found:
    """Send about so many requests, and begin none after so many minutes; kill a worker meanwhile.

    The service ends with it, whatever ends it.
    """
    service = Service(folder)
    try:
        service.started()
        return asyncio.run(_soak(service, count, time.monotonic() + 60 * minutes, seed, say))
    finally:
        service.kill()


async def _soak(service: Service, count: int, end: float, seed: int, say: Callable[[str], None]) -> Found:
    found, draw = Found(files=[service.files()]), random.Random(seed)
    requests = Requests(Source(create_app().openapi(), seed), draw)
    visits = max(PARTS, count // PER_VISIT)
    for part in range(PARTS):
        left = _while(visits * (part + 1) // PARTS - visits * part // PARTS, end)
        async with asyncio.TaskGroup() as group, _killing(service, found, part == KILLED_IN):
            for _ in range(CLIENTS):
                group.create_task(client(service.port, requests, left, found))
        found.remember(service.processes())
        held = [seen[-1] for seen in found.memory.values()]
        say(f"{found.clients.total()} requests, {len(found.faults)} faults, MiB {held}")
    alive = {process.pid for process in service.processes()}
    found.memory = {pid: seen for pid, seen in found.memory.items() if pid in alive}
    await _settled(service, found)
    await asyncio.to_thread(service.stop, found)
    found.faults += found.missed()
    return found


@contextlib.asynccontextmanager
async def _killing(service: Service, found: Found, really: bool) -> AsyncIterator[None]:
    """Kill a worker while clients are at it, whose clients may then be cut off; wait for its successor."""
    yield
    if really:
        found.cut_off = True
        found.replaced.append(await asyncio.to_thread(service.kill_one))
        found.cut_off = False


def _while(count: int, end: float) -> Iterator[int]:
    """So many numbers, and none after a time; clients share them."""
    for number in range(count):
        if time.monotonic() > end:
            return
        yield number


async def _settled(service: Service, found: Found) -> None:
    """Wait until no client is held; then computations with and without a body must all be done."""
    end = time.monotonic() + _SETTLES
    while service.files() > found.files[0] and time.monotonic() < end:
        await asyncio.sleep(0.2)
    found.files.append(service.files())
    for sent in (_CURVE, _PAIRS) * CLIENTS:
        if (status := (await asked(service.port, sent))[0]) != 200:
            found.faults.append(f"afterwards a computation is answered by {status}")
