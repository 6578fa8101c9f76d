"""Signs that something else ran while a block was timed."""

from contextlib import suppress
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import Any

resource: Any
try:
    import resource
except ImportError:  # Windows counts no involuntary switches: a slow spin is the evidence there
    resource = None

#: a spin that takes this much longer than usual is evidence that something else had the core
SPIN_SLACK = 1.25


@dataclass(frozen=True, slots=True)
class Evidence:
    """What was seen around an epoch.

    switches  int    involuntary context switches of the thread so far
    stolen    int    ticks the hypervisor has taken from this machine so far
    spin      float  nanoseconds that a fixed piece of work took just now
    """

    switches: int
    stolen: int
    spin: float


def disturbed(before: Evidence, after: Evidence, usual_spin: float) -> bool:
    """True if something other than the kernel had the core: never judged by the epoch's own time."""
    slow = max(before.spin, after.spin) > SPIN_SLACK * usual_spin
    return slow or after.switches > before.switches or after.stolen > before.stolen


class Witness:
    """Reads the counters of the system that are evidence; a counter it does not have stays at 0."""

    def __init__(self, stat: Path = Path("/proc/stat")) -> None:
        self._stat: FileIO | None = None
        with suppress(OSError):
            self._stat = FileIO(stat)
        # the thread's own on Linux, the process's where there is nothing finer
        self._who = getattr(resource, "RUSAGE_THREAD", getattr(resource, "RUSAGE_SELF", 0))

    def see(self, spin: float) -> Evidence:
        """The counters now; about 3 microseconds."""
        switches = resource.getrusage(self._who).ru_nivcsw if resource is not None else 0
        return Evidence(switches, self._stolen(), spin)

    def _stolen(self) -> int:
        if self._stat is None:
            return 0
        self._stat.seek(0)
        fields = self._stat.read(256).split(b"\n", 1)[0].split()
        return int(fields[8]) if len(fields) > 8 else 0

    def close(self) -> None:
        """Let go of the counters."""
        if self._stat is not None:
            self._stat.close()
            self._stat = None
