"""The yardstick: the same cells measured by plain vectorised NumPy, the way one would write it in an afternoon.

It is what the sweep's throughput is compared with (`make bench`), and a second oracle: its formulas are written here
again, on purpose, by other means, and the tests hold its rows against the engine's.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from phongbench.accuracy import sweep
from phongbench.accuracy.batches import Batch
from phongbench.compiler.precisions import Array
from phongbench.formulas.exact import TRUTHS
from phongbench.formulas.slopes import beta, sharpness
from phongbench.inputs.plan import Cell, Plan, preset
from phongbench.results.schema import ACCURACY, CPU
from phongbench.timing.interleaved import clocked, interleaved
from phongbench.timing.statistics import MIN_ROUNDS


def _phong(x: Array, deficit: Array, cell: Cell) -> Array:
    return np.asarray(np.maximum(x, 0) ** x.dtype.type(cell.alpha))


def _lyon(x: Array, deficit: Array, cell: Cell) -> Array:
    gamma = cell.formula.gamma or 1
    slope = x.dtype.type(beta(cell.setting.slope, cell.setting.exponent, gamma))
    return np.asarray(np.maximum(1 - slope * deficit, 0) ** x.dtype.type(gamma))


def _gaussian(x: Array, deficit: Array, cell: Cell) -> Array:
    return np.asarray(np.exp(-x.dtype.type(sharpness(cell.setting.slope, cell.setting.exponent)) * deficit))


FORMULAS: Mapping[str, Callable[[Array, Array, Cell], Array]] = {"phong": _phong, "lyon": _lyon, "gaussian": _gaussian}


def plan_of_bench(samples: int = 1 << 17) -> Plan:
    """A small float32 plan of the formulas known here."""
    return replace(
        preset("quick"),
        approximations=tuple(FORMULAS),
        precisions=("float32",),
        spaces=("reflect",),
        alphas=(10.0, 50.0, 200.0),
        strata=("uniform", "highlight", "peak", "grazing"),
        samples=samples,
        timing=False,
        raw=(),
    ).validated()


def numpy_sweep(prepared: sweep.Sweep) -> list[dict[str, Any]]:
    """Rows with the keys and metrics of accuracy.parquet (reflect space), by NumPy on whole arrays."""
    rows = []
    for batch in prepared.batches:
        a, b = batch.pairs(prepared.plan.seed, 0, batch.samples)
        given = a.astype(np.float64), b.astype(np.float64)
        unit = given[0] / np.sqrt((given[0] ** 2).sum(axis=0)), given[1] / np.sqrt((given[1] ** 2).sum(axis=0))
        for position in batch.cells:
            cell = prepared.cells[position]
            value, in_double, on_unit = (_value(v[0], v[1], cell) for v in ((a, b), given, unit))
            angle = np.maximum((unit[0] * unit[1]).sum(axis=0), 0) ** cell.alpha
            length = np.maximum((given[0] * given[1]).sum(axis=0), 0) ** cell.alpha
            for truth, exact in zip(TRUTHS[: batch.truths], (angle, length), strict=False):
                rows.append(_key(cell, batch, truth) | _metrics(value, in_double, on_unit, exact, angle))
    return rows


def _value(a: Array, b: Array, cell: Cell) -> Array:
    x = (a * b).sum(axis=0)
    match cell.lambda_form:
        case "difference":
            deficit = ((a - b) ** 2).sum(axis=0) / 2
        case "cross":
            deficit = (np.cross(a, b, axis=0) ** 2).sum(axis=0) / 2
        case _:
            deficit = 1 - x
    value = FORMULAS[cell.approximation](x, deficit, cell)
    return np.where(x > 0, value, 0) if cell.gated else value


def _metrics(value: Array, in_double: Array, on_unit: Array, exact: Array, angle: Array) -> dict[str, float]:
    error = value.astype(np.float64) - exact
    size = np.abs(error)
    p50, p99, p999 = np.quantile(size, (0.5, 0.99, 0.999))
    return {
        "max_abs": size.max(),
        "mean_abs": size.mean(),
        "rms": np.sqrt((size**2).mean()),
        "bias": error.mean(),
        "p50_abs": p50,
        "p99_abs": p99,
        "p999_abs": p999,
        "max_above": max(error.max(), 0),
        "max_below": max(-error.min(), 0),
        "model_max": np.abs(on_unit - angle).max(),
        "length_max": np.abs(in_double - on_unit - exact + angle).max(),
        "rounding_max": np.abs(value - in_double).max(),
        "nonfinite": (~np.isfinite(value)).sum(),
        "above_one": (value > 1).sum(),
        "negative": (value < 0).sum(),
    }


def _key(cell: Cell, batch: Batch, truth: str) -> dict[str, Any]:
    f, s = cell.formula, batch.stratum
    of_cell = (f.approximation, f.lambda_form, f.space, f.slope, cell.alpha, f.gamma, cell.precision, cell.gated)
    of_batch = (s.name, s.perturbation, s.length_error, truth, "sampled", CPU)
    return dict(zip(ACCURACY.key, (*of_cell, f.recipe, f.normalise, *of_batch), strict=True))


def throughput(samples: int = 1 << 17, repeats: int = MIN_ROUNDS) -> dict[str, Any]:
    """Evaluations per second of the sweep and of plain NumPy over the same cells, one thread each, by the least times.

    ratio  how many times as many the sweep does: the median over the rounds, with the ends of its interval
    """
    prepared = sweep.prepare(plan_of_bench(samples))
    small = sweep.prepare(plan_of_bench(1 << 14))
    sweep.compile_kernels(prepared)
    list(sweep.run(small))
    calls = {"ours": lambda: list(sweep.run(prepared)), "numpy": lambda: numpy_sweep(small)}
    times = interleaved({name: clocked(call) for name, call in calls.items()}, rounds=repeats)
    fast, plain = prepared.evaluations / times.seconds("ours"), small.evaluations / times.seconds("numpy")
    times_as_long = times.row("numpy", "ours")
    more = prepared.evaluations / small.evaluations
    return {
        "evaluations_per_second": fast,
        "numpy_evaluations_per_second": plain,
        "rounds": times_as_long["rounds"],
        **{name: end and more * end for name, end in times_as_long.items() if name.startswith("ratio")},
    }
