"""A shard of a sweep: measured into a folder of its own, which `merge` joins with the others'.

The folder is that of a run that stays partial. It keeps the parts of whole batches as any run under way does, and of
the batches that it shares with its neighbours each block.
"""

import hashlib
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from phongbench.accuracy import sweep
from phongbench.accuracy.accumulators import ARRAYS, ErrorAccumulator
from phongbench.accuracy.batches import Batch
from phongbench.accuracy.sweep import Measured, Sweep
from phongbench.errors import CorruptRunError, InputError
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation
from phongbench.inputs.plan import Plan
from phongbench.results import checkpoints, runs
from phongbench.results.arithmetic import arithmetic, difference
from phongbench.results.run_lock import locked
from phongbench.results.runs import Run
from phongbench.study import run_folder, shards, sweep_parts
from phongbench.study.checked_progress import Checked
from phongbench.study.shards import Block, ShardName
from phongbench.support import process
from phongbench.support.process import seldom_collected
from phongbench.support.progress import Progress


@dataclass
class ShardOutcome:
    """What measuring a shard did.

    failures  messages of cells that could not be measured, with how many cells each concerns
    """

    run: Run
    blocks: int
    evaluations: int
    seconds: float
    failures: dict[str, int]
    finished_before: bool = False

    def as_dict(self) -> dict[str, Any]:
        """The document that `phongbench run --shard --json` prints."""
        return {
            "run": self.run.id,
            "path": str(self.run.path),
            "shard": self.run.shard,
            "blocks": self.blocks,
            "evaluations": self.evaluations,
            "seconds": round(self.seconds, 3),
            "peak_mib": process.peak_mib(),
            "failed_cells": sum(self.failures.values()),
        }


def own_arithmetic(own: Sequence[Path]) -> dict[str, str]:
    """What decides the last bits here: code, versions, processor, and the text of the user's own files."""
    texts = [hashlib.sha256(file.read_bytes()).hexdigest()[:16] for file in own]
    return {**arithmetic(), "own formulas": " ".join(texts)}


@seldom_collected()
def run_shard(
    plan: Plan,
    name: ShardName,
    out: Path | None = None,
    *,
    registry: Mapping[str, Approximation] = REGISTRY,
    jobs: int | None = None,
    resume: bool = False,
    fresh: bool = False,
    progress: Progress | None = None,
    command: Sequence[str] = (),
    own: Sequence[Path] = (),
) -> ShardOutcome:
    """Measure a shard of a plan's sweep into a folder; the arguments are those of `run_study`.

    own  the user's own files behind the registry: all shards must be measured with the same
    Raises what `run_study` does, and InputError where the plan has less work than shards.
    """
    started = time.perf_counter()
    run_id = runs.new_run_id(plan)
    path = out or runs.DEFAULT_ROOT / f"{run_id}-{name.index}-{name.count}"
    with locked(path), run_folder.resumable(path), process.heeded() as check:
        prepared = sweep.prepare(plan, registry)
        blocks = shards.cut(prepared.batches, name.count)[name.index - 1]
        parts = run_folder.prepare(path, plan, fresh=fresh, resume=resume, shard=str(name))
        mine = own_arithmetic(own)
        told = runs.load(path).manifest["shard"] if (path / runs.MANIFEST).exists() else None
        if told and (changed := difference(told["arithmetic"], mine)):
            fix = "go on where it was started, or use --fresh"
            raise InputError(f"the shard was started with other arithmetic: {changed}", str(path), fix)
        if told and "parts" in told:
            failures, size = told["failures"], shards.evaluations(blocks)
            seconds = time.perf_counter() - started
            return ShardOutcome(runs.load(path), len(blocks), size, seconds, failures, finished_before=True)
        shard: dict[str, Any] = {"index": name.index, "count": name.count, "arithmetic": mine}
        manifest = run_folder.begin(path, run_id, plan, command, [file.name for file in own], shard=shard)
        checked = Checked(progress or Progress(), check)
        checked.stages(2)
        checked.stage("compiling", 1.0)
        sweep.compile_kernels(prepared, checked.share)
        _measure(prepared, blocks, path, parts or [], jobs or process.cores(), checked)
        failures = dict(Counter(prepared.failures.values()))
        shard |= {"failures": failures, "parts": checkpoints.digests(path)}
        runs.write_manifest(path, manifest)
    return ShardOutcome(
        Run(path, manifest), len(blocks), shards.evaluations(blocks), time.perf_counter() - started, failures
    )


def _measure(
    prepared: Sweep, blocks: Sequence[Block], path: Path, parts: list[Any], jobs: int, progress: Progress
) -> None:
    """Measure what is left of a shard, and write it down: its whole batches as parts, its other blocks one by one."""
    whole = shards.whole_batches(blocks)
    done = {int(index) for frame in parts for index in frame["batch"].unique()}
    kept = checkpoints.block_files(path)
    single = [(batch, start) for batch, start in blocks if batch.index not in whole]
    left = [(batch, start) for batch, start in single if (batch.index, start) not in kept]
    progress.stage("accuracy", float(shards.evaluations(blocks)))
    over = [b for b in blocks if b[0].index in done] + [b for b in single if (b[0].index, b[1]) in kept]
    progress.advance(float(shards.evaluations(over)))
    for start, block in sweep.blocks(prepared, left, jobs):
        write_block(path, start, block)
        progress.advance(float(block.errors.samples) * len(block.batch.cells))
    others = {batch.index for batch in prepared.batches if batch.index not in whole}
    batches = sweep.run(prepared, jobs=jobs, done=done | others, progress=progress.advance)
    sweep_parts.keep(path, parts, batches)


def write_block(path: Path, start: int, block: Measured) -> None:
    """Write a measured block into a shard's folder."""
    arrays = {name: getattr(block.errors, name) for name in ARRAYS}
    arrays |= {"samples": np.array(block.errors.samples, np.int64), "cells": np.array(block.cells, np.int64)}
    checkpoints.write_block(path, block.batch.index, start, arrays)


def read_block(file: Path, batch: Batch) -> Measured:
    """The block in a file that `write_block` wrote. CorruptRunError if it is none of this batch."""
    arrays = checkpoints.read_block(file)
    if arrays.keys() != {*ARRAYS, "samples", "cells"}:
        raise CorruptRunError("is no block of a shard", str(file), "measure the shard again with --fresh")
    cells = tuple(int(cell) for cell in arrays["cells"])
    errors = ErrorAccumulator(len(cells) * batch.truths)
    for name in ARRAYS:
        if getattr(errors, name).shape != arrays[name].shape:
            raise CorruptRunError("is of another batch", str(file), "measure the shard again with --fresh")
        setattr(errors, name, arrays[name])
    errors.samples = int(arrays["samples"])
    return Measured(batch, cells, errors)
