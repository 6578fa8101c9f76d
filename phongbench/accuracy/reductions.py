"""The compiled inner loops of the sweep: what happens to a piece of pairs for every cell.

For a chunk of pairs and a cell: values in the working precision, the same formula in float64 on the given vectors and
on the unit directions, then error sums, maxima and a histogram. What keeps it in vector lanes, each measured against
the obvious way:

- maxima are taken over the bits of the floats, which order like integers (float maxima are not vectorised: 1.7 ns
  against 0.45);
- the histogram bin is the top bits of the error, and counting goes into four copies in turn (0.27 ns against 0.58);
- the worst sample is looked for by the error that is known to be the largest (0.09 ns against 0.27);
- a chunk in which anything is not finite shows as a maximum beyond infinity's bits and is done again carefully, so the
  fast path never asks;
- loops have few arrays each: past a handful, LLVM gives up proving that they do not overlap.
"""

from typing import Any

import numpy as np

from phongbench.accuracy.accumulators import (
    ABOVE,
    ABOVE_ONE,
    BELOW,
    BINS,
    BINS_PER_OCTAVE,
    EXCLUDED,
    LENGTH,
    LOWEST_EXPONENT,
    MODEL,
    NEGATIVE,
    NONFINITE,
    ROUNDING,
    SUM,
    SUM_ABS,
    SUM_SQUARES,
)
from phongbench.compiler import intrinsics, jit
from phongbench.formulas.coordinate_kernels import values_at

#: pairs handled together: few enough for the buffers to stay in the nearest caches, enough to hide the cost of the
#: calls
CHUNK = 4096

_BIN_SHIFT = np.int32(20)
_FIRST_BIN = np.int32((127 + LOWEST_EXPONENT) * BINS_PER_OCTAVE - 1)
_LAST_BIN, _NO_BIN = np.int32(BINS - 1), np.int32(0)
_MAGNITUDE, _SIGN = np.int64(0x7FFFFFFFFFFFFFFF), np.int64(-(2**63))
_INFINITE = np.int64(0x7FF0000000000000)
_STEP_1, _STEP_2, _STEP_3, _STEP_4 = np.uint64(1), np.uint64(2), np.uint64(3), np.uint64(4)
_ONCE, _NEVER = np.uint16(1), np.uint16(0)
#: errors compared with the largest at once
_STRETCH = 64


@jit.reduction
def _census(values: Any, counts: Any) -> None:
    """Count values above one and below zero."""
    above, negative = np.int32(0), np.int32(0)
    for i in range(len(values)):
        above = np.int32(above + np.int32(values[i] > np.float32(1.0)))
        negative = np.int32(negative + np.int32(values[i] < np.float32(0.0)))
    counts[ABOVE_ONE] += above
    counts[NEGATIVE] += negative


@jit.inline
def _raise(sums: Any, position: Any, bits: Any) -> None:
    sums[position] = max(sums[position], intrinsics.float64_from_bits(bits))


@jit.reduction
def _reduce(values: Any, given: Any, unit: Any, exact: Any, errors: Any, sums: Any) -> bool:
    """Add a chunk against the `angle` truth and write its errors.

    False, with sums untouched, if anything is not finite.
    """
    total, absolute, squares = 0.0, 0.0, 0.0
    above, below, model, length, rounding = np.int64(0), np.int64(0), np.int64(0), np.int64(0), np.int64(0)
    for i in range(len(values)):
        value = np.float64(values[i])
        error = value - exact[i]
        bits = intrinsics.float64_bits(error)
        errors[i] = np.float32(error)
        total += error
        absolute += abs(error)
        squares += error * error
        above = max(above, bits)
        below = max(below, bits ^ _SIGN)
        model = max(model, intrinsics.float64_bits(unit[i] - exact[i]) & _MAGNITUDE)
        length = max(length, intrinsics.float64_bits(given[i] - unit[i]) & _MAGNITUDE)
        rounding = max(rounding, intrinsics.float64_bits(value - given[i]) & _MAGNITUDE)
    if max(above, below, model, length, rounding) >= _INFINITE:
        return False
    sums[SUM] += total
    sums[SUM_ABS] += absolute
    sums[SUM_SQUARES] += squares
    _raise(sums, ABOVE, above)
    _raise(sums, BELOW, below)
    _raise(sums, MODEL, model)
    _raise(sums, LENGTH, length)
    _raise(sums, ROUNDING, rounding)
    return True


