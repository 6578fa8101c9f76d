"""A whole study: prepare, accuracy, probes, timing, store, report; resumable at every step.

This is what `phongbench run` calls. It writes results and speaks through a Progress; drawing the report is a function
it is given, so that measuring does not depend on drawing.
"""

import time
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import pandas as pd

from phongbench.accuracy import probes, sweep, tables
from phongbench.accuracy.probes import Probe, consistency
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.accuracy.sweep import Measured, Sweep
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation
from phongbench.inputs.plan import Plan
from phongbench.results import checkpoints, runs
from phongbench.results.run_lock import locked
from phongbench.results.runs import Run
from phongbench.results.schema import TIMING
from phongbench.study import gpu, precompile, run_folder, sweep_parts, target_costs
from phongbench.study.checked_progress import Checked
from phongbench.study.kernel_timing import time_all
from phongbench.support import process
from phongbench.support.process import seldom_collected
from phongbench.support.progress import Progress, Reached


class Engine(Protocol):
    """What measures a sweep elsewhere; `facts` is what it knows of it afterwards."""

    facts: dict[str, int]

    def __call__(
        self, sweep: Sweep, progress: Progress, *, jobs: int, done: Collection[int]
    ) -> Iterator[Measured | pd.DataFrame]:
        """The batches that are not in `done`, or parts of them, in any order; tells evaluations as they are done."""


@dataclass
class Outcome:
    """What a study did.

    seconds     of wall time by stage: accuracy, of which compiling is a part, stability, timing, report, total
    failures    messages of cells that could not be measured, with how many cells each concerns
    violations  sentences on results that contradict each other
    finished_before  nothing was left to measure
    """

    run: Run
    cells: int
    evaluations: int
    seconds: dict[str, float] = field(default_factory=dict)
    failures: dict[str, int] = field(default_factory=dict)
    violations: list[str] = field(default_factory=list)
    report: Path | None = None
    finished_before: bool = False

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
            "peak_mib": process.peak_mib(),
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
    build_report: Callable[[Run, Path, Callable[[int, int], None]], Path] | None = None,
    progress: Progress | None = None,
    command: Sequence[str] = (),
    files: Sequence[str] = (),
    engine: Engine | None = None,
) -> Outcome:
    """Measure a plan into a folder.

    plan          validated plan
    out           folder of the run; a new one under phongbench-runs by default
    jobs          threads of the sweep, all cores by default; the rows do not depend on it
    resume        go on where an interrupted run of the same plan and code stopped
    fresh         discard what the folder holds
    build_report  (run, folder, reached) -> path of the page; None to leave the report out. It calls
                  reached(done, total) before each of its steps. Of a finished run a report that is there is kept
    command       the words of the command line, for the provenance
    files         names of the user's own files behind the registry, for the commands a report shows
    engine        what measures the sweep; this process by default
    Raises LockedError, StorageError, InputError (the folder holds another run), CorruptRunError, InterruptedStudyError,
    UnknownNameError for a target of the plan.
    """
    target_costs.checked(plan.targets)
    run_id = runs.new_run_id(plan)
    path = out or runs.DEFAULT_ROOT / run_id
    seconds: dict[str, float] = {}
    with (
        _clocked(seconds, "total"),
        locked(path),
        run_folder.resumable(path),
        process.heeded() as check,
        precompile.beside(plan) as helper,
    ):
        checked = Checked(progress or Progress(), check)
        parts = run_folder.prepare(path, plan, fresh=fresh, resume=resume)
        prepared = sweep.prepare(plan, registry)
        if parts is None:
            precompile.stop(helper, at_once=True)
            outcome = _finished(runs.load(path), prepared, seconds)
        else:
            manifest = run_folder.begin(path, run_id, plan, command, files)
            checked.stages(_stages(plan) + (build_report is not None))
            study = _Study(prepared, path, manifest, jobs or process.cores(), checked, engine)
            outcome = study.measure(parts, seconds, lambda: precompile.stop(helper, at_once=not plan.timing))
        with _clocked(seconds, "report"):
            if build_report and (drawn := run_folder.drawn_report(path)) and parts is None:
                outcome.report = drawn
            elif build_report:
                checked.stage("drawing the report", 1.0)
                outcome.report = build_report(outcome.run, path / "report", Reached(checked))
    return outcome


def _finished(run: Run, prepared: Sweep, seconds: dict[str, float]) -> Outcome:
    """What a study did that was finished before: nothing is measured, but its report may be missing."""
    seconds |= dict.fromkeys(("compiling", "accuracy", "stability", "timing"), 0.0)
    failures, violations = run.manifest.get("failures", {}), run.manifest.get("violations", [])
    return Outcome(run, len(prepared.cells), prepared.evaluations, seconds, failures, violations, finished_before=True)


def _stages(plan: Plan) -> int:
    """How many stages a study has before its report: compiling, sweep, rows, each probe, tables, times, costs."""
    timing = 1 + ("incidence" in plan.probes) if plan.timing else 0
    return 3 + len(probes.chosen(plan)) + 1 + timing + 1


@contextmanager
def _clocked(seconds: dict[str, float], stage: str) -> Iterator[None]:
    started = time.perf_counter()
    yield
    seconds[stage] = time.perf_counter() - started


