"""Kills on a cluster, at random moments of a sweep: of workers, of clients, of schedulers. The rows stay.

A run whose worker is killed has to end as if nothing had happened. One whose client is killed, or whose scheduler is,
has to go on by `run --resume` on a cluster. Afterwards its tables are those of one machine, byte for byte.
"""

import json
import random
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from soaking.dask_processes import Process, Processes, kill, wait_until

from phongbench.errors import PhongbenchError
from phongbench.results import runs

#: the plan: a sweep of some seconds, hardly anything else
PLAN = """alphas = [10]
gammas = [8]
approximations = ["phong", "lyon"]
slopes = ["taylor"]
spaces = ["reflect"]
lambda_forms = ["dot"]
precisions = ["float32"]
samples = 200000
probes = ["hostile"]
timing = false
"""
#: who is killed
VICTIMS = ("worker", "client", "scheduler")
#: exit codes of a run whose cluster is lost, and of one whose cluster was so before it could be reached
LOST, ABSENT = 3, 2
#: exit codes that the run may have which was hit
ALLOWED = {"worker": (0,), "client": (0, -9), "scheduler": (0, LOST, ABSENT)}
_WORKERS, _TOLD = 2, 20


@dataclass
class Kills:
    """What came of killing one kind of victim.

    sweeping  of the kills, those that came while the sweep went on
    ends      how the run that was hit ended: done, lost or absent (it said so of its cluster), killed
    kept      rows of its sweep that a run went on from, over all tries
    faults    in words
    """

    sweeping: int = 0
    ends: Counter[str] = field(default_factory=Counter)
    kept: int = 0
    faults: list[str] = field(default_factory=list)

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        counted = {"tries": self.ends.total(), "while sweeping": self.sweeping, "kept rows": self.kept}
        return counted | {"ends": dict(sorted(self.ends.items())), "faults": self.faults[:_TOLD]}


class Arena:
    """A cluster, the plan, and the tables that it gives on one machine.

    seconds  that a run takes from the moment its folder is there to the end of its sweep
    """

    def __init__(self, box: Path) -> None:
        self.box, self.folder, self.plan = box, box / "run", box / "plan.toml"
        self.plan.write_text(PLAN)
        self.clusters = 0
        self.cluster = self._new()
        _ended(self._client(box / "alone", alone=True))
        self.tables = runs.load(box / "alone").manifest["files"]
        client = self._begun()
        began = time.monotonic()
        wait_until(self._swept, client)
        self.seconds = time.monotonic() - began
        _ended(client)
        if wrong := list(self.wrong()):
            raise RuntimeError(f"nobody was killed, yet {'; '.join(wrong)}")

    def tried(self, victim: str, moment: float, rng: random.Random, found: Kills) -> None:
        """One try: a run, a kill after a share of its time, and what it takes to bring the run to its end."""
        shutil.rmtree(self.folder, ignore_errors=True)
        client = self._begun()
        with suppress(subprocess.TimeoutExpired):
            client.wait(moment * self.seconds)
        found.sweeping += not self._swept()
        workers = [worker for worker in self.cluster.workers if worker.poll() is None]
        kill({"worker": rng.choice(workers), "client": client, "scheduler": self.cluster.scheduler}[victim])
        code, said = _ended(client)
        if (
            "Traceback" in said
            or code not in {"worker": (0,), "client": (0, -9), "scheduler": (0, LOST, ABSENT)}[victim]
        ):
            found.faults.append(f"{victim}, {moment:.2f}: exit {code}, {said[-600:]}")
        found.ends[{0: "done", LOST: "lost", ABSENT: "absent", -9: "killed"}.get(code, f"exit {code}")] += 1
        self._heal()
        if code:
            kept = (len(frame) for frame in _parts(self.folder))
            found.kept += sum(kept)
            code, said = _ended(self._client(self.folder, "--resume"))
            if code:
                found.faults.append(f"{victim}, {moment:.2f}: does not go on: exit {code}, {said[-600:]}")
        found.faults += [f"{victim}, {moment:.2f}: {text}" for text in self.wrong()]

    def wrong(self) -> Iterator[str]:
        """In what the run differs from that of one machine."""
        try:
            run = runs.load(self.folder)
            yield from runs.verify(run)
        except PhongbenchError as problem:
            yield f"the folder is no run: {problem}"
            return
        for name, facts in self.tables.items():
            if run.manifest["files"].get(name) != facts:
                yield f"{name} has other rows"

    def _swept(self) -> bool:
        return "accuracy.parquet" in runs.load(self.folder).manifest["files"]

    def _new(self) -> Processes:
        self.clusters += 1
        made = Processes(self.box / f"cluster-{self.clusters}")
        for _ in range(_WORKERS):
            made.worker()
        return made

    def _heal(self) -> None:
        """Replace what is dead."""
        if self.cluster.scheduler.poll() is not None:
            self.cluster.end()
            self.cluster = self._new()
        while sum(worker.poll() is None for worker in self.cluster.workers) < _WORKERS:
            self.cluster.worker()

    def _client(self, out: Path, *more: str, alone: bool = False) -> Process:
        words = ["run", str(self.plan), "--no-report", "--jobs", "1", "--out", str(out), *more]
        words += [] if alone else ["--cluster", self.cluster.address]
        command, log = [sys.executable, "-m", "phongbench", *words], subprocess.STDOUT
        return subprocess.Popen(command, start_new_session=True, stdout=subprocess.PIPE, stderr=log)

    def _begun(self) -> Process:
        client = self._client(self.folder)
        wait_until((self.folder / runs.MANIFEST).exists, client)
        return client


def _ended(client: Process) -> tuple[int, str]:
    """The exit code of a client, and what it said."""
    said, _ = client.communicate()
    return client.returncode, said.decode(errors="replace")


def _parts(folder: Path) -> list[Any]:
    from phongbench.results.checkpoints import read_parts

    return read_parts(folder)


def random_kills(
    box: Path, counts: dict[str, int], minutes: float, seed: int, say: Callable[[str], None]
) -> dict[str, Kills]:
    """So many kills of each victim, at random moments, in random order, none begun after so many minutes."""
    rng, found, arena = random.Random(seed), {victim: Kills() for victim in VICTIMS}, Arena(box)
    end = time.monotonic() + 60 * minutes
    try:
        victims = [victim for victim, count in counts.items() for _ in range(count)]
        rng.shuffle(victims)
        for number, victim in enumerate(victims, 1):
            if time.monotonic() > end:
                break
            say(f"{number} of {len(victims)}: a {victim}")
            arena.tried(victim, rng.uniform(0.0, 1.0), rng, found[victim])
            say("; ".join(f"{name}: {json.dumps(one.as_dict())}" for name, one in found.items()))
    finally:
        arena.cluster.end()
    return found
