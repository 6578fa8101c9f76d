"""How wrong: the metrics, and the streaming, mergeable accumulators they are read from; measure.py fills them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

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


@dataclass(frozen=True, slots=True)
class Metric:
    """One column of the accuracy table that a front or a comparison may ask for.

    name       column
    unit       "1" for highlight factors, "codes" for 8-bit steps, "count"
    lower      True if lower is better
    of         ErrorAccumulator -> the column, one number a row
    meaning    for people
    """

    name: str
    unit: str
    of: Callable[["ErrorAccumulator"], Array]
    meaning: str
    lower: bool = True


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
        for name in ("sums", "counts", "bins", "worst"):
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


METRICS: Mapping[str, Metric] = {
    m.name: m
    for m in (
        Metric("max_abs", "1", lambda t: t.max_abs, "largest |approximation - exact|"),
        Metric("mean_abs", "1", lambda t: t.mean(SUM_ABS), "mean |error|"),
        Metric("rms", "1", lambda t: np.sqrt(t.mean(SUM_SQUARES)), "root of the mean squared error"),
        Metric("bias", "1", lambda t: t.mean(SUM), "mean signed error, approximation - exact"),
        Metric("p50_abs", "1", lambda t: t.quantile(0.5), "median of |error|"),
        Metric("p99_abs", "1", lambda t: t.quantile(0.99), "99 % of |error| are smaller"),
        Metric("p999_abs", "1", lambda t: t.quantile(0.999), "99.9 % of |error| are smaller"),
        Metric("max_above", "1", lambda t: t.sums[:, ABOVE], "largest approximation - exact"),
        Metric("max_below", "1", lambda t: t.sums[:, BELOW], "largest exact - approximation"),
        Metric(
            "codes_8bit",
            "codes",
            lambda t: 255 * np.minimum(t.max_abs, 1e300),
            "largest |error| in steps of an 8-bit channel",
        ),
        Metric(
            "model_max",
            "1",
            lambda t: t.sums[:, MODEL],
            "largest error of the formula in exact arithmetic on unit vectors",
        ),
        Metric("length_max", "1", lambda t: t.sums[:, LENGTH], "largest change from the vectors' lengths"),
        Metric("rounding_max", "1", lambda t: t.sums[:, ROUNDING], "largest change from the working precision"),
        Metric("nonfinite", "count", lambda t: t.counts[:, NONFINITE], "values that are NaN or infinite"),
        Metric("above_one", "count", lambda t: t.counts[:, ABOVE_ONE], "values above 1"),
        Metric("negative", "count", lambda t: t.counts[:, NEGATIVE], "values below 0"),
    )
}
