"""How wrong: the metrics, and the streaming, mergeable accumulators they are read from; measure.py fills them."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from phongbench.compiler.precisions import Array

# positions in a row of sums
SUM, SUM_ABS, SUM_SQUARES, ABOVE, BELOW, MODEL, LENGTH, ROUNDING = range(8)
# positions in a row of counts
EXCLUDED, NONFINITE, ABOVE_ONE, NEGATIVE = range(4)
# positions in a row of the worst input: error, exact, value, a, b
WORST_FIELDS = 9

#: histogram bins: eight to an octave of |error|, from 2^-40 to 2^3; the first holds everything smaller
BINS_PER_OCTAVE = 8
LOWEST_EXPONENT, HIGHEST_EXPONENT = -40, 3
BINS = (HIGHEST_EXPONENT - LOWEST_EXPONENT) * BINS_PER_OCTAVE + 1


#: the arrays of an accumulator, by name
ARRAYS = ("sums", "counts", "bins", "worst")


class ErrorAccumulator:
    """Accumulated errors of many rows: mergeable in any grouping, in a fixed order for the same bits.

    sums    float64 (rows, 8)       sum, |sum|, squares; largest above and below; largest model, length and rounding
            part
    counts  int64   (rows, 4)       excluded samples, non-finite values, values above one, negative values
    bins    int64   (rows, BINS)    histogram of |error| over every second chunk of pairs
    worst   float64 (rows, 9)       error, exact, value, a, b of the largest |error|
    samples int                     pairs seen; an array where accumulators of different samples are stacked
    """

    def __init__(self, rows: int) -> None:
        self.sums = np.zeros((rows, 8))
        self.counts = np.zeros((rows, 4), np.int64)
        self.bins = np.zeros((rows, BINS), np.int64)
        self.worst = np.zeros((rows, WORST_FIELDS))
        self.worst[:, 0] = -1.0
        self.samples: int | Array = 0
        self._cumulated: tuple[Array, Array, Array] | None = None

    @staticmethod
    def stacked(errors: Sequence["ErrorAccumulator"]) -> "ErrorAccumulator":
        """The rows of several accumulators below one another; `samples` is then an array, one number for each row."""
        whole = ErrorAccumulator(0)
        for name in ARRAYS:
            setattr(whole, name, np.concatenate([getattr(t, name) for t in errors]))
        whole.samples = np.repeat([t.samples for t in errors], [len(t.sums) for t in errors])
        return whole

    def merge(self, later: "ErrorAccumulator") -> None:
        """Add the errors of the same rows over the samples that follow."""
        self.sums[:, :ABOVE] += later.sums[:, :ABOVE]
        np.maximum(self.sums[:, ABOVE:], later.sums[:, ABOVE:], out=self.sums[:, ABOVE:])
        self.counts += later.counts
        self.bins += later.bins
        self._cumulated = None
        worse = later.worst[:, 0] > self.worst[:, 0]
        self.worst[worse] = later.worst[worse]
        self.samples += later.samples

    @property
    def valid(self) -> Array:
        """Samples that entered the error statistics, per row."""
        return np.asarray(self.samples - self.counts[:, EXCLUDED])

    def mean(self, position: int) -> Array:
        """A sum over its samples; NaN where there are none."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(self.sums[:, position] / self.valid)

    def quantile(self, q: float) -> Array:
        """The q-quantile of |error|, linear within its histogram bin; never above the largest error."""
        octave, step = np.divmod(np.arange(BINS), BINS_PER_OCTAVE)
        edges = np.concatenate([[0.0], np.ldexp(1 + step / BINS_PER_OCTAVE, LOWEST_EXPONENT + octave)])
        reached, before, total = self._reached()
        wanted = q * total
        rows = np.arange(len(total))
        # one search in all rows at once: counts never fall from one row to the next
        index = np.clip(np.searchsorted(reached, before + np.ceil(wanted).astype(np.int64)) - BINS * rows, 0, BINS - 1)
        inside = self.bins[rows, index]
        below = reached[BINS * rows + index] - before - inside
        share = np.where(inside > 0, (wanted - below) / np.maximum(inside, 1), 0.0)
        value = edges[index] + share * (edges[index + 1] - edges[index])
        return np.where(total > 0, np.minimum(value, self.max_abs), np.nan)

    def _reached(self) -> tuple[Array, Array, Array]:
        """Errors counted up to and including each bin, row after row, those of the rows before each, and of each row.

        Kept, since three quantiles ask for them.
        """
        if self._cumulated is None:
            counted = np.cumsum(self.bins)
            ends = counted[BINS - 1 :: BINS]
            total = np.diff(ends, prepend=0)
            self._cumulated = counted, ends - total, total
        return self._cumulated

    @property
    def max_abs(self) -> Array:
        """The largest |error|."""
        return np.asarray(self.sums[:, ABOVE : BELOW + 1].max(axis=1))


#: the metrics of accuracy rows, as results.schema describes them: each a column, made of an ErrorAccumulator
METRICS: Mapping[str, Callable[[ErrorAccumulator], Array]] = {
    "max_abs": lambda t: t.max_abs,
    "mean_abs": lambda t: t.mean(SUM_ABS),
    "rms": lambda t: np.asarray(np.sqrt(t.mean(SUM_SQUARES))),
    "bias": lambda t: t.mean(SUM),
    "p50_abs": lambda t: t.quantile(0.5),
    "p99_abs": lambda t: t.quantile(0.99),
    "p999_abs": lambda t: t.quantile(0.999),
    "max_above": lambda t: t.sums[:, ABOVE],
    "max_below": lambda t: t.sums[:, BELOW],
    "codes_8bit": lambda t: 255 * np.minimum(t.max_abs, 1e300),
    "model_max": lambda t: t.sums[:, MODEL],
    "length_max": lambda t: t.sums[:, LENGTH],
    "rounding_max": lambda t: t.sums[:, ROUNDING],
    "nonfinite": lambda t: t.counts[:, NONFINITE],
    "above_one": lambda t: t.counts[:, ABOVE_ONE],
    "negative": lambda t: t.counts[:, NEGATIVE],
}
