"""A whole study: prepare, sweep, time, store, report; resumable at every step.

This is what `phongbench run` calls. It writes results and speaks through a Progress; drawing the report is a function
it is given, so that measuring does not depend on drawing.
"""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from phongbench.accuracy import probes
from phongbench.accuracy import sweep as engine
from phongbench.accuracy import tables as rows
from phongbench.accuracy.probes import consistency
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.errors import BudgetError, InputError, InterruptedStudyError
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation
from phongbench.inputs.plan import Plan
from phongbench.results import checkpoints, runs
from phongbench.results.provenance import collect, fingerprint_code
from phongbench.results.runs import Run
from phongbench.study import precompile
from phongbench.support import process
from phongbench.support.process import seldom_collected
from phongbench.support.progress import Progress
from phongbench.timing import skip_kernels
from phongbench.timing.measure import Timing
from phongbench.timing.processes import measure_in_processes
from phongbench.timing.timed_kernels import timed_formulas

#: finished batches are written down after so many seconds, or so many rows, which bounds the memory
CHECKPOINT_SECONDS, CHECKPOINT_ROWS = 5.0, 10_000
#: a timing budget that is too short is replaced by so much more than what it takes
STRETCH = 1.5


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


def default_jobs() -> int:
    """The cores this process may use."""
    return process.cores()


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
    progress = progress or Progress()
    started = time.perf_counter()
    run_id = runs.new_run_id(plan)
    path = out or runs.DEFAULT_ROOT / run_id
    with runs.locked(path), _resumable(path), process.heeded() as check, precompile.beside(plan) as helper:
        progress = _Checked(progress, check)
        parts = _begin(path, plan, fresh=fresh, resume=resume)
        manifest: dict[str, Any] = {
            "schema": runs.SCHEMA,
            "run": _stored_id(path) or (path.name if runs.RUN_ID.match(path.name) else run_id),
            "state": "partial",
            "plan": plan.as_dict(),
            "seed": plan.seed,
            "with": list(files),
            "code": fingerprint_code(),
            "provenance": collect(plan.seed, command).as_dict(),
            "files": {},
        }
        runs.write_manifest(path, manifest)
        sweep = engine.prepare(plan, registry)
        _sweep(sweep, path, parts, jobs or default_jobs(), progress)
        progress.stage("making the accuracy rows")
        outcome = Outcome(Run(path, manifest), len(sweep.cells), sweep.evaluations)
        for message in sweep.failures.values():
            outcome.failures[message] = outcome.failures.get(message, 0) + 1
        context = ProbeContext(
            sweep, rows.accuracy(sweep, parts), rows.worst(sweep, parts), jobs or default_jobs(), note=progress.note
        )
        outcome.seconds["accuracy"] = time.perf_counter() - started
        clock = time.perf_counter()
        tables = _probe(context, path, progress)
        outcome.violations = [*context.violations, *consistency.violations(tables["accuracy"])]
        progress.stage("writing the tables")
        stored: dict[str, Any] = {}
        manifest["files"] = stored
        for name, frame in tables.items():
            stored[f"{name}.parquet"] = runs.write_table(path, name, frame)
        outcome.seconds["stability"] = time.perf_counter() - clock
        clock = time.perf_counter()
        precompile.stop(helper, at_once=not plan.timing)
        if plan.timing:
            stored["timing.parquet"] = runs.write_table(path, "timing", _time(sweep, progress))
        outcome.seconds["timing"] = time.perf_counter() - clock
        manifest["state"] = "complete"
        manifest["failures"] = outcome.failures
        manifest["violations"] = outcome.violations
        manifest["probes"] = context.facts
        manifest["seconds"] = {k: round(v, 3) for k, v in outcome.seconds.items()}
        runs.write_manifest(path, manifest)
        runs.clear(path, [checkpoints.PARTS])
        clock = time.perf_counter()
        if build_report:
            progress.stage("drawing the report")
            outcome.report = build_report(outcome.run, path / "report")
        outcome.seconds["report"] = time.perf_counter() - clock
    outcome.seconds["total"] = time.perf_counter() - started
    return outcome


@dataclass(frozen=True)
class _Checked(Progress):
    """A progress that looks for the user's interruption before every step."""

    told: Progress
    check: Callable[[], None]

    def stage(self, text: str, total: float | None = None) -> None:
        self.check()
        self.told.stage(text, total)

    def advance(self, steps: float = 1) -> None:
        self.check()
        self.told.advance(steps)

    def note(self, text: str) -> None:
        self.told.note(text)


@contextmanager
def _resumable(path: Path) -> Iterator[None]:
    """Turn the user's interruption into an error that says how to go on."""
    try:
        yield
    except KeyboardInterrupt as stop:
        fix = f"the same command with --out {path} --resume goes on"
        raise InterruptedStudyError("interrupted; what is done is kept", None, fix) from stop


