"""Where a result came from: machine, versions, flags, seed, code. Never who or where: no host, user or path.

Typed keys, so that two runs are compared field by field. Times of different machines are comparable only as ratios
within each run; `fingerprint_machine` says whether two machines are the same kind.
"""

import hashlib
import os
import platform
import re
import subprocess
import sys
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from phongbench.compiler import jit
from phongbench.compiler.late_numba import prefer_wide_vectors
from phongbench.results.machine import Machine, cpu_words, machine

_PACKAGES = ("numpy", "numba", "llvmlite", "pandas", "pyarrow", "phongbench")


@dataclass(frozen=True, slots=True)
class Versions:
    """Releases that decide a result; None for what is not installed."""

    python: str
    numpy: str | None
    numba: str | None
    llvmlite: str | None
    pandas: str | None
    pyarrow: str | None
    phongbench: str | None


@dataclass(frozen=True, slots=True)
class Flags:
    """How kernels are compiled.

    formula, reduction  tuple[str, ..]  LLVM fast-math flags of the two kinds of loop
    cpu_name            str             target CPU, "host" where numba chooses
    vector_bits         int             width of a vector register in use
    jit                 bool            False where everything runs as plain Python
    """

    formula: tuple[str, ...]
    reduction: tuple[str, ...]
    cpu_name: str
    vector_bits: int
    jit: bool


@dataclass(frozen=True, slots=True)
class Checkout:
    """The commit of phongbench's own checkout, and whether files differ from it."""

    commit: str
    dirty: bool


@dataclass(frozen=True, slots=True)
class Provenance:
    """Everything stored beside a result; `command` has its paths reduced to names."""

    machine: Machine
    versions: Versions
    flags: Flags
    checkout: Checkout | None
    command: tuple[str, ...]
    seed: int
    code: str
    machine_fingerprint: str

    def as_dict(self) -> dict[str, Any]:
        """Plain keys and values for a manifest."""
        return asdict(self)


def collect(seed: int, command: Sequence[str]) -> Provenance:
    """What there is to know now.

    command  list of str  the words of the command line
    """
    return Provenance(
        machine(),
        versions(),
        flags(),
        checkout(),
        without_paths(command),
        seed,
        fingerprint_code(),
        fingerprint_machine(),
    )


@cache
def fingerprint_machine() -> str:
    """16 hex digits, equal for machines whose times may be compared; what changes from day to day is left out."""
    m = machine()
    kind = (
        m.cpu,
        m.architecture,
        m.cores,
        m.threads,
        m.caches,
        m.system,
        m.hypervisor,
        flags().cpu_name,
        flags().vector_bits,
    )
    return _digest([repr(kind).encode()])


def digest_of_sources(package: Path) -> str:
    """16 hex digits of the names and texts of every source of a package."""
    sources = sorted(package.rglob("*.py"))
    return _digest(p for path in sources for p in (path.relative_to(package).as_posix().encode(), path.read_bytes()))


@cache
def fingerprint_code() -> str:
    """16 hex digits of the package's sources and of the versions that compile them."""
    sources = digest_of_sources(Path(__file__).parents[1])
    return _digest([sources.encode(), repr((versions().numpy, versions().numba, versions().llvmlite)).encode()])


def _digest(parts: Iterable[bytes]) -> str:
    total = hashlib.sha256()
    for part in parts:
        total.update(len(part).to_bytes(8, "little") + part)
    return total.hexdigest()[:16]


@cache
def versions() -> Versions:
    """Releases of what is installed; metadata is read, nothing is imported but phongbench."""
    releases: dict[str, str | None] = {}
    for name in _PACKAGES:
        try:
            releases[name] = version(name)
        except PackageNotFoundError:
            releases[name] = None
    releases["phongbench"] = getattr(sys.modules["phongbench"], "__version__", releases["phongbench"])
    return Versions(python=platform.python_version(), **releases)


def flags() -> Flags:
    """How kernels are compiled in this process."""
    prefer_wide_vectors()
    words, features = cpu_words("flags"), os.environ.get("NUMBA_CPU_FEATURES", "")
    wide = "avx512f" in words and "-prefer-256-bit" in features
    bits = 512 if wide else 256 if "avx" in words else 128
    name = os.environ.get("NUMBA_CPU_NAME", "host")
    return Flags(tuple(sorted(jit.FORMULA_FLAGS)), tuple(sorted(jit.REDUCTION_FLAGS)), name, bits, not jit.DISABLED)


@cache
def checkout() -> Checkout | None:
    """The state of the checkout this package runs from; None where it is installed, or without git."""
    top = Path(__file__).parents[2]
    if not (top / ".git").exists():
        return None

    def git(*words: str) -> str | None:
        try:
            done = subprocess.run(
                ["git", "-C", str(top), *words], capture_output=True, text=True, timeout=10, check=True
            )
        except (OSError, subprocess.SubprocessError):
            return None
        return done.stdout

    commit, changes = git("rev-parse", "--verify", "HEAD"), git("status", "--porcelain")
    return None if commit is None or changes is None else Checkout(commit.strip(), bool(changes.strip()))


def without_paths(command: Iterable[str]) -> tuple[str, ...]:
    """The words with every path reduced to its last name, after an `=` and in comma-separated lists too."""
    return tuple("=".join(",".join(map(_last_name, part.split(","))) for part in word.split("=")) for word in command)


def _last_name(word: str) -> str:
    if re.fullmatch(r"[0-9.eE+-]+/[0-9.eE+-]+", word):  # a fraction such as 1/255
        return word
    return re.split(r"[/\\]", word.rstrip("/\\"))[-1]
