"""What a plan would take, from short trials of the real sweep; nothing is stored."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from phongbench.accuracy import probes, sweep
from phongbench.accuracy.sweep import Sweep
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation
from phongbench.inputs.plan import Plan
from phongbench.study import shards
from phongbench.study.shards import Block, ShardName
from phongbench.study.target_costs import checked
from phongbench.support.process import cores
from phongbench.support.progress import Progress

#: what a forecast allows for making a cell ready, for loading a compiled kernel, for making and writing a row, and for
#: handing a shard to a cluster and taking what it gave; measured, and rounded up
CELL_SECONDS, LOAD_SECONDS, ROW_SECONDS, SHARD_SECONDS = 1.2e-4, 0.02, 2e-5, 0.01
#: bytes of a row in the tables, and of what does not grow with the rows
ROW_BYTES, OTHER_BYTES = 90, 200_000


@dataclass(frozen=True)
class Forecast:
    """What a plan would take, told before it is run.

    seconds     by stage: accuracy, stability, timing
    limited_by  what takes longest of it
    """

    cells: int
    rows: int
    evaluations: int
    bytes: int
    seconds: dict[str, float]
    limited_by: str

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self) | {"seconds": {stage: round(value, 1) for stage, value in self.seconds.items()}}


@dataclass(frozen=True)
class Trial:
    """What was counted and measured of a plan, from which follows what it takes on any number of cores.

    kernels  that a process loads
    work     seconds of one thread for the sweep
    longest  seconds of one thread for the block that takes longest: no cluster is faster
    shard    the part of the sweep that is meant; None for all of it, its probes and its timing
    """

    sweep: Sweep
    kernels: int
    work: float
    longest: float
    shard: ShardName | None = None

    def on(self, jobs: int, cluster: int | None = None) -> Forecast:
        """What the plan takes by so many threads here, the sweep by so many cores of a cluster if they are given."""
        plan, batches = self.sweep.plan, self.sweep.batches
        blocks = _blocks(self.sweep, self.shard)
        rows = sum(len(batch.cells) * batch.truths for batch in {batch.index: batch for batch, _ in blocks}.values())
        takes = {"measuring": self.work / jobs}
        if cluster:
            handing = SHARD_SECONDS * shards.number(batches, cluster)
            takes = {"measuring": self.work / cluster, "the longest block": self.longest, "handing out": handing}
        swept = max(takes, key=lambda name: takes[name])
        loading = LOAD_SECONDS * self.kernels + CELL_SECONDS * len(self.sweep.cells)
        loading *= 2 if cluster else 1  # by the workers once more, all at once
        takes = {swept: takes[swept], "loading kernels": loading, "making rows": ROW_SECONDS * rows}
        seconds = {"accuracy": sum(takes.values())}
        if self.shard is None:
            seconds["stability"] = takes["probes"] = sum(probe.seconds(plan, jobs) for probe in probes.chosen(plan))
            seconds["timing"] = takes["timing"] = plan.timing_budget if plan.timing else 0.0
        most = max(takes, key=lambda name: takes[name])
        size = ROW_BYTES * rows + OTHER_BYTES
        return Forecast(len(self.sweep.cells), rows, shards.evaluations(blocks), size, seconds, most)


def forecast(
    plan: Plan,
    registry: Mapping[str, Approximation] = REGISTRY,
    jobs: int | None = None,
    progress: Progress | None = None,
    cluster: int | None = None,
    shard: ShardName | None = None,
) -> Forecast:
    """Cells, bytes and seconds of a plan, the latter from short trials of the real sweep on this machine.

    jobs     threads here, all cores by default
    cluster  cores of a cluster like this machine that does the sweep, if it is not this machine
    shard    the part of the sweep that is meant, without probes and timing; all of it by default
    """
    return tried(plan, registry, progress, shard).on(jobs or cores(), cluster)


def tried(
    plan: Plan,
    registry: Mapping[str, Approximation] = REGISTRY,
    progress: Progress | None = None,
    shard: ShardName | None = None,
) -> Trial:
    """Try every kind of batch of a plan, or of a shard of it.

    This compiles what the run will then find in the cache, so that seconds are those of a run on a warm cache, to which
    other programs leave the processor.
    """
    checked(plan.targets)
    progress = progress or Progress()
    prepared = sweep.prepare(plan, registry)
    blocks = _blocks(prepared, shard)
    progress.stage("compiling", 1.0)
    loaded = sweep.compile_kernels(prepared, progress.share)
    progress.stage("trying every kind of batch")
    seconds_of = sweep.trial(prepared)
    work = [seconds_of(block[0], shards.pairs(block)) for block in blocks]
    return Trial(prepared, loaded, sum(work), max(work), shard)


def _blocks(prepared: Sweep, shard: ShardName | None) -> list[Block]:
    return shards.cut(prepared.batches, shard.count if shard else 1)[shard.index - 1 if shard else 0]
