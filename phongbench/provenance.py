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

import psutil

from phongbench import jit

_KIB, _MIB = 1 << 10, 1 << 20
_SYSTEM = Path("/sys/devices/system/cpu/cpu0")
_CPUINFO = Path("/proc/cpuinfo")
#: the working set "memory" is at most this large: four times the last-level cache of a server would take seconds a pass
MEMORY_CAP = 256 * _MIB
_PACKAGES = ("numpy", "numba", "llvmlite", "pandas", "pyarrow", "phongbench")


@dataclass(frozen=True, slots=True)
class Caches:
    """Bytes of the data caches one core sees: first level, second level, and the last level there is."""

    l1: int = 32 * _KIB
    l2: int = _MIB
    last: int = 8 * _MIB


@dataclass(frozen=True, slots=True)
class Machine:
    """The machine as far as it explains a time.

    cores, threads  int         physical cores and hardware threads this process may use
    memory_mib      int
    hypervisor      bool        a virtual machine: steal time and invisible neighbours are possible
    governor        str | None  frequency governor, where it can be read
    memory_set_cap  int         bytes that the working set "memory" is limited to
    """

    cpu: str
    architecture: str
    cores: int
    threads: int
    caches: Caches
    memory_mib: int
    system: str
    kernel: str
    hypervisor: bool
    governor: str | None
    memory_set_cap: int = MEMORY_CAP


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


@cache
def fingerprint_code() -> str:
    """16 hex digits of the package's sources and of the versions that compile them."""
    package = Path(__file__).parent
    sources = sorted(package.rglob("*.py"))
    parts = (part for path in sources for part in (path.relative_to(package).as_posix().encode(), path.read_bytes()))
    return _digest([*parts, repr((versions().numpy, versions().numba, versions().llvmlite)).encode()])


def _digest(parts: Iterable[bytes]) -> str:
    total = hashlib.sha256()
    for part in parts:
        total.update(len(part).to_bytes(8, "little") + part)
    return total.hexdigest()[:16]


@cache
def machine() -> Machine:
    """This machine."""
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return Machine(
        cpu=_cpu_model(),
        architecture=platform.machine(),
        cores=psutil.cpu_count(logical=False) or allowed,
        threads=allowed,
        caches=cache_sizes(),
        memory_mib=round(psutil.virtual_memory().total / _MIB),
        system=platform.system(),
        kernel=platform.release(),
        hypervisor="hypervisor" in _cpu_words("flags"),
        governor=_text(_SYSTEM / "cpufreq" / "scaling_governor"),
    )


@cache
def versions() -> Versions:
    """Releases of what is installed; metadata is read, nothing is imported but phongbench."""
    found: dict[str, str | None] = {}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = None
    found["phongbench"] = getattr(sys.modules["phongbench"], "__version__", found["phongbench"])
    return Versions(python=platform.python_version(), **found)


def flags() -> Flags:
    """How kernels are compiled in this process."""
    words, features = _cpu_words("flags"), os.environ.get("NUMBA_CPU_FEATURES", "")
    wide = "avx512f" in words and "-prefer-256-bit" in features
    bits = 512 if wide else 256 if "avx" in words else 128
    name = os.environ.get("NUMBA_CPU_NAME", "host")
    return Flags(tuple(sorted(jit.FORMULA_FLAGS)), tuple(sorted(jit.REDUCTION_FLAGS)), name, bits, not jit.DISABLED)


@cache
def checkout() -> Checkout | None:
    """The state of the checkout this package runs from; None where it is installed, or without git."""
    top = Path(__file__).parent.parent
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


@cache
def cache_sizes(folder: Path = _SYSTEM / "cache") -> Caches:
    """Sizes of the data caches, from the system where it tells them, else a cautious guess."""
    found: dict[int, int] = {}
    for index in sorted(folder.glob("index*")):
        level, size = _text(index / "level"), _bytes(_text(index / "size"))
        if level and level.isdigit() and size and _text(index / "type") != "Instruction":
            found[int(level)] = size
    guess = Caches()
    l1, l2 = found.get(1, guess.l1), found.get(2, guess.l2)
    return Caches(l1, l2, found[max(found)] if found and max(found) > 1 else max(guess.last, l2))


def _bytes(text: str | None) -> int | None:
    parts = re.fullmatch(r"(\d+)([KMG]?)", text or "")
    return int(parts[1]) << {"": 0, "K": 10, "M": 20, "G": 30}[parts[2]] if parts else None


def _text(path: Path) -> str | None:
    try:
        return path.read_text().strip()
    except OSError:
        return None


def _cpu_words(key: str) -> frozenset[str]:
    return frozenset(_cpu_line(key).split())


@cache
def _cpu_line(key: str) -> str:
    for line in (_text(_CPUINFO) or "").splitlines():
        name, _, value = line.partition(":")
        if name.strip() == key:
            return value.strip()
    return ""


def _cpu_model() -> str:
    return _cpu_line("model name") or platform.processor() or platform.machine()
