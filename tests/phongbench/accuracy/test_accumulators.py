"""Tallies: they merge like sets, and their quantiles are those of the errors."""

import numpy as np
import pytest

from phongbench.accuracy import reductions
from phongbench.accuracy.accumulators import BINS, METRICS, ErrorAccumulator
from phongbench.results import schema


def tally_of(values, exact):
    """A one-row tally filled by the compiled passes, as the sweep fills it."""
    t = ErrorAccumulator(1)
    errors, indices = np.empty(len(values), np.float32), np.empty(len(values), np.uint32)
    assert reductions._reduce(values, values.astype(float), values.astype(float), exact, errors, t.sums[0])
    reductions._census(values, t.counts[0])
    reductions._bin_indices(errors, indices)
    reductions._fill_bins(indices, np.zeros((4, BINS), np.uint16), t.bins[0])
    t.samples = len(values)
    return t


@pytest.fixture
def sample():
    rng = np.random.default_rng(0)
    exact = rng.random(5003)
    return (exact + rng.normal(0, 10.0 ** rng.uniform(-9, -1, 5003))).astype(np.float32), exact


def test_metrics_are_those_of_the_errors(sample):
    values, exact = sample
    error = values.astype(float) - exact
    found = {name: float(m(tally_of(values, exact))[0]) for name, m in METRICS.items()}
    assert found["max_abs"] == np.abs(error).max()
    assert found["codes_8bit"] == 255 * np.abs(error).max()
    assert found["mean_abs"] == pytest.approx(np.abs(error).mean(), rel=1e-13)
    assert found["rms"] == pytest.approx(np.sqrt((error**2).mean()), rel=1e-13)
    assert found["bias"] == pytest.approx(error.mean(), rel=1e-10)
    assert found["max_above"] == error.max()
    assert found["max_below"] == -error.min()
    assert found["above_one"] == (values > 1).sum()
    assert found["negative"] == (values < 0).sum()


@pytest.mark.parametrize(("name", "q"), [("p50_abs", 0.5), ("p99_abs", 0.99), ("p999_abs", 0.999)])
def test_quantiles_are_right_to_a_bin(sample, name, q):
    values, exact = sample
    wanted = np.quantile(np.abs(values.astype(float) - exact), q)
    assert float(METRICS[name](tally_of(values, exact))[0]) == pytest.approx(wanted, rel=0.07)


def test_merging_parts_equals_the_whole(sample):
    values, exact = sample
    parts = [tally_of(values[i:j], exact[i:j]) for i, j in ((0, 1000), (1000, 1001), (1001, 5003))]
    merged = parts[0]
    for part in parts[1:]:
        merged.merge(part)
    whole = tally_of(values, exact)
    assert merged.samples == whole.samples
    assert np.array_equal(merged.bins, whole.bins)
    assert np.array_equal(merged.counts, whole.counts)
    assert np.array_equal(merged.sums[:, 3:], whole.sums[:, 3:])
    assert np.allclose(merged.sums[:, :3], whole.sums[:, :3], rtol=1e-12)


def test_a_chunk_with_anything_not_finite_is_refused_untouched(sample):
    values, exact = sample
    for broken in (np.nan, np.inf, -np.inf):
        t, dirty = ErrorAccumulator(1), values.copy()
        dirty[77] = broken
        errors = np.empty(len(dirty), np.float32)
        assert not reductions._reduce(dirty, dirty.astype(float), exact, exact, errors, t.sums[0])
        assert not t.sums.any()


def test_the_schema_describes_every_metric():
    assert list(METRICS) == schema.METRICS


@pytest.mark.parametrize(
    ("scale", "why"),
    [
        (1.0, "plain errors"),
        (0.0, "all are zero"),
        (1e-60, "all are zero once rounded"),
        (1e60, "all are infinite once rounded"),
    ],
)
def test_the_worst_sample_is_the_first_with_the_largest_error(scale, why):
    rng = np.random.default_rng(3)
    values, a, b = np.zeros(1000), rng.random((3, 1003)), rng.random((3, 1003))
    exact = -rng.random(1000) * scale
    exact[[300, 301, 302, 700]] = np.array([1 - 2.0**-40, -1, 1, 1]) * scale  # the first rounds to what the others are
    largest = np.abs(values - exact).max()
    position = int(np.abs(values - exact).argmax())  # the first of equal ones
    worst = np.full(9, -1.0)
    with np.errstate(over="ignore"):
        rounded = (values - exact).astype(np.float32)
    reductions._find_worst(values, exact, rounded, a, b, 3, largest, worst)
    assert (worst[:3] == [largest, exact[position], values[position]]).all(), why
    assert (worst[3:] == np.concatenate([a[:, 3 + position], b[:, 3 + position]])).all(), why
