"""What no conforming device exceeds, of every formula of a study, in float32 and float16.

Rows have coverage `contract` and stratum `devices`: max_abs is the bound of the emitted code (enclosures/contract),
with a limit for over-long vectors or without, on all pairs that a device itself made unit. All other metrics are
missing, since nothing was sampled. What the standards leave open, a division by what may be 0 say, has no row.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from phongbench.accuracy import tables
from phongbench.accuracy.enclosures import contract
from phongbench.accuracy.enclosures.bounds import NotEnclosedError
from phongbench.accuracy.enclosures.devices import PRECISIONS
from phongbench.accuracy.probes.consistency import DEVICES
from phongbench.accuracy.probes.exhaustive import nearest_to
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.compiler.precisions import precision_named
from phongbench.inputs.plan import Cell, Plan
from phongbench.results.schema import ACCURACY

#: seconds that a bound takes, for the forecast only
SECONDS = 0.017


def measure(context: ProbeContext) -> Mapping[str, pd.DataFrame]:
    """Rows of the bounded cells; a note says how many have no bound."""
    sweep = context.sweep
    work = [p for p, cell in enumerate(sweep.cells) if p not in sweep.failures and meant(cell, context.plan)]
    held, reasons = list[tuple[int, float]](), Counter[str]()
    for position in work:
        bound = _bound(context, sweep.cells[position])
        if math.isfinite(bound):
            held.append((position, bound))
        else:
            reasons[_reason(context, sweep.cells[position])] += 1
        context.advance(1 / len(work))
    if reasons:
        why = "; ".join(f"{reason} ({count})" for reason, count in reasons.most_common())
        context.detail(f"{reasons.total()} of {len(work)} cells have no bound by contract: {why}")
    if not held:
        return {}
    positions, errors = np.array([p for p, _ in held]), np.array([bound for _, bound in held])
    about: dict[str, Any] = {"stratum": DEVICES, "perturbation": "none", "length_error": 0.0, "truth": "angle"}
    about["coverage"] = "contract"
    counts = dict.fromkeys(("samples", "nonfinite", "above_one", "negative", "excluded"), 0)
    frame = tables.of_cells(sweep, positions).assign(**about, **counts, max_abs=errors, codes_8bit=255 * errors)
    return {"accuracy": frame.reindex(columns=ACCURACY.names)}


def seconds(plan: Plan, jobs: int) -> float:
    """What the bounds take, on one core."""
    return SECONDS * sum(1 for _ in _cells(plan))


def _cells(plan: Plan) -> Iterator[Cell]:
    return (cell for cell in plan.cells() if meant(cell, plan))


def meant(cell: Cell, plan: Plan) -> bool:
    """Gated cells of pairs, in precisions that the standards speak of, at the exponents nearest to 10 and 50."""
    known = cell.gated and not cell.formula.raw and cell.precision in PRECISIONS
    return known and cell.alpha in nearest_to(plan.alphas)


def _reason(context: ProbeContext, cell: Cell) -> str:
    spec, precision = cell.formula.spec(context.registry), precision_named(cell.precision)
    return contract.why_not(spec, cell.formula, cell.setting, precision)


def _bound(context: ProbeContext, cell: Cell) -> float:
    spec, precision = cell.formula.spec(context.registry), precision_named(cell.precision)
    try:
        return contract.largest(spec, cell.formula, cell.setting, precision, limited=False)
    except NotEnclosedError:
        return math.inf
