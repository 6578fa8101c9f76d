"""What a worker of a cluster does: it measures the blocks of a shard, and writes nothing."""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import groupby
from pathlib import Path

import pandas as pd

from phongbench.accuracy import sweep, tables
from phongbench.accuracy.accumulators import ARRAYS
from phongbench.accuracy.sweep import Measured, Sweep, slabs
from phongbench.formulas.spec import Approximation
from phongbench.formulas.user_files import registry_with
from phongbench.inputs.plan import Plan
from phongbench.results.arithmetic import arithmetic, difference


@dataclass(frozen=True)
class Job:
    """What all shards of a study have in common.

    failures    position of a cell that cannot be measured -> message
    files       names and texts of the user's own files
    arithmetic  of the client: a worker whose rows could differ refuses
    """

    plan: Plan
    failures: tuple[tuple[int, str], ...]
    files: tuple[tuple[str, str], ...]
    arithmetic: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Tally:
    """What a shard gave.

    part     rows of its whole batches, as checkpoints keep them; None without any
    blocks   of the batches that it shares with its neighbours, each where its slab begins and what was measured
    refused  in what this worker's arithmetic differs from the client's; then nothing was measured
    """

    worker: str
    part: pd.DataFrame | None = None
    blocks: tuple[tuple[int, Measured], ...] = ()
    refused: str | None = None

    def same(self, other: "Tally") -> bool:
        """True if another worker got the same bits."""
        if (self.part is None) != (other.part is None) or len(self.blocks) != len(other.blocks):
            return False
        if self.part is not None and other.part is not None and not self.part.equals(other.part):
            return False
        pairs = zip(self.blocks, other.blocks, strict=True)
        return all(a == b and _same_block(one, two) for (a, one), (b, two) in pairs)


def _same_block(one: Measured, other: Measured) -> bool:
    """True if all that was measured is the same bits."""
    arrays = [[getattr(of.errors, name).tobytes() for name in ARRAYS] for of in (one, other)]
    return one.cells == other.cells and arrays[0] == arrays[1]


def measure(job: Job, blocks: Sequence[tuple[int, int]]) -> Tally:
    """Measure blocks in the order of the sweep, each the index of a batch and where its slab begins."""
    from distributed import get_worker

    here = str(get_worker().address)
    if changed := difference(dict(job.arithmetic), arithmetic()):
        return Tally(here, refused=changed)
    prepared = _prepared(job)
    whole: list[Measured] = []
    single: list[tuple[int, Measured]] = []
    for index, members in groupby(blocks, key=lambda block: block[0]):
        batch = prepared.batches[index]
        measured = list(sweep.blocks(prepared, [(batch, start) for _, start in members]))
        if len(measured) < len(slabs(batch)):
            single += measured
            continue
        first = measured[0][1]
        for _, later in measured[1:]:
            first.errors.merge(later.errors)
        whole.append(first)
    return Tally(here, tables.part(whole) if whole else None, tuple(single))


@lru_cache(maxsize=2)
def _prepared(job: Job) -> Sweep:
    """The sweep of a job, with the cells that its client could measure."""
    prepared = sweep.prepare(job.plan, registry_of(job.files))
    prepared.failures.update(job.failures)
    return prepared


def texts_of(files: Sequence[Path]) -> tuple[tuple[str, str], ...]:
    """Names and texts of the user's own files, as they travel."""
    return tuple((file.name, file.read_text(encoding="utf-8")) for file in files)


def registry_of(texts: Sequence[tuple[str, str]]) -> Mapping[str, Approximation]:
    """The formulas of this machine and of files that travelled here; two may have the same name."""
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / str(number) / name for number, (name, _) in enumerate(texts)]
        for file, (_, text) in zip(files, texts, strict=True):
            file.parent.mkdir()
            file.write_text(text, encoding="utf-8")
        return registry_with(files)
