"""The folder of a study before it measures: what it may hold, what is kept of it, and what it says from then on."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pandas as pd

from phongbench.errors import CorruptRunError, InputError, InterruptedStudyError
from phongbench.inputs.plan import Plan
from phongbench.results import checkpoints, runs
from phongbench.results.provenance import collect, fingerprint_code


@contextmanager
def resumable(path: Path) -> Iterator[None]:
    """Turn the user's interruption into an error that says how to go on."""
    try:
        yield
    except KeyboardInterrupt as stop:
        fix = f"phongbench run --out {path} --resume goes on"
        raise InterruptedStudyError("interrupted; what is done is kept", None, fix) from stop


def stored_plan(path: Path, files: Sequence[str] = ()) -> Plan:
    """The plan of the run in a folder, to go on with it.

    files  names of the user's own files that are given; InputError where the run was begun with others, or no run is
           there
    """
    if not (path / runs.MANIFEST).exists():
        raise _nothing_to_resume(path)
    run = runs.load(path)
    if lacking := [name for name in run.manifest.get("with", ()) if name not in files]:
        fix = "give the same files: " + " ".join(f"--with {name}" for name in lacking)
        raise InputError(f"the run was begun with {', '.join(lacking)}", str(path), fix)
    return run.plan


def _nothing_to_resume(path: Path) -> InputError:
    fix = "leave out --resume, or give the folder of the interrupted run"
    return InputError("there is nothing to resume", str(path), fix)


def drawn_report(path: Path) -> Path | None:
    """The page of the report in a run's folder, if there is one."""
    page = path / "report" / "index.html"
    return page if page.is_file() else None


def prepare(
    path: Path, plan: Plan, *, fresh: bool, resume: bool, shard: str | None = None
) -> list[pd.DataFrame] | None:
    """Make the folder ready; the parts that a resumed run can keep, or None if nothing is left to measure.

    shard  which one the folder is to hold, as `2/8`; None for a whole run
    Raises InputError for a folder that holds another run, or another program's manifest.
    """
    if fresh:
        discard(path)
    if not (path / runs.MANIFEST).exists():
        if resume:
            raise _nothing_to_resume(path)
        return []
    before = runs.load(path)
    if not resume:
        raise InputError("the folder already holds a run", str(path), "--resume goes on with it, --fresh discards it")
    if before.shard != shard:
        other = f"shard {before.shard}" if before.shard else "a run that is no shard"
        raise InputError(f"the folder holds {other}", str(path), "leave out --shard, or give another --out")
    if before.plan != plan:
        raise InputError("the run here has another plan", str(path), "give the options it was started with, or --fresh")
    if before.complete:
        runs.clear(path, [checkpoints.PARTS])  # a kill right after the end left them
        return None
    if before.manifest["code"] != fingerprint_code():
        fix = "its rows could differ in the last bits: use --fresh"
        raise InputError("the run here was started by other code", str(path), fix)
    return checkpoints.read_parts(path)


def discard(path: Path) -> None:
    """Remove the run in a folder, be it corrupt; a folder without one keeps what it has, whatever its names are."""
    if (path / runs.MANIFEST).exists():
        with suppress(CorruptRunError):
            runs.load(path)  # InputError: the manifest is another program's
        runs.clear(path)


def begin(
    path: Path, run_id: str, plan: Plan, command: Sequence[str], files: Sequence[str], **more: Any
) -> dict[str, Any]:
    """What the folder says of a run that begins, or goes on under the name that it has: its manifest, written.

    more  further keys of the manifest; of a run that goes on, `merged` and `cluster` stay
    """
    if (path / runs.MANIFEST).exists():
        before = runs.load(path)
        run_id = before.id
        more = {key: before.manifest[key] for key in ("merged", "cluster") if key in before.manifest} | more
    elif runs.RUN_ID.match(path.name):
        run_id = path.name
    manifest: dict[str, Any] = {
        "schema": runs.SCHEMA,
        "run": run_id,
        "state": "partial",
        "plan": plan.as_dict(),
        "seed": plan.seed,
        "with": list(files),
        "code": fingerprint_code(),
        "provenance": collect(plan.seed, command).as_dict(),
        "files": {},
        **more,
    }
    runs.write_manifest(path, manifest)
    return manifest
