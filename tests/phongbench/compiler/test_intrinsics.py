"""Operations mean the same compiled and plain."""

import os
import subprocess
import sys

import numpy as np
import pytest

from phongbench.compiler import intrinsics, jit

HALVES = np.concatenate(
    [
        np.array([0.0, -0.0, 1.0, -2.5, 6e-8, -6e-8, 65504.0, np.inf, -np.inf, np.nan]),
        np.random.default_rng(1).normal(size=200),
    ]
).astype(np.float16)


@jit.driver
def apply_rounding(x, out):
    for i in range(len(x)):
        out[i] = intrinsics.round_to_half(x[i])


@jit.driver
def apply_product(x, y, out):
    for i in range(len(x)):
        out[i] = intrinsics.half_product(x[i], y[i])


@jit.driver
def apply_select(x, out):
    for i in range(len(x)):
        out[i] = intrinsics.select(x[i] > 0.5, x[i], np.float32(7.0))


@jit.driver
def apply_entry(table, index, out):
    local = intrinsics.on_stack(table)
    for i in range(len(index)):
        out[i] = intrinsics.entry(local, index[i])


@jit.driver
def apply_bits(x, out):
    for i in range(len(x)):
        out[i] = intrinsics.float32_from_bits(intrinsics.float32_bits(x[i]))


def test_rounding_to_half_is_numpys():
    x = np.random.default_rng(0).normal(size=2000).astype(np.float32) * np.logspace(-9, 6, 2000, dtype=np.float32)
    out = np.empty_like(x)
    apply_rounding(x, out)
    with np.errstate(over="ignore"):
        assert np.array_equal(out, x.astype(np.float16).astype(np.float32))


def test_products_of_halves_are_numpys():
    x, y = (v.ravel() for v in np.meshgrid(HALVES, HALVES))
    out = np.empty(len(x), np.float32)
    apply_product(x.astype(np.float32), y.astype(np.float32), out)
    with np.errstate(all="ignore"):
        assert np.array_equal(out, (x * y).astype(np.float32), equal_nan=True)


def test_select_takes_one_of_two():
    x = np.array([0.0, 0.6, np.nan, 1.0], np.float32)
    out = np.empty_like(x)
    apply_select(x, out)
    assert out.tolist() == [7.0, np.float32(0.6), 7.0, 1.0]


def test_a_table_is_looked_up_from_its_copy():
    table = np.arange(65, dtype=np.float32) ** 2
    index, out = np.array([0, 64, 5], np.int32), np.empty(3, np.float32)
    apply_entry(table, index, out)
    assert out.tolist() == [0.0, 4096.0, 25.0]


def test_bits_survive_the_round_trip():
    x = np.array([0.0, -0.0, 1.5, np.inf, 1e-45], np.float32)
    out = np.empty_like(x)
    apply_bits(x, out)
    assert x.tobytes() == out.tobytes()


def test_operations_are_plain_functions_too():
    assert intrinsics.round_to_half(np.float32(0.1)) == np.float32(np.float16(0.1))
    assert intrinsics.round_to_half(3) == 3
    assert intrinsics.select(True, 1, 2) == 1
    assert intrinsics.float64_bits(1.0) == 0x3FF0000000000000


@pytest.mark.parametrize("first", ["intrinsics", "precisions"])
def test_whoever_is_imported_first_the_vector_width_is_chosen_before_numba_is_imported(first):
    def width(module):
        code = f"import phongbench.compiler.{module}, numba; print(numba.config.CPU_NAME, numba.config.CPU_FEATURES)"
        environment = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_CPU")}
        return subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, check=True).stdout

    assert width(first) == width("jit")
