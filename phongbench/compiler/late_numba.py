"""numba, imported when the first loop is compiled or called: half a second that an answer from stored rows can spare.

`jit` and `intrinsics` name numba's and llvmlite's modules by `Late`, and what must be told numba waits for it here.
"""

import importlib
import os
import sys
import threading
from collections.abc import Callable
from typing import Any

_LOCK = threading.RLock()
#: what numba is to be told as soon as it is there
_WAITING: list[Callable[[], Any]] = []
#: not empty while it is told, which happens in the thread that holds the lock
_TELLING: list[bool] = []
#: set when numba is imported and knows everything: from then on nobody need take the lock
_READY = threading.Event()


def prefer_wide_vectors() -> None:
    """Let LLVM use 512-bit vectors where the CPU has them; it prefers 256 bits by default.

    Must happen before numba is imported. Measured on a Sapphire Rapids core: float64 loops 1.05 to 1.3 times faster,
    nothing slower. A user's own NUMBA_CPU_NAME wins. Who tells how kernels are compiled calls it without compiling any.
    """
    if "numba" in sys.modules or "NUMBA_CPU_NAME" in os.environ:
        return
    llvm = importlib.import_module("llvmlite.binding")
    features = llvm.get_host_cpu_features()
    if features.get("avx512f") and features.get("avx512vl"):
        features["prefer-256-bit"] = False
        os.environ["NUMBA_CPU_NAME"] = llvm.get_host_cpu_name()
        os.environ["NUMBA_CPU_FEATURES"] = features.flatten()


def load() -> None:
    """Import numba with the vector width chosen, and tell it what waits for it."""
    if not _READY.is_set():
        with _LOCK:
            prefer_wide_vectors()
            importlib.import_module("numba")
            _tell_all()


def when_loaded(action: Callable[[], Any]) -> None:
    """Call this now if numba is there, whoever imported it, or else as soon as it is loaded here."""
    with _LOCK:
        _WAITING.append(action)
        if "numba" in sys.modules:
            _tell_all()


def _tell_all() -> None:
    """Call what waits, once; what is called may ask for numba itself."""
    if _TELLING:
        return
    _TELLING.append(True)
    try:
        while _WAITING:
            _WAITING.pop(0)()
    finally:
        _TELLING.clear()
    _READY.set()


class Late:
    """A module of numba's or llvmlite's, such as "numba.types", that is imported when something of it is first used."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        load()
        return getattr(importlib.import_module(self._name), attribute)
