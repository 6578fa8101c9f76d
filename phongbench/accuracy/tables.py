"""From accumulated errors to tables.

The numeric part a finished batch leaves behind, and the rows of accuracy and worst made of all parts.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from phongbench.accuracy.accumulators import EXCLUDED, METRICS, WORST_FIELDS, ErrorAccumulator
from phongbench.accuracy.sweep import Measured, Sweep
from phongbench.formulas.exact import TRUTHS
from phongbench.formulas.recipes import PAIR
from phongbench.results.schema import ACCURACY, CPU, WORST

#: worst inputs kept per cell: of unit vectors, of wrong lengths, of hostile ones; the last would crowd out the rest
WORST_KEPT = {"unit": 3, "lengths": 1, "hostile": 1}
#: what of a part they are chosen from
_WORST_COLUMNS = ["batch", "cell", "truth", *(f"worst{i}" for i in range(WORST_FIELDS))]


def part(measured: Sequence[Measured]) -> pd.DataFrame:
    """The numbers of some batches: index, cell positions and truths, every metric, and the worst input of each row.

    Many batches at once, because most are small and each metric is a call.
    """
    errors = ErrorAccumulator.stacked([m.errors for m in measured])
    columns: dict[str, NDArray[Any]] = {
        "batch": np.concatenate([np.full(m.rows, m.batch.index, np.int32) for m in measured]),
        "cell": np.concatenate([np.repeat(np.array(m.cells, np.int32), m.batch.truths) for m in measured]),
        "truth": np.concatenate([np.tile(np.arange(m.batch.truths, dtype=np.int8), len(m.cells)) for m in measured]),
        "samples": np.asarray(errors.samples, np.int64),
    }
    columns |= {name: metric(errors) for name, metric in METRICS.items()}
    columns["excluded"] = errors.counts[:, EXCLUDED]
    columns |= {f"worst{i}": errors.worst[:, i] for i in range(WORST_FIELDS)}
    return pd.DataFrame(columns)


def accuracy(sweep: Sweep, parts: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """The rows of accuracy.parquet, in the order of the batches."""
    numbers = pd.concat([part.drop(columns=_WORST_COLUMNS[3:]) for part in parts], ignore_index=True)
    numbers = numbers.sort_values(["batch", "cell", "truth"], kind="stable", ignore_index=True)
    frame = pd.concat([_keys(sweep, numbers), numbers.drop(columns=["batch", "cell", "truth"])], axis=1)
    frame["coverage"] = "sampled"
    # a float64 cell's rounding needs more than float64 to be seen: not measured, and not pretended to be 0
    frame.loc[frame["precision"] == "float64", "rounding_max"] = np.nan
    return frame[ACCURACY.names]


def worst(sweep: Sweep, parts: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """The rows of worst.parquet: each cell's largest errors on unit, wrongly long and hostile vectors, in hex floats.

    `rank` counts within a cell and one of these three kinds of input. Configurations of N, L and V are no pairs, so
    they are not among them.
    """
    numbers = pd.concat([part[_WORST_COLUMNS] for part in parts], ignore_index=True)
    cell, batch, truth, error = (numbers[name].to_numpy() for name in ("cell", "batch", "truth", "worst0"))
    names = sorted(WORST_KEPT)
    kinds = np.array([names.index(c.stratum.name if c.stratum.name in names else "unit") for c in sweep.batches], int)
    kind, made = kinds[batch], np.array([batch.recipe != PAIR for batch in sweep.batches], bool)[batch]
    order = np.lexsort((truth, batch, -error, -kind, cell))
    order = order[(error[order] > 0) & ~made[order]]
    own = len(names) * cell[order].astype(np.int64) + kind[order]
    first = np.flatnonzero(np.diff(own, prepend=-1))
    rank = np.arange(len(order)) - np.repeat(first, np.diff(first, append=len(order))) + 1
    kept = rank <= np.array([WORST_KEPT[name] for name in names])[kind[order]]
    numbers = numbers.iloc[order[kept]].assign(rank=rank[kept]).reset_index(drop=True)
    frame = _keys(sweep, numbers)
    frame["rank"] = numbers["rank"]
    for i, name in enumerate(("error", "exact", "value")):
        frame[name] = numbers[f"worst{i}"]
    for i, name in enumerate(("ax", "ay", "az", "bx", "by", "bz"), start=3):
        frame[name] = pd.Series([float(x).hex() for x in numbers[f"worst{i}"]], dtype="str")
    frame["coverage"] = pd.array(["sampled"] * len(frame), dtype="str")
    return frame[WORST.names]


def _keys(sweep: Sweep, numbers: pd.DataFrame) -> pd.DataFrame:
    """The key columns of each row, looked up by cell and batch."""
    batch = numbers["batch"].to_numpy()
    frame = of_cells(sweep, numbers["cell"].to_numpy())
    strata = [b.stratum for b in sweep.batches]
    frame["stratum"] = looked_up([s.name for s in strata], batch)
    frame["perturbation"] = looked_up([s.perturbation for s in strata], batch)
    frame["length_error"] = np.array([s.largest_length_error for s in strata])[batch]
    frame["truth"] = looked_up(TRUTHS, numbers["truth"].to_numpy())
    return frame


def of_cells(sweep: Sweep, positions: NDArray[Any]) -> pd.DataFrame:
    """The columns that tell cells apart, CELL_COLUMNS, for each of these positions in the sweep's cells, and device."""
    known, index = np.unique(positions, return_inverse=True)  # often few of the sweep's
    cells = [sweep.cells[position] for position in known]
    formulas = [cell.formula for cell in cells]
    columns = {
        "approximation": looked_up([f.approximation for f in formulas], index),
        "lambda_form": looked_up([f.lambda_form for f in formulas], index),
        "space": looked_up([f.space for f in formulas], index),
        "recipe": looked_up([f.recipe for f in formulas], index),
        "normalise": looked_up([f.normalise for f in formulas], index),
        "beta_policy": looked_up([str(f.slope) for f in formulas], index),
        "alpha": np.array([cell.alpha for cell in cells], np.float64)[index],
        "gamma": pd.array([f.gamma for f in formulas], dtype="Int64")[index],
        "beta": np.array([_beta(sweep, int(position)) for position in known], np.float64)[index],
        "precision": looked_up([cell.precision for cell in cells], index),
        "gated": np.array([cell.gated for cell in cells], bool)[index],
        "device": looked_up([CPU] * len(cells), index),
    }
    return pd.DataFrame(columns)


def looked_up(values: Sequence[str], index: NDArray[Any]) -> Any:
    """A column of these strings, by position."""
    return pd.array(np.array(values, dtype=object), dtype="str").take(index)


def _beta(sweep: Sweep, position: int) -> float:
    if position in sweep.failures:
        return float("nan")
    cell = sweep.cells[position]
    return float(sweep.registry[cell.approximation].coefficients(cell.setting).get("beta", np.nan))
