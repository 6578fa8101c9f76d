"""What decides the last bits of a row: code, versions, and the processor as the compiler sees it."""

import os
import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version

import llvmlite.binding as llvm

from phongbench.compiler import jit
from phongbench.compiler.late_numba import prefer_wide_vectors
from phongbench.results.provenance import fingerprint_code, versions

#: the largest difference of features that is told in full
_TOLD = 6


@cache
def arithmetic() -> Mapping[str, str]:
    """Of this process, by name: two with equal values compute equal rows, bit for bit.

    cpu, features  that kernels are compiled for: the machine's own, or what NUMBA_CPU_NAME and NUMBA_CPU_FEATURES say
    """
    prefer_wide_vectors()
    known = versions()
    return {
        "code": fingerprint_code(),
        "python": ".".join(known.python.split(".")[:2]),
        "numpy": str(known.numpy),
        "numba": str(known.numba),
        "llvmlite": str(known.llvmlite),
        "scipy": version("scipy"),
        "libc": " ".join(platform.libc_ver()),
        "compiler": "off" if jit.DISABLED else "on",
        "cpu": os.environ.get("NUMBA_CPU_NAME") or llvm.get_host_cpu_name(),
        "features": _features(),
    }


def _features() -> str:
    """The features that code is compiled with, those left out are not named."""
    said = os.environ.get("NUMBA_CPU_FEATURES")
    words = llvm.get_host_cpu_features().flatten() if said is None else said
    return " ".join(sorted(word[1:] for word in words.split(",") if word.startswith("+")))


def difference(one: Mapping[str, str], other: Mapping[str, str]) -> str | None:
    """In what the other differs, in words: `numba 0.62.1 instead of 0.62.0`; None if rows of both are the same bits.

    one, other  as `arithmetic` gives them
    """
    for name in dict.fromkeys((*one, *other)):
        a, b = one.get(name, "unknown"), other.get(name, "unknown")
        if a != b:
            return _other_features(a, b) if name == "features" else f"{name} {b} instead of {a}"
    return None


def _other_features(mine: str, theirs: str) -> str:
    """Which features of a processor are there and which are not, a few of them."""
    ours, others = set(mine.split()), set(theirs.split())
    changed = [f"with {word}" for word in sorted(others - ours)] + [f"without {word}" for word in sorted(ours - others)]
    more = f" and {len(changed) - _TOLD} more" if len(changed) > _TOLD else ""
    return f"features of the processor {', '.join(changed[:_TOLD])}{more}"
