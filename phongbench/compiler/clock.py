"""The clock as compiled code reads it, so that no Python lies between the clock and the loop that it times."""

import sys
import time
from collections.abc import Callable
from typing import Any

from phongbench.compiler import jit
from phongbench.compiler.late_numba import Late

types: Any = Late("numba.types")


class External:
    """A function of the C library or of Python's own that compiled code calls by its name.

    signature  makes numba's signature once numba is there
    """

    def __init__(self, name: str, signature: Callable[[], Any]) -> None:
        self.name, self.signature = name, signature

    @property
    def _numba_type_(self) -> Any:
        return types.ExternalFunction(self.name, self.signature())


_CLOCK = int(getattr(time, "CLOCK_MONOTONIC", 1))
_clock_gettime: Any = External("clock_gettime", lambda: types.int32(types.int32, types.intp))


def _nanoseconds(stamp: Any) -> Any:
    """Nanoseconds of the monotonic clock.

    stamp  int64 (2,)  scratch that the clock writes its seconds and nanoseconds to
    """
    _clock_gettime(_CLOCK, stamp.ctypes.data)
    return stamp[0] * 1_000_000_000 + stamp[1]


if sys.version_info >= (3, 13):
    _perf_counter: Any = External("PyTime_PerfCounterRaw", lambda: types.int32(types.intp))

    def python_clock(stamp: Any) -> Any:
        """`nanoseconds` by the clock of Python's C interface, for systems without clock_gettime, as Windows."""
        _perf_counter(stamp.ctypes.data)
        return stamp[0]
else:
    _perf_counter: Any = External("_PyTime_GetPerfCounter", types.int64)

    def python_clock(stamp: Any) -> Any:
        """`nanoseconds` by the clock of Python's C interface, for systems without clock_gettime, as Windows."""
        return _perf_counter()


def _clock() -> Callable[[Any], Any]:
    if jit.DISABLED:
        return lambda stamp: time.monotonic_ns()
    return jit.inline(_nanoseconds if hasattr(time, "clock_gettime") else python_clock)


nanoseconds: Callable[[Any], Any] = _clock()
