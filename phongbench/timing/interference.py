"""Signs that something else ran while a block was timed."""

import os
import resource
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

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
        self._stat: int | None = None
        with suppress(OSError):
            self._stat = os.open(stat, os.O_RDONLY)

    def see(self, spin: float) -> Evidence:
        """The counters now; about 3 microseconds."""
        usage = resource.getrusage(getattr(resource, "RUSAGE_THREAD", resource.RUSAGE_SELF))
        return Evidence(usage.ru_nivcsw, self._stolen(), spin)

    def _stolen(self) -> int:
        if self._stat is None:
            return 0
        fields = os.pread(self._stat, 256, 0).split(b"\n", 1)[0].split()
        return int(fields[8]) if len(fields) > 8 else 0

    def close(self) -> None:
        """Let go of the counters."""
        if self._stat is not None:
            os.close(self._stat)
            self._stat = None