@jit.reduction
def _reduce_given(values: Any, given: Any, unit: Any, exact: Any, angle: Any, errors: Any, sums: Any) -> bool:
    """Add a chunk against the `given` truth, as `_reduce` does.

    Its length part is how differently the formula and Phong itself respond to the lengths, so the three parts still add
    up to the error. Model and rounding parts are those of the `angle` row.
    """
    total, absolute, squares = 0.0, 0.0, 0.0
    above, below, length = np.int64(0), np.int64(0), np.int64(0)
    for i in range(len(values)):
        error = np.float64(values[i]) - exact[i]
        bits = intrinsics.float64_bits(error)
        errors[i] = np.float32(error)
        total += error
        absolute += abs(error)
        squares += error * error
        above = max(above, bits)
        below = max(below, bits ^ _SIGN)
        length = max(length, intrinsics.float64_bits((given[i] - unit[i]) - (exact[i] - angle[i])) & _MAGNITUDE)
    if max(above, below, length) >= _INFINITE:
        return False
    sums[SUM] += total
    sums[SUM_ABS] += absolute
    sums[SUM_SQUARES] += squares
    _raise(sums, ABOVE, above)
    _raise(sums, BELOW, below)
    _raise(sums, LENGTH, length)
    return True


@jit.driver
def _clean(values: Any, given: Any, unit: Any, exact: Any, angle: Any, counts: Any) -> int:
    """Take samples with anything non-finite out of a chunk: their parts become 0 and they are counted as excluded.

    How many.
    """
    before = counts[EXCLUDED]
    for i in range(len(values)):
        value = np.float64(values[i])
        if not np.isfinite(value):
            counts[NONFINITE] += 1
        if not np.isfinite(value + given[i] + unit[i] + exact[i] + angle[i]):
            values[i] = 0
            given[i] = unit[i] = exact[i] = angle[i] = 0.0
            counts[EXCLUDED] += 1
    return int(counts[EXCLUDED] - before)


@jit.driver
def _bin_indices(errors: Any, indices: Any) -> None:
    for i in range(len(errors)):
        position = np.int32((intrinsics.float32_bits(abs(errors[i])) >> _BIN_SHIFT) - _FIRST_BIN)
        indices[i] = np.uint32(min(max(position, _NO_BIN), _LAST_BIN))


@jit.driver
def _fill_bins(indices: Any, copies: Any, bins: Any) -> None:
    """Count into four copies in turn: equal neighbours would otherwise wait for one another's store.

    A copy holds a chunk's counts at most, so 16 bits are enough, and adding the copies up takes half the time.
    """
    first, second, third, fourth = copies[0], copies[1], copies[2], copies[3]
    n = len(indices)
    whole, i = np.uint64(n - n % 4), np.uint64(0)
    while i < whole:
        first[indices[i]] += _ONCE
        second[indices[i + _STEP_1]] += _ONCE
        third[indices[i + _STEP_2]] += _ONCE
        fourth[indices[i + _STEP_3]] += _ONCE
        i += _STEP_4
    while i < np.uint64(n):
        first[indices[i]] += _ONCE
        i += _STEP_1
    for j in range(BINS):
        bins[j] += np.int64(first[j]) + np.int64(second[j]) + np.int64(third[j]) + np.int64(fourth[j])
        first[j] = second[j] = third[j] = fourth[j] = _NEVER


@jit.driver
def _find_worst(values: Any, exact: Any, errors: Any, a: Any, b: Any, offset: int, largest: float, worst: Any) -> None:
    """Remember the first sample of the chunk whose |error| is the largest, which is known; errors are rounded ones.

    One by one goes only the stretch that holds it: a loop that counts is in vector lanes, one that stops is not.
    """
    rounded, n = np.float32(largest), len(errors)
    for start in range(0, n, _STRETCH):
        stop, alike = min(start + _STRETCH, n), np.int32(0)
        for i in range(start, stop):
            alike = np.int32(alike + np.int32(abs(errors[i]) == rounded))
        if alike:
            for i in range(start, stop):
                if abs(np.float64(values[i]) - exact[i]) == largest:
                    worst[0], worst[1], worst[2] = largest, exact[i], values[i]
                    for row in range(3):
                        worst[3 + row] = a[row, offset + i]
                        worst[6 + row] = b[row, offset + i]
                    return


