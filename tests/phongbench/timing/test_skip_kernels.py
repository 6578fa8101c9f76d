"""Skipping whole blocks: the same bits as the plain kernel, wherever the dark begins."""

import math

import numpy as np
import pytest

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32, FLOAT64, Precision
from phongbench.formulas import pair_kernels
from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import coefficient_row, highlights, limit, read_only, table_row
from phongbench.timing import skip_kernels
from phongbench.timing.timed_kernels import ALPHA

COUNT = 200 if jit.DISABLED else 20_000


def both(formula: Formula, precision: Precision, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    spec, form, setting = formula.spec(), formula.lambda_form, formula.setting(ALPHA)
    a, b = (np.ascontiguousarray(v, precision.carrier) for v in (a, b))
    plain = highlights(spec, form, setting, a, b, precision=precision)
    row = np.append(coefficient_row(spec, setting, precision), precision.constant(limit(spec, setting, precision)))
    out = np.full_like(plain, np.nan)
    loop = skip_kernels.skip_kernel(spec, form, setting, precision)
    table = table_row(spec, setting, precision)
    pair_kernels.fill_pairs(jit.address(loop), read_only(a), read_only(b), row, table, out)
    return plain, out


@pytest.mark.parametrize("precision", [FLOAT32, FLOAT64], ids=["float32", "float64"])
@pytest.mark.parametrize("formula", skip_kernels.PAIRED, ids=str)
def test_skipping_changes_no_bit_where_pairs_crowd_at_the_limit(formula: Formula, precision: Precision) -> None:
    spec = formula.spec()
    end = limit(spec, formula.setting(ALPHA), precision)
    end = 1 - end if spec.coordinate == "cosine_deficit" else end
    rng = np.random.default_rng(2)
    near = end + rng.normal(size=COUNT) * np.repeat(10.0 ** rng.integers(-9, -1, COUNT // 20), 20)
    a = np.zeros((3, COUNT))
    a[0] = 1.0
    b = np.stack([near, np.sqrt(np.maximum(0.0, 1 - near**2)), np.zeros(COUNT)])
    with np.errstate(all="ignore"):
        plain, out = both(formula, precision, a, b)
    assert plain.tobytes() == out.tobytes()
    assert 0 < np.count_nonzero(plain) < COUNT


@pytest.mark.parametrize("formula", skip_kernels.PAIRED, ids=str)
def test_skipping_changes_no_bit_on_hostile_vectors_and_odd_counts(formula: Formula) -> None:
    rng = np.random.default_rng(3)
    count = 3 * skip_kernels.BLOCK + 17
    a, b = rng.normal(size=(2, 3, count))
    b[:, ::5] = rng.choice([math.nan, math.inf, -math.inf, 0.0, 1e30, 1e-40], size=b[:, ::5].shape)
    with np.errstate(all="ignore"):
        plain, out = both(formula, FLOAT32, a, b)
    assert plain.tobytes() == out.tobytes()


@pytest.mark.skipif(jit.DISABLED, reason="pairs are hashed out of integers that wrap around")
@pytest.mark.parametrize("lit", skip_kernels.LIT)
def test_the_share_of_lit_pairs_is_what_it_says_and_they_lie_together(lit: float) -> None:
    a, b = skip_kernels.inputs(lit)(FLOAT32, 1, 4096)
    for formula in skip_kernels.PAIRED:
        shining = highlights(formula.spec(), formula.lambda_form, formula.setting(ALPHA), a, b) > 0
        assert shining.mean() == pytest.approx(lit, abs=1 / 4096)
        assert np.count_nonzero(np.diff(shining.astype(int))) <= 2


@pytest.mark.skipif(jit.DISABLED, reason="plain Python is not timed")
def test_each_skipping_kernel_stands_beside_its_plain_one() -> None:
    kernels = {c.name: c for c in skip_kernels.kernels(FLOAT32)}
    assert skip_kernels.names() <= set(kernels)
    assert {"phong", "aa-twin", "copy", "triad", "dot"} <= set(kernels)
