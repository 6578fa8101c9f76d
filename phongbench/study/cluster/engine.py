"""The sweep on a cluster: its shards go to workers, what they measured comes back in any order.

What is gathered lies in the run's folder: a study that dies is resumed from there.
"""

import time
from collections.abc import Collection, Iterator, Sequence
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import pandas as pd

from phongbench.accuracy.sweep import Measured, Sweep, slabs
from phongbench.results.arithmetic import arithmetic
from phongbench.study import shards
from phongbench.study.cluster.connection import checked, connected, counted
from phongbench.study.cluster.work import Work
from phongbench.study.cluster.worker import Job, measure, texts_of
from phongbench.support.progress import Progress

#: what to do when a cluster is lost
_RESUME = "what is done is kept: go on with --resume, there or without --cluster"


class Cluster:
    """Measures a sweep on a cluster.

    address  of a scheduler, tcp://host:8786; a scheduler's file; or local:N for N worker processes here
    files    the user's own files, which are sent along
    facts    after the sweep: shards, workers that measured, shards compared
    Raises InputError for what is no address, and where Dask is not installed.
    """

    def __init__(self, address: str, files: Sequence[Path] = ()) -> None:
        self.address = checked(address)
        self.files = texts_of(files)
        self.facts: dict[str, int] = {}

    def __call__(
        self, sweep: Sweep, progress: Progress, *, jobs: int, done: Collection[int]
    ) -> Iterator[Measured | pd.DataFrame]:
        """The batches that are not done: parts of whole ones, and those that shards share when they are complete."""
        batches = [batch for batch in sweep.batches if batch.index not in done]
        if not batches:
            return
        failures = tuple(sorted(sweep.failures.items()))
        job = Job(sweep.plan, failures, self.files, tuple(arithmetic().items()))
        with connected(self.address, jobs, fix=_RESUME, progress=progress) as connection:
            pieces = shards.cut(batches, shards.number(batches, connection.threads))
            sent = [[(batch.index, start) for batch, start in piece] for piece in pieces]
            work = Work(connection, measure, job, sent, seed=sweep.plan.seed, progress=progress)
            shared: dict[int, dict[int, Measured]] = {}
            started = time.perf_counter()
            for index, tally in work.answers():
                progress.advance(float(shards.evaluations(pieces[index])))
                if tally.part is not None:
                    yield tally.part
                for start, block in tally.blocks:
                    shared.setdefault(block.batch.index, {})[start] = block
                    if len(shared[block.batch.index]) == len(slabs(block.batch)):
                        yield _joined(shared.pop(block.batch.index))
            self.facts = {"shards": len(pieces), "workers": len(work.workers), "compared": work.compared}
            work.raise_failures()
            rate = sum(batch.evaluations for batch in batches) / (time.perf_counter() - started)
            done_by = f"{counted(len(pieces), 'shard')} by {counted(len(work.workers), 'worker')}"
            progress.note(f"cluster: {done_by}, {rate / 1e9:.2f} billion evaluations/s")


def _joined(blocks: dict[int, Measured]) -> Measured:
    """A batch of its blocks, in the order of the slabs; the blocks stay as they are, since they may be compared."""
    first, *later = (blocks[start] for start in sorted(blocks))
    first = replace(first, errors=deepcopy(first.errors))
    for block in later:
        first.errors.merge(block.errors)
    return first
