"""Errors of values that another device computed: the sweep's metrics, of arrays that are there."""

import numpy as np

from phongbench.accuracy.accumulators import (
    ABOVE,
    ABOVE_ONE,
    BELOW,
    BINS,
    BINS_PER_OCTAVE,
    EXCLUDED,
    LOWEST_EXPONENT,
    NEGATIVE,
    NONFINITE,
    SUM,
    SUM_ABS,
    SUM_SQUARES,
    ErrorAccumulator,
)
from phongbench.compiler.precisions import Array

#: bits of a float32 below its bin: sign, exponent and the first three of the fraction are above
_BELOW_BIN = 20
_FIRST_BIN = (127 + LOWEST_EXPONENT) * BINS_PER_OCTAVE - 1


def errors_of(values: Array, exact: Array, a: Array, b: Array) -> ErrorAccumulator:
    """One cell's errors, a row for each truth.

    values  float32 (n,)          what the device gave
    exact   float64 (truths, n)   exact Phong
    a, b    (3, n)                the pairs

    Samples without a finite value or truth are excluded, and counted, as in the sweep. What part of an error is whose
    is not asked: the parts are of the formula and the rounding of this machine.
    """
    found = ErrorAccumulator(len(exact))
    found.samples = len(values)
    held = values.astype(np.float64)
    found.counts[:, ABOVE_ONE], found.counts[:, NEGATIVE] = np.count_nonzero(held > 1), np.count_nonzero(held < 0)
    found.counts[:, NONFINITE] = np.count_nonzero(~np.isfinite(held))
    for row, truth in enumerate(exact):
        _add(found, row, held, truth, a, b)
    return found


def _add(found: ErrorAccumulator, row: int, held: Array, truth: Array, a: Array, b: Array) -> None:
    kept = np.flatnonzero(np.isfinite(held) & np.isfinite(truth))
    found.counts[row, EXCLUDED] = len(held) - len(kept)
    if not len(kept):
        return
    error = held[kept] - truth[kept]
    found.sums[row, [SUM, SUM_ABS, SUM_SQUARES]] = error.sum(), np.abs(error).sum(), np.square(error).sum()
    found.sums[row, [ABOVE, BELOW]] = max(0.0, error.max()), max(0.0, -error.min())
    place = (np.abs(error).astype(np.float32).view(np.int32) >> _BELOW_BIN) - _FIRST_BIN
    found.bins[row] = np.bincount(np.clip(place, 0, BINS - 1), minlength=BINS)
    worst = kept[np.argmax(np.abs(error))]
    numbers = abs(held[worst] - truth[worst]), truth[worst], held[worst]
    found.worst[row] = *numbers, *a[:3, worst], *b[:3, worst]