def _begin(path: Path, plan: Plan, *, fresh: bool, resume: bool) -> list[pd.DataFrame]:
    """Make the folder ready; the parts a resumed run can keep."""
    if fresh:
        runs.clear(path)
    if not (path / runs.MANIFEST).exists():
        if resume:
            raise InputError(
                "there is nothing to resume", str(path), "leave out --resume, or give the folder of the interrupted run"
            )
        return []
    before = runs.load(path)
    if before.complete and resume:
        raise InputError(
            "the run here is complete", str(path), "`phongbench report` draws its report anew, --fresh measures it anew"
        )
    if not resume:
        raise InputError("the folder already holds a run", str(path), "--resume goes on with it, --fresh discards it")
    if before.plan != plan:
        raise InputError("the run here has another plan", str(path), "give the options it was started with, or --fresh")
    if before.manifest["code"] != fingerprint_code():
        raise InputError(
            "the run here was started by other code", str(path), "its rows could differ in the last bits: use --fresh"
        )
    return checkpoints.read_parts(path)


def _stored_id(path: Path) -> str | None:
    return runs.load(path).id if (path / runs.MANIFEST).exists() else None


def _sweep(sweep: engine.Sweep, path: Path, parts: list[pd.DataFrame], jobs: int, progress: Progress) -> None:
    """Run what is left of the sweep, appending to `parts` in memory and on disk."""
    progress.stage("compiling", 1.0)
    engine.compile_kernels(sweep, progress.share)
    done = {int(index) for frame in parts for index in frame["batch"].unique()}
    progress.stage("accuracy", float(sweep.evaluations))
    progress.advance(float(sum(c.evaluations for c in sweep.batches if c.index in done)))
    fresh: list[engine.Measured] = []
    written = time.monotonic()
    try:
        for measured in engine.run(sweep, jobs=jobs, done=done, progress=progress.advance):
            fresh.append(measured)
            if time.monotonic() - written > CHECKPOINT_SECONDS or sum(m.rows for m in fresh) > CHECKPOINT_ROWS:
                _keep(path, parts, fresh)
                written = time.monotonic()
    finally:
        _keep(path, parts, fresh)


def _probe(context: ProbeContext, path: Path, progress: Progress) -> dict[str, pd.DataFrame]:
    """Ask every probe of the plan, or take what an interrupted run kept of it; every table but the timing."""
    found: dict[str, pd.DataFrame] = {}
    for probe in probes.chosen(context.plan):
        progress.stage(probe.title, 1.0)
        context.advance, context.note = progress.advance, progress.note
        kept = checkpoints.kept_probe(path, probe.name)
        if kept is None:
            before = len(context.violations)
            tables = dict(probe.measure(context))
            told = {"violations": context.violations[before:], "facts": context.facts.get(probe.name)}
            checkpoints.keep_probe(path, probe.name, tables, told)
        else:
            tables, told = kept
            context.violations += told["violations"]
            if told["facts"] is not None:
                context.facts[probe.name] = told["facts"]
        for name, frame in tables.items():
            if name in ("accuracy", "worst"):
                swept = getattr(context, name)
                setattr(context, name, pd.concat([swept, frame], ignore_index=True).astype(swept.dtypes))
            else:
                found[name] = frame
    return {"accuracy": context.accuracy, "worst": context.worst, **found}


def _keep(path: Path, parts: list[pd.DataFrame], fresh: list[engine.Measured]) -> None:
    if fresh:
        frame = rows.part(fresh)
        checkpoints.append_part(path, len(list((path / checkpoints.PARTS).glob("[0-9]*"))), frame)
        parts.append(frame)
        fresh.clear()


def _time(sweep: engine.Sweep, progress: Progress) -> pd.DataFrame:
    """Time every kernel of the plan that differs in time, once."""
    specs, plan = sweep.registry, sweep.plan
    cells = (
        cell
        for position, cell in enumerate(sweep.cells)
        if cell.gated and position not in sweep.failures and cell.formula.space == specs[cell.approximation].spaces[0]
    )

    def measured(seconds: float) -> Timing:
        progress.stage("timing", 1.0)
        return measure_in_processes(
            timed,
            processes=plan.processes,
            budget_seconds=seconds,
            seed=plan.seed,
            threads=(1, 2) if process.cores() > 1 else (1,),
            lit=skip_kernels.LIT if plan.skipping else (),
            progress=_Steps(progress),
        )

    timed = timed_formulas(cells, specs)
    try:
        timing = measured(plan.timing_budget)
    except BudgetError as short:  # known only after the sweep, which must not be lost: so the budget gives way
        enough = STRETCH * short.needed
        progress.note(f"{short.what}; it may take {enough:.0f} s")
        timing = measured(enough)
    for note in (*timing.notes, *(f"not timed: {problem}" for problem in timing.problems)):
        progress.note(note)
    return _in_every_space(timing.rows, specs)


@dataclass
class _Steps:
    """Tells a progress whose whole is 1 how far a timing is."""

    progress: Progress
    last: float = 0.0

    def __call__(self, done: int, total: int, text: str) -> None:
        share = done / max(total, 1)
        self.progress.advance(share - self.last)
        self.last = share


def _in_every_space(frame: pd.DataFrame, specs: Mapping[str, Approximation]) -> pd.DataFrame:
    """The rows with those of further spaces added: on (N, H) the same code runs as on (R, V), so it was timed once."""
    frames = [frame]
    for spec in specs.values():
        frames += [frame[frame["approximation"] == spec.name].assign(space=space) for space in spec.spaces[1:]]
    return pd.concat(frames, ignore_index=True).astype(frame.dtypes)
