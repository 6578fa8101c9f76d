"""Hands the shards of a sweep to the workers of a cluster, and takes what they measured.

A few shards for each thread are on their way at a time, and each is released when it is gathered, so the memory of
scheduler and client does not grow with their number. Some are measured again by another worker and compared, bit for
bit. What is gathered lies in the run's folder: a study that dies is resumed from there.
"""

import random
import re
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from phongbench.accuracy.sweep import Measured, Sweep, slabs
from phongbench.errors import InputError, MeasurementError
from phongbench.results.arithmetic import arithmetic
from phongbench.study import shards
from phongbench.study.cluster.worker import Job, Tally, measure
from phongbench.study.shards import Block
from phongbench.support.process import cores

#: shards for each thread of the cluster, in all and on their way at a time
EACH, AHEAD = 8, 2
#: the share of shards that another worker measures again
AGAIN = 0.01
#: how often a shard may fail, and how many seconds the work waits for a first worker or a new one
TRIES, PATIENCE = 3, 60.0
#: what to do when a cluster is lost
_RESUME = "what is done is kept: go on with --resume, there or without --cluster"


class Cluster:
    """Measures a sweep on a cluster; called as `sweep.run` is.

    address  of a scheduler, tcp://host:8786; a scheduler's file; or local:N for N worker processes here
    files    the user's own files, which are sent along
    facts    after the sweep: shards, workers that measured, shards compared
    """

    def __init__(self, address: str, files: Sequence[Path] = ()) -> None:
        self.address = _checked(address)
        self.files = tuple((file.name, file.read_text(encoding="utf-8")) for file in files)
        self.facts: dict[str, int] = {}

    def __call__(
        self, sweep: Sweep, *, jobs: int, done: Collection[int], progress: Callable[[float], None]
    ) -> Iterator[Measured | pd.DataFrame]:
        """The batches that are not done: parts of whole ones, and those that shards share when they are complete."""
        batches = [batch for batch in sweep.batches if batch.index not in done]
        if not batches:
            return
        failures = tuple(sorted(sweep.failures.items()))
        job = Job(sweep.plan, failures, self.files, tuple(arithmetic().items()))
        with _client(self.address, jobs) as client:
            threads = _threads(client)
            count = min(EACH * threads, sum(len(slabs(batch)) for batch in batches))
            work = _Work(client, job, shards.cut(batches, count), AHEAD * threads, progress)
            shared: dict[int, dict[int, Measured]] = {}
            for tally in work.tallies():
                if tally.part is not None:
                    yield tally.part
                for start, block in tally.blocks:
                    shared.setdefault(block.batch.index, {})[start] = block
                    if len(shared[block.batch.index]) == len(slabs(block.batch)):
                        yield _joined(shared.pop(block.batch.index))
            self.facts = {"shards": count, "workers": len(work.workers), "compared": work.compared}
            work.raise_failures()


def _joined(blocks: dict[int, Measured]) -> Measured:
    """A batch of its blocks, in the order of the slabs; the blocks stay as they are, since they may be compared."""
    first, *later = (blocks[start] for start in sorted(blocks))
    first = replace(first, errors=deepcopy(first.errors))
    for block in later:
        first.errors.merge(block.errors)
    return first


