"""A whole study: prepare, accuracy, probes, timing, store, report; resumable at every step.

This is what `phongbench run` calls. It writes results and speaks through a Progress; drawing the report is a function
it is given, so that measuring does not depend on drawing.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from phongbench.accuracy import probes, sweep, tables
from phongbench.accuracy.probes import Probe, consistency
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.accuracy.sweep import Measured, Sweep
from phongbench.errors import InputError, InterruptedStudyError
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation
from phongbench.inputs.plan import Plan
from phongbench.results import checkpoints, runs
from phongbench.results.provenance import collect, fingerprint_code
from phongbench.results.runs import Run
from phongbench.study import precompile
from phongbench.study.kernel_timing import time_all
from phongbench.support import process
from phongbench.support.process import seldom_collected
from phongbench.support.progress import Progress

#: finished batches are written down after so many seconds, or so many rows, which bounds the memory
CHECKPOINT_SECONDS, CHECKPOINT_ROWS = 5.0, 10_000


@dataclass
class Outcome:
    """What a study did.

    seconds     of wall time by stage: accuracy, stability, timing, report, total
    failures    messages of cells that could not be measured, with how many cells each concerns
    violations  sentences on results that contradict each other
    """

    run: Run
    cells: int
    evaluations: int
    seconds: dict[str, float] = field(default_factory=dict)
    failures: dict[str, int] = field(default_factory=dict)
    violations: list[str] = field(default_factory=list)
    report: Path | None = None

    @property
    def failed_cells(self) -> int:
        """Cells of the plan without rows."""
        return sum(self.failures.values())

    def as_dict(self) -> dict[str, Any]:
        """The document that `phongbench run --json` prints."""
        return {
            "run": self.run.id,
            "path": str(self.run.path),
            "cells": self.cells,
            "evaluations": self.evaluations,
            "seconds": {name: round(value, 3) for name, value in self.seconds.items()},
            "failed_cells": self.failed_cells,
            "violations": self.violations,
            "report": None if self.report is None else str(self.report),
        }


@seldom_collected()
def run_study(
    plan: Plan,
    out: Path | None = None,
    *,
    registry: Mapping[str, Approximation] = REGISTRY,
    jobs: int | None = None,
    resume: bool = False,
    fresh: bool = False,
    build_report: Callable[[Run, Path], Path] | None = None,
    progress: Progress | None = None,
    command: Sequence[str] = (),
    files: Sequence[str] = (),
) -> Outcome:
    """Measure a plan into a folder.

    plan          validated plan
    out           folder of the run; a new one under phongbench-runs by default
    jobs          threads of the sweep, all cores by default; the rows do not depend on it
    resume        go on where an interrupted run of the same plan and code stopped
    fresh         discard what the folder holds
    build_report  (run, folder) -> path of the page; None to leave the report out
    command       the words of the command line, for the provenance
    files         names of the user's own files behind the registry, for the commands a report shows
    Raises LockedError, StorageError, InputError (the folder holds another run), CorruptRunError, InterruptedStudyError.
    """
    run_id = runs.new_run_id(plan)
    path = out or runs.DEFAULT_ROOT / run_id
    seconds: dict[str, float] = {}
    with (
        _clocked(seconds, "total"),
        runs.locked(path),
        _resumable(path),
        process.heeded() as check,
        precompile.beside(plan) as helper,
    ):
        with _clocked(seconds, "accuracy"):
            parts = _prepare_folder(path, plan, fresh=fresh, resume=resume)
            manifest = _manifest(path, run_id, plan, command, files)
            checked = _Checked(progress or Progress(), check)
            study = _Study(sweep.prepare(plan, registry), path, manifest, jobs or process.cores(), checked)
            context = study.accuracy(parts)
        with _clocked(seconds, "stability"):
            study.store(study.probes(context))
        with _clocked(seconds, "timing"):
            precompile.stop(helper, at_once=not plan.timing)
            if plan.timing:
                study.store(time_all(study.sweep, checked))
        outcome = study.complete(context, seconds)
        with _clocked(seconds, "report"):
            if build_report:
                checked.stage("drawing the report")
                outcome.report = build_report(outcome.run, path / "report")
    return outcome


@contextmanager
def _clocked(seconds: dict[str, float], stage: str) -> Iterator[None]:
    started = time.perf_counter()
    yield
    seconds[stage] = time.perf_counter() - started


@dataclass(frozen=True)
class _Checked(Progress):
    """A progress that looks for the user's interruption before every step."""

    progress: Progress
    check: Callable[[], None]

    def stage(self, text: str, total: float | None = None) -> None:
        self.check()
        self.progress.stage(text, total)

    def advance(self, steps: float = 1) -> None:
        self.check()
        self.progress.advance(steps)

    def note(self, text: str) -> None:
        self.progress.note(text)


@contextmanager
def _resumable(path: Path) -> Iterator[None]:
    """Turn the user's interruption into an error that says how to go on."""
    try:
        yield
    except KeyboardInterrupt as stop:
        fix = f"the same command with --out {path} --resume goes on"
        raise InterruptedStudyError("interrupted; what is done is kept", None, fix) from stop


