"""The timing of a study: every kernel of its plan that differs in time, once."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pandas as pd

from phongbench.accuracy.probes.incidence import native
from phongbench.accuracy.sweep import Sweep
from phongbench.compiler.lowering import FLOAT32, precision_named
from phongbench.errors import BudgetError
from phongbench.formulas.recipes import PAIR
from phongbench.formulas.spec import Approximation
from phongbench.inputs.plan import Cell
from phongbench.results.schema import INCIDENCE_TIMES
from phongbench.support.process import cores
from phongbench.support.progress import Progress, Reached
from phongbench.timing import reflectance_times, skip_kernels
from phongbench.timing.machine_lock import machine_lock
from phongbench.timing.processes import measure_in_processes
from phongbench.timing.timed_kernels import timed_formulas

#: a budget that is too short is replaced by so much more than what it takes
STRETCH = 1.5


def time_all(sweep: Sweep, progress: Progress) -> dict[str, pd.DataFrame]:
    """The tables of times: of every kernel, and of formulas of reflectance where the plan asks for their errors."""
    tables = {"timing": time_kernels(sweep, progress)}
    if "incidence" in sweep.plan.probes:
        progress.stage("timing reflectances")
        with machine_lock():
            timed = (reflectance_times.measure(precision, sweep.plan.seed) for precision in native(sweep.plan))
            rows = [row for rows in timed for row in rows]
        tables["incidence_times"] = INCIDENCE_TIMES.frame(rows)
    return tables


def time_kernels(sweep: Sweep, progress: Progress) -> pd.DataFrame:
    """The rows of timing.parquet; what could not be timed, and a budget that had to grow, are notes of the progress."""
    plan, specs = sweep.plan, sweep.registry
    cells = [cell for at, cell in enumerate(sweep.cells) if cell.gated and at not in sweep.failures]
    cells = cells if any(map(_timeable, cells)) else _in_float32(cells, progress)
    timed = timed_formulas(
        (c for c in cells if c.formula.raw or c.formula.space == specs[c.approximation].spaces[0]), specs
    )
    options: dict[str, Any] = {
        "processes": plan.processes,
        "seed": plan.seed,
        "threads": (1, 2) if cores() > 1 else (1,),
        "lit": skip_kernels.LIT if plan.skipping else (),
    }

    def enough(short: BudgetError) -> float:  # known only after the sweep, which must not be lost: so it gives way
        seconds = STRETCH * short.needed
        progress.note(f"{short.what}; it may take {seconds:.0f} s")
        return seconds

    progress.stage("timing", 1.0)
    timing = measure_in_processes(
        timed, budget_seconds=plan.timing_budget, progress=Reached(progress), on_short=enough, **options
    )
    for note in timing.notes:
        progress.detail(note)
    for problem in timing.problems:
        progress.note(f"not timed: {problem}")
    return _in_every_space(timing.rows, specs)


def _timeable(cell: Cell) -> bool:
    return not precision_named(cell.precision).rounds


def _in_float32(cells: list[Cell], progress: Progress) -> list[Cell]:
    """The formulas in float32, where all that was measured is emulated: its own time would say nothing."""
    emulated = ", ".join(dict.fromkeys(cell.precision for cell in cells))
    progress.note(f"{emulated}: emulated here, so the same formulas are timed in {FLOAT32.name}")
    return [replace(cell, precision=FLOAT32.name) for cell in cells]


def _in_every_space(rows: pd.DataFrame, specs: Mapping[str, Approximation]) -> pd.DataFrame:
    """The rows with those of further spaces added: on (N, H) the same code runs as on (R, V), so it was timed once."""
    frames, pairs = [rows], rows[(rows["recipe"] == PAIR) & (rows["normalise"] == "none")]
    for spec in specs.values():
        frames += [pairs[pairs["approximation"] == spec.name].assign(space=space) for space in spec.spaces[1:]]
    return pd.concat(frames, ignore_index=True).astype(rows.dtypes)