@dataclass
class _Study:
    """A study under way: its stages, each of which leaves what it did in the run's folder."""

    sweep: Sweep
    path: Path
    manifest: dict[str, Any]
    jobs: int
    progress: Progress
    engine: Engine | None = None

    def measure(self, parts: list[pd.DataFrame], seconds: dict[str, float], end_help: Callable[[], None]) -> Outcome:
        """All stages but the report.

        parts     what an interrupted study has left of the sweep; empty afterwards
        seconds   receives what each stage took
        end_help  called before the timing, which nothing may disturb
        """
        with _clocked(seconds, "accuracy"):
            context = self.accuracy(parts, seconds)
            self.store({"accuracy": context.accuracy, "worst": context.worst})  # enough for a report
        with _clocked(seconds, "stability"):
            frames = self.probes(context)
            self.manifest |= {"violations": context.violations, "probes": context.facts}
            self.store(frames)
        with _clocked(seconds, "timing"):
            end_help()
            times = time_all(self.sweep, self.progress) if self.sweep.plan.timing else {}
            self.store(times)
            self.store(self.costs(context, times.get("timing", TIMING.frame())))
        return self.complete(context, seconds)

    def accuracy(self, parts: list[pd.DataFrame], seconds: dict[str, float]) -> ProbeContext:
        """Run what is left of the sweep, appending to `parts` and on disk, and make the rows of all `parts`."""
        self.progress.stage("compiling", 1.0)
        with _clocked(seconds, "compiling"):
            sweep.compile_kernels(self.sweep, self.progress.share)
            sweep.compile_layouts(self.sweep)
        done = {int(index) for frame in parts for index in frame["batch"].unique()}
        self.progress.stage("accuracy", float(self.sweep.evaluations))
        self.progress.advance(float(sum(b.evaluations for b in self.sweep.batches if b.index in done)))
        sweep_parts.keep(self.path, parts, self._swept(done))
        if self.engine and self.engine.facts:
            self.manifest["cluster"] = self.engine.facts
        self.progress.stage("making the accuracy rows")
        accuracy, worst = tables.accuracy(self.sweep, parts), tables.worst(self.sweep, parts)
        parts.clear()  # as large as the rows, and on disk
        note, detail = self.progress.note, self.progress.detail
        return ProbeContext(self.sweep, accuracy, worst, self.jobs, note=note, detail=detail)

    def _swept(self, done: Collection[int]) -> Iterator[Measured | pd.DataFrame]:
        """What is left of the sweep, measured by the engine, or by this process."""
        if self.engine:
            return self.engine(self.sweep, self.progress, jobs=self.jobs, done=done)
        return sweep.run(self.sweep, jobs=self.jobs, done=done, progress=self.progress.advance)

    def probes(self, context: ProbeContext) -> dict[str, pd.DataFrame]:
        """Run every probe of the plan, or take what an interrupted run kept of it; every table that they add to."""
        frames: dict[str, pd.DataFrame] = {}
        for probe in probes.chosen(context.plan):
            self.progress.stage(probe.title, 1.0)
            context.advance = self.progress.advance
            for name, frame in self._probed(probe, context).items():
                frames[name] = frame
                if name in ("accuracy", "worst"):
                    swept = getattr(context, name)
                    frames[name] = pd.concat([swept, frame], ignore_index=True).astype(swept.dtypes)
                    setattr(context, name, frames[name])
        context.violations += consistency.violations(context.accuracy)
        self.progress.stage("writing the tables")
        return frames

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

    def costs(self, context: ProbeContext, timing: pd.DataFrame) -> dict[str, pd.DataFrame]:
        """What the formulas cost on the plan's targets; and, where an adapter was measured, its errors."""
        self.progress.stage("costs on targets")
        plan = self.sweep.plan
        cells = [cell for at, cell in enumerate(self.sweep.cells) if cell.gated and at not in self.sweep.failures]
        costs = target_costs.Costs(cells, self.sweep.registry, self.progress.note)
        found = gpu.measure(self.sweep, costs.codes(gpu.LANGUAGE), self.progress) if gpu.wanted(plan) else None
        if found is None:
            return {"costs": costs.frame(plan.targets, timing)}
        self.manifest["gpu"] = found.facts
        whole = pd.concat([context.accuracy, found.errors], ignore_index=True).astype(context.accuracy.dtypes)
        return {"costs": costs.frame(plan.targets, timing, found.rows), "accuracy": whole}

    def store(self, frames: Mapping[str, pd.DataFrame]) -> None:
        """Write tables into the folder, and that they are there: an interrupted run has what it has stored."""
        files = self.manifest["files"]
        if any(files.pop(f"{name}.parquet", None) for name in frames):
            runs.write_manifest(self.path, self.manifest)  # while a table is replaced, the run does not have it
        for name, frame in frames.items():
            files[f"{name}.parquet"] = runs.write_table(self.path, name, frame)
        runs.write_manifest(self.path, self.manifest)

    def complete(self, context: ProbeContext, seconds: dict[str, float]) -> Outcome:
        """Say in the manifest that all is there, and clear what only a resumed run needs."""
        failures = dict(Counter(self.sweep.failures.values()))
        self.manifest |= {
            "state": "complete",
            "failures": failures,
            "seconds": {stage: round(value, 3) for stage, value in seconds.items()},
        }
        runs.write_manifest(self.path, self.manifest)
        runs.clear(self.path, [checkpoints.PARTS])
        run = Run(self.path, self.manifest)
        return Outcome(run, len(self.sweep.cells), self.sweep.evaluations, seconds, failures, context.violations)
