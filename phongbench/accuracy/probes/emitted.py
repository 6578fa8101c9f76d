"""How wrong the code is that `phongbench shader` writes: its folded constants are another rounding than the kernels'.

What runs is the code itself, its statements in NumPy, every operation rounded to nearest, in float32 and float16; once
with products rounded before they are added to a constant, and once with both as one operation, as compilers choose.

- A formula of the cosine, or of form `dot`, is given cosines: in float16 all of [-1, 1], or of half space [0, 1]; in
  float32 the PEAK nearest to 1, and SCATTERED ones below.
- The others are given pairs in a plane, at the angles that a header is told of.
"""

from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import pandas as pd

from phongbench.accuracy import tables
from phongbench.accuracy.probes import consistency, single_cells
from phongbench.accuracy.probes.contracts import meant
from phongbench.accuracy.probes.exhaustive import representables, seen
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.compiler.precisions import Array, Precision, precision_named
from phongbench.errors import InputError, KernelError
from phongbench.formulas.curves import exact
from phongbench.formulas.formula import Formula
from phongbench.formulas.shader_code.languages import GLSL, C
from phongbench.formulas.shader_code.measured import ANGLES, compiled, cosines, directions, fuses
from phongbench.inputs.plan import Cell, Plan
from phongbench.results.emitted_table import EMITTED

#: the two ways that code is written: helpers of kernels, gates and limits differ
CODES = {"gpu": GLSL, "c": C}
#: cosines in float32: all of the nearest to 1, and others
PEAK, SCATTERED = 1 << 16, 1 << 17
#: seconds that a cell takes, for the forecast only
SECONDS = 0.021


@dataclass(frozen=True)
class Inputs:
    """What code is given: pairs as the precision holds them, and what exact Phong is asked.

    a, b     (n, 3) in the type of the precision
    cosines  (n,) float64   of the angle between R and V
    """

    stratum: str
    coverage: str
    a: Array
    b: Array
    cosines: Array


def measure(context: ProbeContext) -> Mapping[str, pd.DataFrame]:
    """The table `emitted`: rows of every gated cell of a pair in float32 and float16, at the exponents nearest to 10
    and 50. Code that a language has no words for has none.
    """
    sweep = context.sweep
    work = [p for p, cell in enumerate(sweep.cells) if p not in sweep.failures and meant(cell, context.plan)]

    def of_cell(position: int) -> list[dict[str, Any]]:
        found = list(rows(context, sweep.cells[position]))
        context.advance(1 / len(work))
        return found

    with ThreadPoolExecutor(max(1, context.jobs)) as pool:
        found = list(pool.map(of_cell, work))
    positions = np.repeat(np.array(work, np.intp), [len(some) for some in found])
    if not len(positions):
        return {}
    frame = tables.of_cells(sweep, positions).join(pd.DataFrame([row for some in found for row in some]))
    frame = frame[EMITTED.names]
    context.violations += consistency.of_written_code(frame, context.accuracy)
    return {"emitted": frame}


def seconds(plan: Plan, jobs: int) -> float:
    """What the rows take."""
    return SECONDS * sum(meant(cell, plan) for cell in plan.cells()) / jobs


def rows(context: ProbeContext, cell: Cell) -> Iterator[dict[str, Any]]:
    """The columns from `code` on, of each way to write and to round a cell's formula."""
    spec, precision = cell.formula.spec(context.registry), precision_named(cell.precision)
    given = inputs(cell.formula, precision, of_cosines=seen(cell))
    truth = exact(cell.alpha, given.cosines)
    block = single_cells.coordinates(precision, given.a.T, given.b.T)
    kernel = single_cells.values(spec, cell, block).astype(np.float64)
    for name, language in CODES.items():
        written = language.in_precision(cell.precision)
        try:
            ways = (False, True) if fuses(spec, cell.formula, cell.setting, written) else (False,)
        except (InputError, KernelError):  # bits of a float16, or a constant beyond it
            continue
        for fused in ways:
            code = compiled(spec, cell.formula, cell.setting, written, limited=True, fused=fused)
            value = np.broadcast_to(code(given.a, given.b), truth.shape).astype(np.float64)
            about = {"code": name, "fused": fused, "stratum": given.stratum, "coverage": given.coverage}
            yield about | _metrics(value, truth, kernel)


@lru_cache(8)
def _cosines(precision: Precision, low: float) -> tuple[Array, str]:
    """Cosines, and how many of all they are."""
    if precision.listed:
        return representables(precision, low, 1.0).astype(precision.dtype), "exhaustive"
    peak = representables(precision, 0.5, 1.0)[-PEAK:]
    rng = np.random.default_rng(SCATTERED)
    return np.concatenate([rng.uniform(low, peak[0], SCATTERED).astype(precision.dtype), peak]), "sampled"


def inputs(formula: Formula, precision: Precision, *, of_cosines: bool) -> Inputs:
    """What the code of a formula is given."""
    half = formula.space == "half"
    if not of_cosines:
        a, b = (v.astype(precision.dtype) for v in directions(formula, 90.0 * np.linspace(0.0, 1.0, ANGLES) ** 2))
        return Inputs("angles", "sampled", a, b, cosines(formula, [a, b]))
    x, coverage = _cosines(precision, 0.0 if half else -1.0)
    a, b = np.zeros((2, len(x), 3), precision.dtype)
    a[:, 0], b[:, 0] = 1.0, x
    named = x.astype(np.float64)
    return Inputs("cosines", coverage, a, b, 2 * named**2 - 1 if half else named)


def _metrics(value: Array, truth: Array, kernel: Array) -> dict[str, Any]:
    known = np.isfinite(value)
    with np.errstate(invalid="ignore"):  # infinite less infinite
        change = np.abs(value - kernel)
    error = (value - truth)[known] if known.any() else np.full(1, np.nan)
    above, below = max(0.0, float(error.max())), max(0.0, float(-error.min()))
    return {
        "samples": len(value),
        "max_abs": max(above, below),
        "mean_abs": np.abs(error).mean(),
        "rms": np.sqrt(np.mean(error**2)),
        "bias": error.mean(),
        "max_above": above,
        "max_below": below,
        "codes_8bit": 255 * max(above, below),
        "change_max": float(np.nanmax(change, initial=0.0)),
        "nonfinite": int((~known).sum()),
        "above_one": int((value > 1).sum()),
        "negative": int((value < 0).sum()),
    }