class _Work:
    """The shards of a sweep: those that wait, those on their way, and those that failed for good."""

    def __init__(
        self, client: Any, job: Job, pieces: list[list[Block]], ahead: int, progress: Callable[[float], None]
    ) -> None:
        self.client, self.pieces, self.ahead, self.progress = client, pieces, ahead, progress
        self.job = client.scatter(job, broadcast=False, hash=False)
        self.flying: dict[Any, tuple[int, Tally | None]] = {}
        self.others: dict[Any, list[str]] = {}
        self.workers: set[str] = set()
        self.failed: dict[int, str] = {}
        self.compared = 0
        chance = random.Random(job.plan.seed)
        self.again = {index for index in range(len(pieces)) if chance.random() < AGAIN} | {0}

    def tallies(self) -> Iterator[Tally]:
        """What the shards gave, as they are done."""
        from distributed import wait

        waiting, seen = list(range(len(self.pieces)))[::-1], time.monotonic()
        while waiting or self.flying:
            while waiting and len(self.flying) < self.ahead:
                self._submit(waiting.pop())
            try:
                with self.client.as_current():
                    ended = wait(list(self.flying), timeout=1.0, return_when="FIRST_COMPLETED").done
            except TimeoutError:
                ended = set()
            except Exception as problem:
                raise self._lost(str(problem) or type(problem).__name__) from problem
            self.progress(0.0)  # where an interruption is noticed
            seen = self._watched(seen)
            for future in ended:
                tally = self._gathered(future)
                if tally is not None:
                    yield tally

    def _submit(self, index: int, before: Tally | None = None) -> None:
        """Send a shard out; one that was measured before goes to another worker."""
        blocks = [(batch.index, start) for batch, start in self.pieces[index]]
        more: dict[str, Any] = {"retries": TRIES - 1, "pure": False}
        if before:
            more["workers"] = [name for name in self.client.scheduler_info(-1)["workers"] if name != before.worker]
        future = self.client.submit(measure, self.job, blocks, **more)
        self.flying[future], self.others[future] = (index, before), more.get("workers", [])

    def _gathered(self, future: Any) -> Tally | None:
        """What a shard gave that has not been there before; failures are noted."""
        index, before = self.flying.pop(future)
        del self.others[future]
        if future.status in ("cancelled", "lost"):
            raise self._lost("the scheduler forgot its work")
        try:
            tally: Tally = future.result(timeout=PATIENCE)
        except Exception as problem:
            if self.client.status != "running":
                raise self._lost(str(problem)) from problem
            if before is None:
                self.failed[index] = f"{type(problem).__name__}: {problem}"
            return None
        finally:
            future.release()
        if tally.refused:
            what = f"the worker would not give this machine's bits: {tally.refused}"
            raise InputError(what, tally.worker, "install the same there, or start all with one --cpu-name")
        self.workers.add(tally.worker)
        if before is not None:
            self._compare(index, before, tally)
            return None
        if index in self.again and len(self.client.scheduler_info(-1)["workers"]) > 1:
            self._submit(index, tally)
        self.progress(float(shards.evaluations(self.pieces[index])))
        return tally

    def _compare(self, index: int, before: Tally, tally: Tally) -> None:
        self.compared += 1
        if not tally.same(before):
            what = f"shard {index + 1} of {len(self.pieces)} has other bits on {before.worker}"
            raise MeasurementError(what, tally.worker, "one of the two computes wrongly: use --fresh without it")

    def _watched(self, seen: float) -> float:
        """When a worker was last there. Raises where the scheduler is gone, or no worker has come for long."""
        if self.client.status != "running":
            raise self._lost("the connection to the scheduler is lost")
        now = time.monotonic()
        if present := self.client.scheduler_info(-1)["workers"].keys():
            for future in [one for one, names in self.others.items() if names and not present & set(names)]:
                index, before = self.flying.pop(future)
                del self.others[future]
                future.release()  # who should have compared is gone: another does, or nobody
                if before and present - {before.worker}:
                    self._submit(index, before)
            return now
        if now - seen > PATIENCE:
            raise self._lost(f"there was no worker for {PATIENCE:.0f} seconds")
        return seen

    def _lost(self, what: str) -> MeasurementError:
        return MeasurementError(f"the cluster is lost: {what}", "--cluster", _RESUME)

    def raise_failures(self) -> None:
        """MeasurementError if a shard failed as often as it may."""
        if self.failed:
            index, message = next(iter(self.failed.items()))
            what = f"{len(self.failed)} of {len(self.pieces)} shards failed {TRIES} times; shard {index + 1}: {message}"
            raise MeasurementError(what, "--cluster", _RESUME)


def _checked(address: str) -> str:
    """The address, if it may be one. InputError, also where Dask is not installed."""
    from importlib.util import find_spec

    if find_spec("distributed") is None:
        raise InputError("Dask is not installed", "--cluster", "pip install 'phongbench[cluster]'")
    known = re.fullmatch(r"local:[1-9][0-9]{0,3}|(tcp|tls|ws|wss|ucx)://\S+|(?!local:)[\w.-]+:[0-9]+", address)
    if not known and not Path(address).is_file():
        fix = "give tcp://host:8786, the file of `dask scheduler --scheduler-file`, or local:4"
        raise InputError(f"{address!r} is no cluster", "--cluster", fix)
    return address


@contextmanager
def _client(address: str, jobs: int) -> Iterator[Any]:
    """A client of the cluster; worker processes of our own end with it."""
    import logging

    import dask
    from distributed import Client, LocalCluster

    for name in ("distributed", "distributed.client"):  # what matters is told by our own errors
        logging.getLogger(name).setLevel(logging.CRITICAL)
    dask.config.set({"distributed.comm.timeouts.connect": "10s"})
    if address.startswith("local:"):
        count = int(address.removeprefix("local:"))
        each = max(1, min(jobs, cores()) // count)
        with (
            LocalCluster(
                n_workers=count, threads_per_worker=each, dashboard_address=None, silence_logs=logging.CRITICAL
            ) as local,
            Client(local, set_as_default=False) as client,
        ):
            yield client
        return
    where: dict[str, Any] = {"scheduler_file": address} if Path(address).is_file() else {"address": address}
    try:
        client = Client(**where, set_as_default=False, timeout="10s")
    except (OSError, ValueError, TimeoutError) as problem:
        raise InputError(f"no scheduler answers: {problem}", address, "start one: dask scheduler") from problem
    with client:
        yield client


def _threads(client: Any) -> int:
    """Threads of all workers, once there is one. MeasurementError if none comes."""
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError as problem:
        what = f"no worker came within {PATIENCE:.0f} seconds"
        raise MeasurementError(what, "--cluster", "start some: dask worker ADDRESS") from problem
    return max(1, sum(int(worker["nthreads"]) for worker in client.scheduler_info(-1)["workers"].values()))
