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

#: what a forecast allows for loading a compiled kernel, and for making and writing a row; measured, and rounded up
LOAD_SECONDS, ROW_SECONDS = 0.015, 2e-5
#: bytes of a row in the tables, and of what does not grow with the rows
ROW_BYTES, OTHER_BYTES = 90, 200_000


@dataclass(frozen=True)
class Forecast:
    """What a plan would take, told before it is run."""

    cells: int
    rows: int
    evaluations: int
    bytes: int
    seconds: dict[str, float]

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self) | {"seconds": {stage: round(value, 1) for stage, value in self.seconds.items()}}


def forecast(
    plan: Plan,
    registry: Mapping[str, Approximation] = REGISTRY,
    jobs: int | None = None,
    progress: Progress | None = None,
    shard: ShardName | None = None,
) -> Forecast:
    """Cells, bytes and seconds of a plan, the latter from short trials of the real sweep on this machine.

    The trial compiles what the run will then find in the cache, so the seconds are those of a run on a warm cache, to
    which other programs leave the processor.

    shard  which part of the sweep is meant: it has its rows and seconds, and neither probes nor timing; all of it
    """
    checked(plan.targets)
    progress, jobs = progress or Progress(), jobs or cores()
    prepared = sweep.prepare(plan, registry)
    blocks = shards.cut(prepared.batches, shard.count if shard else 1)[shard.index - 1 if shard else 0]
    rows = sum(len(batch.cells) * batch.truths for batch in {batch.index: batch for batch, _ in blocks}.values())
    progress.stage("compiling", 1.0)
    loaded = sweep.compile_kernels(prepared, progress.share)
    progress.stage("trying every kind of batch")
    seconds = {"accuracy": LOAD_SECONDS * loaded + _sweeping(prepared, blocks) / jobs + ROW_SECONDS * rows}
    if shard is None:
        seconds["stability"] = sum(probe.seconds(plan, jobs) for probe in probes.chosen(plan))
        seconds["timing"] = plan.timing_budget if plan.timing else 0.0
    size = ROW_BYTES * rows + OTHER_BYTES
    return Forecast(len(prepared.cells), rows, shards.evaluations(blocks), size, seconds)


def _sweeping(prepared: Sweep, blocks: list[Block]) -> float:
    """Seconds of these blocks on one thread."""
    seconds_of = sweep.trial(prepared)
    whole = {batch.index: seconds_of(batch) for batch in {batch.index: batch for batch, _ in blocks}.values()}
    return sum(whole[block[0].index] * shards.pairs(block) / block[0].samples for block in blocks)
