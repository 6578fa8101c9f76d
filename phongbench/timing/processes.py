"""A measurement in several fresh processes, merged: each has its own placement of code and arrays in memory, which an
interval from one process cannot know about.

The parent holds the machine's lock; the children run one after the other and hand their tables back.
"""

import io
import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd

from phongbench.compiler.lowering import precision_named
from phongbench.errors import BudgetError, InputError, MeasurementError, PhongbenchError
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Setting
from phongbench.formulas.user_files import registry_with
from phongbench.results.schema import TIMING
from phongbench.timing import measure as timing
from phongbench.timing import table as readout
from phongbench.timing.machine_lock import machine_lock
from phongbench.timing.measure import WORKING_SETS, Progress
from phongbench.timing.timed_kernels import Subject


def measure(
    timed: Sequence[Subject],
    *,
    processes: int,
    budget_seconds: float,
    progress: Progress | None = None,
    problems: list[MeasurementError] | None = None,
    notes: list[str] | None = None,
    **options: Any,
) -> pd.DataFrame:
    """`timing.measure` in this process, or in several fresh ones that share the budget.

    processes  1 for this one; from 8 on the interval of a ratio is a sign test across processes too
    options    further ones of `timing.measure`
    returns    as there; the column `processes` says how many tables were merged
    """
    if processes == 1 or not timed:
        return timing.measure(
            timed, budget_seconds=budget_seconds, progress=progress, problems=problems, notes=notes, **options
        )
    timing.check(budget_seconds, options.get("working_sets", WORKING_SETS), options.get("threads", (1,)))
    frames: list[pd.DataFrame] = []
    with machine_lock():
        for number in range(processes):
            task = {
                "subjects": [_described(subject) for subject in timed],
                "files": sorted({_file(s) for s in timed if REGISTRY.get(s.approximation.name) != s.approximation}),
                "budget": budget_seconds / processes,
                "options": {**options, "seed": options.get("seed", 0) + number},
            }
            try:
                told, frame = _in_a_process(task)
            except BudgetError as short:
                raise BudgetError(short.what, short.needed * processes, short.where, short.fix) from short
            frames.append(frame)
            if problems is not None:
                known = [_parts(p) for p in problems]
                problems += [MeasurementError(*p) for p in told["problems"] if p not in known]
            if notes is not None:
                notes += [n for n in told["notes"] if n not in notes]
            if progress is not None:
                progress(number + 1, processes, f"process {number + 1} of {processes}")
    return readout.merged(frames)


def _parts(problem: PhongbenchError) -> list[str | None]:
    return [problem.what, problem.where, problem.fix]


def _described(subject: Subject) -> dict[str, Any]:
    return {
        "approximation": subject.approximation.name,
        "lambda_form": subject.lambda_form,
        "setting": asdict(subject.setting),
        "precision": subject.precision.name,
        "label": subject.label,
    }


def _file(subject: Subject) -> str:
    return subject.approximation.kernel.__code__.co_filename


def _in_a_process(task: dict[str, Any]) -> tuple[dict[str, Any], pd.DataFrame]:
    done = subprocess.run(
        [sys.executable, "-m", "phongbench.timing.processes"],
        input=json.dumps(task).encode(),
        capture_output=True,
        check=False,
    )
    if done.returncode:
        last = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or ["no message"]
        raise MeasurementError(f"a timing process failed: {last[0]}", "timing", "run again; if it stays, report it")
    head, _, table = done.stdout.partition(b"\n")
    told = json.loads(head)
    if "needed" in told:
        what, where, fix = told["refused"]
        raise BudgetError(what, told["needed"], where, fix)
    if "refused" in told:
        raise InputError(*told["refused"])
    return told, pd.read_parquet(io.BytesIO(table)).astype(TIMING.types)


def _work(task: dict[str, Any]) -> bytes:
    """What a child answers: a line of JSON with problems and notes or the refusal, then the table as Parquet."""
    registry = registry_with([Path(name) for name in task["files"]])
    timed = [
        Subject(
            registry[s["approximation"]],
            s["lambda_form"],
            Setting(**s["setting"]),
            precision_named(s["precision"]),
            s["label"],
        )
        for s in task["subjects"]
    ]
    problems: list[MeasurementError] = []
    notes: list[str] = []
    try:
        frame = timing.measure(
            timed, budget_seconds=task["budget"], problems=problems, notes=notes, locked=True, **task["options"]
        )
    except BudgetError as short:
        return json.dumps({"refused": _parts(short), "needed": short.needed}).encode() + b"\n"
    except InputError as refusal:
        return json.dumps({"refused": _parts(refusal)}).encode() + b"\n"
    table = io.BytesIO()
    frame.to_parquet(table)
    return json.dumps({"problems": [_parts(p) for p in problems], "notes": notes}).encode() + b"\n" + table.getvalue()


if __name__ == "__main__":
    sys.stdout.buffer.write(_work(json.load(sys.stdin)))
