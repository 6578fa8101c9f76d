"""Functions of a known type are compiled into their callers as numba would: the same bits, by the caller's flags."""

from typing import Any

import numpy as np
import pytest

from phongbench.compiler import intrinsics, jit
from phongbench.compiler.precisions import Array

pytestmark = pytest.mark.skipif(jit.DISABLED, reason="without the compiler nothing is inlined")
#: its square is not the rounded one
NEAR_ONE = 1 - 2.0**-30


def off_by(x: float) -> float:
    return x * x - (1 - 2.0**-29)


known, unknown = jit.inline(lambda x: x * x - (1 - 2.0**-29), np.float64), jit.inline(off_by)
both = jit.inline(lambda x, n: (known(x), x + n), (np.float64, np.float64))


def _signature(dtype: Any) -> Any:
    return jit.signature(jit.array_type(dtype), jit.array_type(dtype))


_at = intrinsics.function_at(_signature)


@jit.driver
def _call(address: int, x: Array, out: Array) -> None:
    _at(address, x)(x, out)


def fused(body: Any) -> float:
    """What a loop makes of NEAR_ONE that may fuse product and difference."""

    def may(x: Array, out: Array) -> None:
        out[0] = body(x[0])

    return _value(jit.elementwise(_signature(np.float64), may))


def apart(body: Any) -> float:
    """What a loop makes of it that may not."""

    def may_not(x: Array, out: Array) -> None:
        out[0] = body(x[0])

    return _value(jit.elementwise(_signature(np.float64), may_not, fused=False))


def _value(loop: Any) -> float:
    out = np.empty(1)
    _call(jit.address(loop), np.array([NEAR_ONE]), out)
    return float(out[0])


def test_the_caller_decides_what_is_fused() -> None:
    """Compiled once for a caller that fuses, a function must not serve one that may not."""
    assert [fused(known), apart(known), fused(known)] == [fused(unknown), apart(unknown), fused(unknown)]
    assert apart(known) == off_by(NEAR_ONE)


def test_tuples_and_whole_numbers_pass() -> None:
    @jit.driver
    def run(x: float) -> float:
        first, second = both(x, 3)
        return first + second

    assert run(0.5) == off_by(0.5) + 3.5


single = jit.inline(lambda x: x + x, np.float32)
_HALF = 0.5
widened = jit.inline(lambda x: x * _HALF, np.float32)


@pytest.mark.parametrize(
    ("body", "given", "said"),
    [
        (known, np.float32(0.5), "compiled for float64 and is called with float32"),
        (single, 0.5, "compiled for float32 and is called with float64"),
        (single, 3, "compiled for float32 and is called with int64"),
        (single, np.ones(2), "compiled for float32 and is called with float64"),
        (widened, np.float32(0.5), "compiled for float32 and computes float64"),
    ],
    ids=["narrower", "wider", "whole", "array", "constant"],
)
def test_numbers_of_another_type_are_refused_with_what_to_do(body: Any, given: Any, said: str) -> None:
    """It would compute in the wider type, and slower, with nothing to see of it but other bits."""

    @jit.driver
    def run(x: Any) -> Any:
        return body(x)

    with pytest.raises(jit.compile_error(), match=said) as refused:
        run(given)
    assert "lower it for that precision, or inline it without a type" in str(refused.value)
