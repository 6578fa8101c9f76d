"""The machine a run was made on: processor, caches, memory, system."""

import os
import platform
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import psutil

_KIB, _MIB = 1 << 10, 1 << 20
_SYSTEM = Path("/sys/devices/system/cpu/cpu0")
_CPUINFO = Path("/proc/cpuinfo")
#: the working set "memory" is at most this large: four times the last-level cache of a server would take seconds a pass
MEMORY_CAP = 256 * _MIB


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
        hypervisor="hypervisor" in cpu_words("flags"),
        governor=_text(_SYSTEM / "cpufreq" / "scaling_governor"),
    )


@cache
def cache_sizes(folder: Path = _SYSTEM / "cache") -> Caches:
    """Sizes of the data caches, from the system where it tells them, else a cautious guess."""
    sizes: dict[int, int] = {}
    for index in sorted(folder.glob("index*")):
        level, size = _text(index / "level"), _bytes(_text(index / "size"))
        if level and level.isdigit() and size and _text(index / "type") != "Instruction":
            sizes[int(level)] = size
    guess = Caches()
    l1, l2 = sizes.get(1, guess.l1), sizes.get(2, guess.l2)
    return Caches(l1, l2, sizes[max(sizes)] if sizes and max(sizes) > 1 else max(guess.last, l2))


def _bytes(text: str | None) -> int | None:
    parts = re.fullmatch(r"(\d+)([KMG]?)", text or "")
    return int(parts[1]) << {"": 0, "K": 10, "M": 20, "G": 30}[parts[2]] if parts else None


def _text(path: Path) -> str | None:
    try:
        return path.read_text().strip()
    except OSError:
        return None


def cpu_words(key: str) -> frozenset[str]:
    """The words of this line of /proc/cpuinfo, e.g. of `flags`; none where there is no such line."""
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
