"""Joins the shards of a sweep: the folder of one run, from which the study goes on as on one machine."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from phongbench.accuracy import sweep, tables
from phongbench.accuracy.sweep import Measured, Sweep
from phongbench.errors import CorruptRunError, InputError
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation
from phongbench.results import checkpoints, runs
from phongbench.results.arithmetic import difference
from phongbench.results.run_lock import locked
from phongbench.results.runs import Run
from phongbench.study import run_folder
from phongbench.study.run import Outcome, run_study
from phongbench.study.shard_run import own_arithmetic, read_block
from phongbench.support.progress import Progress

#: what to do about a shard whose files are not as they were written
_AGAIN = "copy the folder again, or measure the shard again with --fresh"


def merge(
    folders: Sequence[Path],
    out: Path,
    *,
    registry: Mapping[str, Approximation] = REGISTRY,
    own: Sequence[Path] = (),
    jobs: int | None = None,
    fresh: bool = False,
    build_report: Callable[[Run, Path, Callable[[int, int], None]], Path] | None = None,
    progress: Progress | None = None,
    command: Sequence[str] = (),
) -> Outcome:
    """Join all shards of a plan into a run, and do what follows the sweep: probes, timing, report.

    folders   one for each shard, in any order
    out       folder of the run
    registry  the formulas, with those of the user's own
    own       the user's own files behind it, which the shards were measured with
    The rest is as for `run_study`. The rows are those of one machine, bit for bit.
    Raises InputError for a shard that is missing, doubled, not finished, of another plan, or of other arithmetic than
    the others or than this machine; CorruptRunError for one whose files are not as they were written.
    """
    found = joinable(folders, own)
    plan = found[0].plan
    with locked(out):
        _make_room(out, fresh)
        prepared = sweep.prepare(plan.validated(registry), registry)
        for number, frame in enumerate(_batches(prepared, found)):
            checkpoints.append_part(out, number, frame)
        names = [file.name for file in own]
        told = [{key: run.manifest["shard"][key] for key in ("index", "count")} | _where(run) for run in found]
        run_folder.begin(out, runs.new_run_id(plan), plan, command, names, merged=told)
    return run_study(
        plan,
        out,
        registry=registry,
        jobs=jobs,
        resume=True,
        build_report=build_report,
        progress=progress,
        command=command,
        files=names,
    )


def joinable(folders: Sequence[Path], own: Sequence[Path] = ()) -> list[Run]:
    """The shards in these folders, in their order. Raises what `merge` does."""
    found = [_finished(folder) for folder in folders]
    first = found[0]
    for run in found[1:]:
        if run.plan != first.plan:
            raise InputError("is a shard of another plan", str(run.path), f"{first.path} has plan {first.plan.digest}")
        if run.manifest["shard"]["count"] != first.manifest["shard"]["count"]:
            raise InputError(f"is shard {run.shard}", str(run.path), f"{first.path} is shard {first.shard}")
    _check_arithmetic(found, own)
    _check_complete(found)
    return sorted(found, key=lambda run: int(run.manifest["shard"]["index"]))


def _finished(folder: Path) -> Run:
    """The shard in a folder, its files as they were written."""
    run = runs.load(folder)
    if run.shard is None:
        raise InputError("is a run, and no shard of one", str(folder), "make shards: phongbench run --shard 1/4")
    parts = run.manifest["shard"].get("parts")
    if parts is None:
        raise InputError(f"shard {run.shard} is not finished", str(folder), runs.FINISH)
    there = checkpoints.digests(folder)
    for name in sorted(parts.keys() | there.keys()):
        if parts.get(name) != there.get(name):
            fault = "is missing" if name not in there else "was added" if name not in parts else "has other bytes"
            raise CorruptRunError(f"{fault}, so the shard is not as it was written", str(folder / name), _AGAIN)
    return run


def _check_arithmetic(found: Sequence[Run], own: Sequence[Path]) -> None:
    """All shards and this machine compute the same bits, and failed at the same cells."""
    first, here = found[0].manifest["shard"], own_arithmetic(own)
    for run in found:
        shard = run.manifest["shard"]
        if changed := difference(first["arithmetic"], shard["arithmetic"]):
            what = f"was measured with {changed} in {found[0].path}: the rows could differ in their last bits"
            raise InputError(what, str(run.path), "measure it again where the others were, or all with one --cpu-name")
        if shard["failures"] != first["failures"]:
            what = f"other cells failed than in {found[0].path}"
            raise InputError(what, str(run.path), "measure both again on one machine")
    if changed := difference(first["arithmetic"], here):
        fix = "merge where the shards were measured, with the same --with and --cpu-name"
        raise InputError(f"the shards are of other arithmetic than this machine: here {changed}", None, fix)


def _check_complete(found: Sequence[Run]) -> None:
    """Each shard is there once."""
    places: dict[int, Path] = {}
    for run in found:
        index = int(run.manifest["shard"]["index"])
        if index in places:
            raise InputError(f"shard {run.shard} is given twice", str(run.path), f"it is {places[index]}, too")
        places[index] = run.path
    count = int(found[0].manifest["shard"]["count"])
    if lacking := [str(index) for index in range(1, count + 1) if index not in places]:
        some = ", ".join(lacking[:10]) + (" ..." if len(lacking) > 10 else "")
        what = f"{len(lacking)} of {count} shards are missing: {some}"
        raise InputError(what, None, f"measure them, e.g. phongbench run --shard {lacking[0]}/{count}")


def _make_room(out: Path, fresh: bool) -> None:
    """Clear what an interrupted merge left; a run is refused, or discarded where that is wanted."""
    if (out / runs.MANIFEST).exists():
        if not fresh:
            fix = "give another --out, or --fresh to discard it"
            raise InputError("the folder already holds a run", str(out), fix)
        run_folder.discard(out)
    runs.clear(out, [checkpoints.PARTS])


def _where(run: Run) -> dict[str, Any]:
    """Of a shard what a merged run keeps: on what kind of machine it was measured."""
    provenance = run.manifest["provenance"]
    return {"machine": provenance.get("machine_fingerprint"), "cpu": provenance.get("machine", {}).get("cpu")}


def _batches(prepared: Sweep, found: Sequence[Run]) -> list[pd.DataFrame]:
    """The numbers of every batch: parts as the shards wrote them, and the batches that shards share put together."""
    parts = [frame for run in found for frame in checkpoints.read_parts(run.path)]
    files = {key: file for run in found for key, file in checkpoints.block_files(run.path).items()}
    joined: dict[int, Measured] = {}
    for (index, _), file in sorted(files.items()):  # in the order of the slabs, for the bits of one machine
        block = read_block(file, prepared.batches[index])
        if index not in joined:
            joined[index] = block
        elif joined[index].cells == block.cells:
            joined[index].errors.merge(block.errors)
        else:
            raise CorruptRunError("has other cells than the block before it", str(file), _AGAIN)
    return [*parts, tables.part(list(joined.values()))] if joined else parts
