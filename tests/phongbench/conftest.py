"""What the tests of the library share."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from phongbench import jit
from phongbench.lowering import Body, Precision, lower

Array = NDArray[Any]


def _loop_1(f: Body) -> Callable[..., None]:
    def run(out: Array, a: Array) -> None:
        for i in range(len(out)):
            out[i] = f(a[i])

    return run


def _loop_2(f: Body) -> Callable[..., None]:
    def run(out: Array, a: Array, b: Array) -> None:
        for i in range(len(out)):
            out[i] = f(a[i], b[i])

    return run


def _loop_6(f: Body) -> Callable[..., None]:
    def run(out: Array, a: Array, b: Array, c: Array, d: Array, e: Array, g: Array) -> None:
        for i in range(len(out)):
            out[i] = f(a[i], b[i], c[i], d[i], e[i], g[i])

    return run


@pytest.fixture(scope="session")
def over() -> Callable[..., Array]:
    """over(body, precision, *columns, **known): the lowered body, compiled, over columns of numbers."""
    loops = {1: _loop_1, 2: _loop_2, 6: _loop_6}

    def over(body: Body, precision: Precision, *columns: Any, **known: int) -> Array:
        with np.errstate(all="ignore"):
            rounded = [np.atleast_1d(np.asarray(c, precision.dtype).astype(precision.carrier)) for c in columns]
            given = [np.ascontiguousarray(c) for c in np.broadcast_arrays(*rounded)]
            out = np.empty_like(given[0])
            jit.driver(loops[len(columns)](lower(body, precision, **known)))(out, *given)
        return out

    return over
