"""A cluster of Dask on loopback, every part of it a process that may be killed."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

Process = subprocess.Popen[bytes]
#: seconds after which what is waited for will not come
PATIENCE = 300.0
#: as the guide starts workers
LITTLE_WATCHED = {
    "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False",
    "DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL": "500ms",
}


class Processes:
    """A scheduler and its workers.

    log      what the scheduler says, where it writes it
    workers  those that were started, dead ones too
    """

    def __init__(self, folder: Path, **environment: str) -> None:
        self.folder, self.environment = folder, environment
        folder.mkdir(parents=True, exist_ok=True)
        self.log, self.workers = folder / "scheduler.log", list[Process]()
        self.scheduler = self._started("scheduler", self.log, ["--host", "127.0.0.1", "--port", "0"], {})
        self.address = self._address()

    def worker(self, *words: str, **environment: str) -> Process:
        """Start another worker of one thread, and wait until the scheduler knows it; words for `dask worker`."""
        words = words or ("--no-nanny",)
        box, before = self.folder / f"worker-{len(self.workers)}", self._registered()
        more = [self.address, "--nthreads", "1", "--local-directory", str(box), *words]
        self.workers.append(self._started("worker", self.folder / f"{box.name}.log", more, environment))
        wait_until(lambda: self._registered() > before, self.workers[-1])
        return self.workers[-1]

    def addresses(self) -> list[str]:
        """Of the workers, in the order in which they came."""
        return re.findall(r"Register worker addr: (\S+)", self.log.read_text(errors="replace"))

    def said(self) -> str:
        """What all of them wrote."""
        return "".join(file.read_text(errors="replace") for file in sorted(self.folder.glob("*.log")))

    def end(self) -> None:
        """Kill all that are left."""
        for process in (*self.workers, self.scheduler):
            kill(process)

    def _started(self, kind: str, log: Path, words: list[str], environment: dict[str, str]) -> Process:
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", "--no-dashboard", *words]
        with log.open("wb") as out:
            env = {**os.environ, **LITTLE_WATCHED, **self.environment, **environment}
            # not here: `-m` looks for packages where it is started
            return subprocess.Popen(command, env=env, cwd=self.folder, start_new_session=True, stdout=out, stderr=out)

    def _address(self) -> str:
        found: list[str] = []

        def told() -> bool:
            found[:] = re.findall(r"Scheduler at: +(tcp://127\.0\.0\.1:[0-9]+)", self.log.read_text(errors="replace"))
            return bool(found)

        wait_until(told, self.scheduler)
        return found[0]

    def _registered(self) -> int:
        return self.log.read_text(errors="replace").count("Register worker")


@contextmanager
def processes(folder: Path, workers: int = 1, **environment: str) -> Iterator[Processes]:
    """A cluster with so many workers, killed at the end; environment of all its processes."""
    made = Processes(folder, **environment)
    try:
        for _ in range(workers):
            made.worker()
        yield made
    finally:
        made.end()


def kill(process: Process) -> None:
    """SIGKILL for a process and its children."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def wait_until(state: Callable[[], bool], process: Process) -> None:
    """Wait for a state that a process brings about. RuntimeError if it ends without it, or takes very long."""
    end = time.monotonic() + PATIENCE
    while not state():
        with suppress(subprocess.TimeoutExpired):
            process.wait(0.02)
            if state():
                return
            raise RuntimeError(f"a process ended with {process.returncode}: {process.args!r}")
        if time.monotonic() > end:
            raise RuntimeError(f"waited in vain for {process.args!r}")
