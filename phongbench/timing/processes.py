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
from phongbench.formulas.formula import Formula, Registry
from phongbench.formulas.user_files import installed, registry_with
from phongbench.results.schema import TIMING
from phongbench.timing import table
from phongbench.timing.blocks import WORKING_SETS
from phongbench.timing.machine_lock import machine_lock
from phongbench.timing.measure import Timing, check, measure
from phongbench.timing.session import OnShort, Progress, refused
from phongbench.timing.timed_kernels import TimedFormula


def measure_in_processes(
    timed: Sequence[TimedFormula],
    *,
    processes: int,
    budget_seconds: float,
    progress: Progress | None = None,
    on_short: OnShort = refused,
    **options: Any,
) -> Timing:
    """`measure` in this process, or in several fresh ones that share the budget.

    processes  1 for this one; from 8 on the interval of a ratio is a sign test across processes too
    on_short   what gives another budget, for all processes, where a share of this one is too short
    options    further ones of `measure`
    returns    as there; the column `processes` says how many tables were merged
    """
    if processes == 1 or not timed:
        return measure(timed, budget_seconds=budget_seconds, progress=progress, on_short=on_short, **options)
    check(budget_seconds, options.get("working_sets", WORKING_SETS), options.get("threads", (1,)))
    frames: list[pd.DataFrame] = []
    problems: dict[str, MeasurementError] = {}
    notes: dict[str, None] = {}
    with machine_lock():
        for number in range(processes):
            try:
                one = _in_a_process(_task(timed, budget_seconds / processes, number, options))
            except BudgetError as short:  # the others keep theirs
                budget_seconds = on_short(BudgetError(short.what, short.needed * processes, short.where, short.fix))
                one = _in_a_process(_task(timed, budget_seconds / processes, number, options))
            frames.append(one.rows)
            problems |= {str(problem): problem for problem in one.problems if str(problem) not in problems}
            notes |= dict.fromkeys(one.notes)
            if progress is not None:
                progress(number + 1, processes, f"process {number + 1} of {processes}")
    return Timing(table.merged(frames), list(problems.values()), list(notes))


def _task(timed: Sequence[TimedFormula], seconds: float, number: int, options: dict[str, Any]) -> dict[str, Any]:
    """What a child reads: the formulas, the files of the user's own, and the options of `measure`."""
    # by name: where the cosine is taken squared or the slope is a number, the specification is a changed copy
    own = [t.spec.kernel.__code__.co_filename for t in timed if t.spec.name not in installed()]
    formulas = [
        {"formula": asdict(t.formula), "precision": t.precision.name, "alpha": t.alpha, "label": t.label, "far": t.far}
        for t in timed
    ]
    options = {**options, "seed": options.get("seed", 0) + number, "budget_seconds": seconds}
    return {"formulas": formulas, "files": sorted(set(own)), "options": options}


def _in_a_process(task: dict[str, Any]) -> Timing:
    done = subprocess.run(
        [sys.executable, "-m", "phongbench.timing.processes"],
        input=json.dumps(task).encode(),
        capture_output=True,
        check=False,
    )
    if done.returncode:
        last = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or ["no message"]
        raise MeasurementError(f"a timing process failed: {last[0]}", "timing", "run again; if it stays, report it")
    head, _, parquet = done.stdout.partition(b"\n")
    answer = json.loads(head)
    if "needed" in answer:
        what, where, fix = answer["refused"]
        raise BudgetError(what, answer["needed"], where, fix)
    if "refused" in answer:
        raise InputError(*answer["refused"])
    rows = pd.read_parquet(io.BytesIO(parquet)).astype(TIMING.types)
    return Timing(rows, [MeasurementError(*parts) for parts in answer["problems"]], answer["notes"])


def _work(task: dict[str, Any]) -> bytes:
    """What a child answers: a line of JSON with problems and notes or the refusal, then the table as Parquet."""
    parquet = io.BytesIO()
    try:
        timing = measure(_formulas(task), locked=True, **task["options"])
    except BudgetError as short:
        answer: dict[str, Any] = {"refused": _parts(short), "needed": short.needed}
    except InputError as refusal:
        answer = {"refused": _parts(refusal)}
    else:
        timing.rows.to_parquet(parquet)
        answer = {"problems": [_parts(problem) for problem in timing.problems], "notes": timing.notes}
    return json.dumps(answer).encode() + b"\n" + parquet.getvalue()


def _formulas(task: dict[str, Any]) -> list[TimedFormula]:
    """What `_task` was given."""
    registry = registry_with([Path(name) for name in task["files"]])
    return [_formula(described, registry) for described in task["formulas"]]


def _formula(described: dict[str, Any], registry: Registry) -> TimedFormula:
    formula, precision = Formula(**described["formula"]), precision_named(described["precision"])
    alpha, label, far = (described[name] for name in ("alpha", "label", "far"))
    return TimedFormula(formula, formula.spec(registry), precision, alpha, label, far)


def _parts(problem: PhongbenchError) -> list[str | None]:
    return [problem.what, problem.where, problem.fix]


if __name__ == "__main__":
    sys.stdout.buffer.write(_work(json.load(sys.stdin)))
