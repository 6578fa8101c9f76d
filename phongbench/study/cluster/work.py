"""Hands pieces of work to the workers of a cluster, and takes their answers.

A few pieces for each thread are on their way at a time, and each is released when it is gathered, so the memory of
scheduler and client does not grow with their number. One in a hundred is done again by another worker and compared,
bit for bit.
"""

import pickle
import random
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Generic, Protocol, TypeVar

from phongbench.errors import InputError, MeasurementError
from phongbench.study.cluster.connection import PATIENCE, Connection, counted
from phongbench.support.progress import Progress

#: pieces on their way for each thread of the cluster
AHEAD = 2
#: the share of pieces that another worker does again
AGAIN = 0.01
#: how often a piece may fail; and how many may fail for good while fewer are done
TRIES = 3
#: bytes of a job that goes along with each piece; workers take a larger one from one another
INLINE = 100_000


class Answer(Protocol):
    """What a worker made of a piece."""

    @property
    def worker(self) -> str:
        """Its address."""

    @property
    def refused(self) -> str | None:
        """In what this worker's arithmetic differs from the client's; then nothing was done."""

    def same(self, other: Any) -> bool:
        """True if another worker got the same bits."""


A = TypeVar("A", bound=Answer)


class Work(Generic[A]):
    """Pieces of one job: those that wait, those on their way, and those that failed for good.

    task      called by a worker with the job and a piece; may run more than once for each
    pieces    what is to be done, in the order in which it is sent
    seed      draws the pieces that are done again
    noun      what a piece is called
    workers   afterwards: addresses of those that answered
    compared  afterwards: how many pieces were done again, with the same bits
    """

    def __init__(
        self,
        connection: Connection,
        task: Callable[[Any, Any], A],
        job: Any,
        pieces: Sequence[Any],
        *,
        seed: int,
        noun: str = "shard",
        progress: Progress,
    ) -> None:
        self.at, self.task, self.pieces, self.noun, self.progress = connection, task, pieces, noun, progress
        large = len(pickle.dumps(job)) > INLINE
        # a task, since data alone would be lost with the worker that holds it
        self.job = connection.client.submit(_itself, job, pure=False) if large else job
        self.flying: dict[Any, tuple[int, A | None]] = {}
        self.others: dict[Any, list[str]] = {}
        self.workers: set[str] = set()
        self.failed: dict[int, str] = {}
        self.done = self.compared = 0
        again = max(1, round(AGAIN * len(pieces)))
        self.again = set(random.Random(seed).sample(range(len(pieces)), again))

    def answers(self) -> Iterator[tuple[int, A]]:
        """Which piece, and what it gave, as they are done.

        Raises InputError for a worker that refuses; MeasurementError where the cluster is lost, where two workers
        differ, or where almost everything fails.
        """
        from distributed import wait

        waiting = list(range(len(self.pieces)))[::-1]
        while waiting or self.flying:
            while waiting and len(self.flying) < AHEAD * self.at.threads:
                self._submit(waiting.pop())
            try:
                with self.at.client.as_current():
                    ended = wait(list(self.flying), timeout=1.0, return_when="FIRST_COMPLETED").done
            except TimeoutError:
                ended = set()
            except Exception as problem:
                raise self.at.lost() from problem
            self.progress.advance(0.0)  # where an interruption is noticed
            self._look()
            for future in ended & self.flying.keys():
                index, answer = self._gathered(future)
                if answer is not None:
                    self.done += 1
                    self._tell()
                    yield index, answer

    def _submit(self, index: int, before: A | None = None) -> None:
        """Send a piece out; one that was done before goes to another worker."""
        more: dict[str, Any] = {"retries": TRIES - 1, "pure": False}
        if before:
            more["workers"] = [name for name in self.at.workers if name != before.worker]
        future = self.at.client.submit(self.task, self.job, self.pieces[index], **more)
        self.flying[future], self.others[future] = (index, before), more.get("workers", [])

    def _gathered(self, future: Any) -> tuple[int, A | None]:
        """Which piece, and what it gave that has not been there before; failures are noted.

        An answer that died with its worker since it was there is made again by the scheduler, and one whose worker
        does not react may still come: both are waited for like the others.
        """
        index, before = self.flying[future]
        if future.status == "lost":
            return index, None
        if future.status == "cancelled":
            raise self.at.lost()
        try:
            answer: A = future.result(timeout=PATIENCE)
        except Exception as problem:
            if isinstance(problem, TimeoutError) and future.status != "error":
                return index, None
            if self.at.client.status != "running":
                raise self.at.lost() from problem
            self._drop(future)
            if before is None:
                self._fail(index, problem)
            return index, None
        self._drop(future)
        if answer.refused:
            what = f"the worker would not give this machine's bits: {answer.refused}"
            raise InputError(what, answer.worker, "install the same there, or start all with one --cpu-name")
        self.workers.add(answer.worker)
        if before is not None:
            self._compare(index, before, answer)
            return index, None
        if index in self.again and len(self.at.workers) > 1:
            self._submit(index, answer)
        return index, answer

    def _drop(self, future: Any) -> tuple[int, A | None]:
        """Which piece it was, and its earlier answer."""
        future.release()
        del self.others[future]
        return self.flying.pop(future)

    def _compare(self, index: int, before: A, answer: A) -> None:
        self.compared += 1
        if not answer.same(before):
            what = f"{self.noun} {index + 1} of {len(self.pieces)} has other bits on {before.worker}"
            raise MeasurementError(what, answer.worker, "one of the two computes wrongly: start over without it")

    def _look(self) -> None:
        """See who is there: where all who should have compared a piece are gone, another does, or nobody."""
        self.at.look()
        present = self.at.workers.keys()
        for future in [one for one, names in self.others.items() if names and not present & set(names)]:
            index, before = self._drop(future)
            if before and present - {before.worker}:
                self._submit(index, before)

    def _tell(self) -> None:
        done = f"{self.done} of {counted(len(self.pieces), self.noun)}"
        self.progress.status(f"{done}, {counted(len(self.at.workers), 'worker')}")

    def _fail(self, index: int, problem: Exception) -> None:
        """Note that a piece failed for good; if almost all do, it is not they."""
        name, text = type(problem).__name__, str(problem)
        if name == "KilledWorker":
            text = f"every worker died that tried it, the last {getattr(problem, 'last_worker', problem)}"
        self.failed[index] = text if name == "KilledWorker" else f"{name}: {text}"
        if len(self.failed) >= TRIES and len(self.failed) > self.done:
            self.raise_failures()

    def raise_failures(self) -> None:
        """MeasurementError if a piece failed as often as it may."""
        if self.failed:
            index, message = next(iter(self.failed.items()))
            count = f"{len(self.failed)} of {len(self.pieces)} {self.noun}s failed as often as they may"
            what = f"{count}; {self.noun} {index + 1}: {message}"
            fix = "the workers' own words tell why, e.g. too little memory"
            raise MeasurementError(what, "--cluster", f"{fix}; {self.at.fix}")


def _itself(job: Any) -> Any:
    return job