def _prepare_folder(path: Path, plan: Plan, *, fresh: bool, resume: bool) -> list[pd.DataFrame]:
    """Make the folder ready; the parts a resumed run can keep."""
    if fresh:
        runs.clear(path)
    if not (path / runs.MANIFEST).exists():
        if resume:
            fix = "leave out --resume, or give the folder of the interrupted run"
            raise InputError("there is nothing to resume", str(path), fix)
        return []
    before = runs.load(path)
    if not resume:
        raise InputError("the folder already holds a run", str(path), "--resume goes on with it, --fresh discards it")
    if before.complete:
        fix = "`phongbench report` draws its report anew, --fresh measures it anew"
        raise InputError("the run here is complete", str(path), fix)
    if before.plan != plan:
        raise InputError("the run here has another plan", str(path), "give the options it was started with, or --fresh")
    if before.manifest["code"] != fingerprint_code():
        fix = "its rows could differ in the last bits: use --fresh"
        raise InputError("the run here was started by other code", str(path), fix)
    return checkpoints.read_parts(path)


def _manifest(path: Path, run_id: str, plan: Plan, command: Sequence[str], files: Sequence[str]) -> dict[str, Any]:
    """What the folder says of a run that begins, or goes on under the name that it has."""
    if (path / runs.MANIFEST).exists():
        run_id = runs.load(path).id
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
    }
    runs.write_manifest(path, manifest)
    return manifest


@dataclass
class _Study:
    """A study under way: its stages, each of which leaves what it did in the run's folder."""

    sweep: Sweep
    path: Path
    manifest: dict[str, Any]
    jobs: int
    progress: Progress

    def accuracy(self, parts: list[pd.DataFrame]) -> ProbeContext:
        """Run what is left of the sweep, appending to `parts` in memory and on disk; the rows of all of it."""
        self.progress.stage("compiling", 1.0)
        sweep.compile_kernels(self.sweep, self.progress.share)
        done = {int(index) for frame in parts for index in frame["batch"].unique()}
        self.progress.stage("accuracy", float(self.sweep.evaluations))
        self.progress.advance(float(sum(b.evaluations for b in self.sweep.batches if b.index in done)))
        fresh: list[Measured] = []
        written = time.monotonic()
        try:
            for measured in sweep.run(self.sweep, jobs=self.jobs, done=done, progress=self.progress.advance):
                fresh.append(measured)
                if time.monotonic() - written > CHECKPOINT_SECONDS or sum(m.rows for m in fresh) > CHECKPOINT_ROWS:
                    self._append(parts, fresh)
                    written = time.monotonic()
        finally:
            self._append(parts, fresh)
        self.progress.stage("making the accuracy rows")
        rows, worst = tables.accuracy(self.sweep, parts), tables.worst(self.sweep, parts)
        return ProbeContext(self.sweep, rows, worst, self.jobs, note=self.progress.note)

    def _append(self, parts: list[pd.DataFrame], fresh: list[Measured]) -> None:
        if fresh:
            frame = tables.part(fresh)
            checkpoints.append_part(self.path, len(list((self.path / checkpoints.PARTS).glob("[0-9]*"))), frame)
            parts.append(frame)
            fresh.clear()

    def probes(self, context: ProbeContext) -> dict[str, pd.DataFrame]:
        """Run every probe of the plan, or take what an interrupted run kept of it; every table but the timing."""
        frames: dict[str, pd.DataFrame] = {}
        for probe in probes.chosen(context.plan):
            self.progress.stage(probe.title, 1.0)
            context.advance = self.progress.advance
            for name, frame in self._probed(probe, context).items():
                if name in ("accuracy", "worst"):
                    swept = getattr(context, name)
                    setattr(context, name, pd.concat([swept, frame], ignore_index=True).astype(swept.dtypes))
                else:
                    frames[name] = frame
        context.violations += consistency.violations(context.accuracy)
        self.progress.stage("writing the tables")
        return {"accuracy": context.accuracy, "worst": context.worst, **frames}

    def _probed(self, probe: Probe, context: ProbeContext) -> dict[str, pd.DataFrame]:
        """The tables of a probe; what it said beside them is in the context."""
        kept = checkpoints.read_probe(self.path, probe.name)
        if kept is None:
            before = len(context.violations)
            frames = dict(probe.measure(context))
            said = {"violations": context.violations[before:], "facts": context.facts.get(probe.name)}
            checkpoints.write_probe(self.path, probe.name, frames, said)
            return frames
        frames, said = kept
        context.violations += said["violations"]
        if said["facts"] is not None:
            context.facts[probe.name] = said["facts"]
        return frames

    def store(self, frames: Mapping[str, pd.DataFrame]) -> None:
        """Write tables into the folder."""
        for name, frame in frames.items():
            self.manifest["files"][f"{name}.parquet"] = runs.write_table(self.path, name, frame)

    def complete(self, context: ProbeContext, seconds: dict[str, float]) -> Outcome:
        """Say in the manifest that all is there, and clear what only a resumed run needs."""
        failures = dict(Counter(self.sweep.failures.values()))
        self.manifest |= {
            "state": "complete",
            "failures": failures,
            "violations": context.violations,
            "probes": context.facts,
            "seconds": {stage: round(value, 3) for stage, value in seconds.items()},
        }
        runs.write_manifest(self.path, self.manifest)
        runs.clear(self.path, [checkpoints.PARTS])
        run = Run(self.path, self.manifest)
        return Outcome(run, len(self.sweep.cells), self.sweep.evaluations, seconds, failures, context.violations)
