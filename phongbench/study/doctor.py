"""Is this installation fit for a study? Each check says what it found and how to fix it."""

import importlib
import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from phongbench.compiler import jit
from phongbench.formulas.kernel import evaluate
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Setting
from phongbench.results.machine import machine
from phongbench.results.provenance import flags, versions
from phongbench.targets.webgpu import session

#: bytes that a standard study and its report stay well below
DISK_WANTED = 500 * 2**20


def examine() -> list[dict[str, str]]:
    """The checks: name, state ("good", "poor" or "bad"), detail."""
    about, host, bits, free = versions(), machine(), flags().vector_bits, shutil.disk_usage(Path.cwd()).free
    found = f"phongbench {about.phongbench}, python {about.python}, numpy {about.numpy}, numba {about.numba}"
    packages = ("phongbench_reports", "matplotlib", "jinja2", "pyarrow")
    return [
        _check("versions", "good", found),
        _check("machine", "good" if host.cores > 1 else "poor", f"{host.cpu}, {host.cores} cores"),
        _check("vector width", "good" if bits and bits >= 256 else "poor", f"{bits} bits, for CPU {flags().cpu_name}"),
        _attempt("compiler", _compiles),
        _attempt("kernel cache", _cache),
        _check("disk", "good" if free > DISK_WANTED else "bad", f"{free / 2**30:.1f} GiB free here"),
        _gpu(),
        *(_attempt(package, partial(_present, package)) for package in packages),
    ]


def _gpu() -> dict[str, str]:
    """Whether studies measure a GPU here; none is needed, and a software adapter is none."""
    adapter, lacking = session.found()
    if adapter is None:
        return _check("gpu", "poor", f"not measured: {lacking}")
    more = "; measured where asked for: phongbench run --target gpu" if adapter.software else ""
    clocks = "" if "timestamp-query" in adapter.features else "; without a clock of its own"
    held = "float32 and float16" if adapter.half else "float32"
    told = f"{adapter.title}, {adapter.driver}, by {adapter.backend}; {held}{clocks}{more}"
    return _check("gpu", "poor" if adapter.software else "good", told)


def _present(package: str) -> str:
    importlib.import_module(package)
    return "present"


def _compiles() -> str:
    if jit.DISABLED:
        raise RuntimeError("NUMBA_DISABLE_JIT is set: everything would run as plain Python; unset it")
    value = evaluate(REGISTRY["lyon"], Setting(64, 64, "taylor"), np.array([0.01]))[0]
    if abs(value - 0.99**64) > 1e-14:
        raise RuntimeError(f"Lyon's formula gave {value} instead of {0.99**64}: reinstall numba")
    return "compiles, and a highlight comes out right"


def _cache() -> str:
    folder = jit.cache_folder()
    size = sum(f.stat().st_size for f in folder.rglob("*") if f.is_file())
    return f"{folder} ({size / 2**20:.1f} MiB)"


def _attempt(name: str, test: Callable[[], Any]) -> dict[str, str]:
    try:
        return _check(name, "good", str(test()))
    except Exception as problem:  # noqa: BLE001  a doctor reports whatever is wrong
        return _check(name, "bad", f"{type(problem).__name__}: {problem}")


def _check(name: str, state: str, detail: str) -> dict[str, str]:
    return {"check": name, "state": state, "detail": detail}
