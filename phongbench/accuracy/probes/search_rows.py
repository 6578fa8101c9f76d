"""What a search has found, as rows of accuracy and of worst."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from phongbench.accuracy import tables
from phongbench.accuracy.probes.consistency import VECTORS
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.compiler.precisions import Array
from phongbench.results.schema import ACCURACY, WORST


@dataclass(frozen=True)
class Worst:
    """The worst pair of a cell.

    position     of the cell in the sweep
    longest      how many times as long, or short, as 1 its vectors may be; 1 where they are nearly unit
    error        |value - exact|, with value and exact Phong beside it
    pair         float64 (6,), a then b
    place        where stage 1 ended: seeds the neighbour
    evaluations  pairs that were looked at
    """

    position: int
    longest: float
    error: float
    exact: float
    value: float
    pair: Array
    place: Array
    evaluations: int


def accuracy(context: ProbeContext, results: Sequence[Worst]) -> pd.DataFrame:
    """Rows of accuracy, of coverage searched: a largest error, and no other metric."""
    frame = _keys(context, results)
    errors = np.array([f.error for f in results])
    frame["samples"] = [f.evaluations for f in results]
    frame["max_abs"], frame["codes_8bit"] = errors, 255 * errors
    above = np.array([f.value > f.exact for f in results])
    frame["max_above"], frame["max_below"] = np.where(above, errors, np.nan), np.where(above, np.nan, errors)
    for count in ("nonfinite", "above_one", "negative", "excluded"):
        frame[count] = 0
    return frame.reindex(columns=ACCURACY.names)


def worst(context: ProbeContext, results: Sequence[Worst]) -> pd.DataFrame:
    """Their worst inputs."""
    frame = _keys(context, results)
    frame["rank"] = 1
    for name in ("error", "exact", "value"):
        frame[name] = [getattr(f, name) for f in results]
    for k, name in enumerate(("ax", "ay", "az", "bx", "by", "bz")):
        frame[name] = pd.Series([float(f.pair[k]).hex() for f in results], dtype="str")
    return frame[WORST.names]


def _keys(context: ProbeContext, results: Sequence[Worst]) -> pd.DataFrame:
    frame = tables.of_cells(context.sweep, np.array([f.position for f in results]))
    lengths = np.array([f.longest - 1 for f in results])
    frame["perturbation"] = pd.Series(["any" if f.longest > 1 else "none" for f in results], dtype="str")
    return frame.assign(stratum=VECTORS, length_error=lengths, truth="angle", coverage="searched")