@jit.driver
def _add(truth: int, values: Any, given: Any, unit: Any, exact: Any, angle: Any, errors: Any, sums: Any) -> bool:
    """Add a chunk against one truth; False if it must be cleaned first."""
    if truth == 0:
        return _reduce(values, given, unit, exact, errors, sums)
    return _reduce_given(values, given, unit, exact, angle, errors, sums)


# sixteen arrays: what `CellArrays.measure` keeps together, compiled code can only take one by one
@jit.driver
def measure_cells(
    rows: Any,
    coefficients: Any,
    coefficients_64: Any,
    tables: Any,
    tables_64: Any,
    a: Any,
    b: Any,
    held: Any,
    given: Any,
    unit: Any,
    exact: Any,
    sums: Any,
    counts: Any,
    bins: Any,
    worst: Any,
    truths: int,
) -> None:
    """Measure cells over one piece of pairs.

    rows .. tables_64, truths   of a `CellArrays`
    a .. exact                  a `Piece`
    sums .. worst               of an `ErrorAccumulator`
    """
    n = held.shape[1]
    values, given_values, unit_values = np.empty(CHUNK, held.dtype), np.empty(CHUNK), np.empty(CHUNK)
    errors, indices, copies = np.empty(CHUNK, np.float32), np.empty(CHUNK, np.uint32), np.zeros((4, BINS), np.uint16)
    for start in range(0, n, CHUNK):
        stop = min(start + CHUNK, n)
        size = stop - start
        binned = start % (2 * CHUNK) == 0
        v, g, u, e, ix = values[:size], given_values[:size], unit_values[:size], errors[:size], indices[:size]
        for cell in range(len(rows)):
            form, gate, alpha, row = rows[cell, 0], rows[cell, 1], rows[cell, 2], rows[cell, 3]
            kernel, kernel_64 = values_at(rows[cell, 4], held), values_at(rows[cell, 5], given)
            table, table_64 = tables[rows[cell, 6] : rows[cell, 7]], tables_64[rows[cell, 6] : rows[cell, 7]]
            kernel(held[form, start:stop], held[gate, start:stop], coefficients[cell], table, v)
            kernel_64(given[form, start:stop], given[gate, start:stop], coefficients_64[cell], table_64, g)
            kernel_64(unit[form, start:stop], unit[gate, start:stop], coefficients_64[cell], table_64, u)
            _census(v, counts[row])
            angle = exact[alpha, 0, start:stop]
            for truth in range(truths):
                t, v2, target = row + truth, v, exact[alpha, truth, start:stop]
                excluded = 0
                if not _add(truth, v, g, u, target, angle, e, sums[t]):
                    v2, g2, u2, angle2 = v.copy(), g.copy(), u.copy(), angle.copy()
                    target = target.copy()
                    excluded = _clean(v2, g2, u2, target, angle2, counts[t])
                    _add(truth, v2, g2, u2, target, angle2, e, sums[t])
                if binned:
                    _bin_indices(e, ix)
                    _fill_bins(ix, copies, bins[t])
                    bins[t, 0] -= excluded
                largest = max(sums[t, ABOVE], sums[t, BELOW])
                if largest > worst[t, 0]:
                    _find_worst(v2, target, e, a, b, start, largest, worst[t])
            if truths == 2:
                # one by one: for a slice numba compiles what words a mismatch of shapes, a third of all there is here
                counts[row + 1, ABOVE_ONE], counts[row + 1, NEGATIVE] = counts[row, ABOVE_ONE], counts[row, NEGATIVE]
                sums[row + 1, MODEL], sums[row + 1, ROUNDING] = sums[row, MODEL], sums[row, ROUNDING]
