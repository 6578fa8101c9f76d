"""The compiled part of timing: an epoch without any Python inside, a spin, a digest, a clock."""

from typing import Any

import numpy as np

from phongbench.compiler import clock, jit
from phongbench.timing import rounds

_SPINS = 2000
#: what `run` leaves in its scratch: [0:3] its own; the spin before; start and end of the timed passes; the spin after
SCRATCH = 7
SPIN_BEFORE, STARTED, ENDED, SPIN_AFTER = 3, 4, 5, 6
#: a flag of the meeting has a cache line to itself
STRIDE = 8
_PATIENCE_NS = 100_000_000


@jit.driver
def _read_clock(readings: Any, scratch: Any) -> None:
    for i in range(len(readings)):
        readings[i] = clock.nanoseconds(scratch)


def tick() -> float:
    """The smallest step of the clock that epochs are timed with, in nanoseconds; reading it takes about that long."""
    readings = np.zeros(1000, np.int64)
    _read_clock(readings, np.zeros(SCRATCH, np.int64))
    return rounds.tick(readings)


@jit.driver
def spin(scratch: Any) -> Any:
    """Nanoseconds that a fixed chain of dependent instructions takes: longer when something else uses the core."""
    started = clock.nanoseconds(scratch)
    x = scratch[2] | 1
    for _ in range(_SPINS):
        x ^= x << 13
        x ^= x >> 7
        x ^= x << 17
    scratch[2] = x
    return clock.nanoseconds(scratch) - started


# eleven arguments: compiled code takes arrays and numbers, no objects that hold them
@jit.driver
def run(
    kernel: Any,
    a: Any,
    b: Any,
    coefficients: Any,
    table: Any,
    out: Any,
    warm: int,
    repeats: int,
    scratch: Any,
    meeting: Any,
    me: int,
) -> None:
    """An epoch: spin, untimed passes, meeting, timed passes, spin; see SCRATCH for what it leaves.

    meeting  int64 (threads * STRIDE,)  zeros; each thread raises its flag and waits for all others, so that they start
                                        together. Reading the clock while waiting makes the compiler look again.
    me       int                        this thread's number

    The last spin comes after one that is not looked at: for some microseconds after 512-bit instructions a core runs
    at half its pace (1.5 times 3 us here), so the first spin would accuse every vectorised kernel and acquit scalar
    ones.
    """
    scratch[3] = spin(scratch)
    for _ in range(warm):
        kernel(a, b, coefficients, table, out)
    meeting[me * STRIDE] = 1
    limit = clock.nanoseconds(scratch) + _PATIENCE_NS
    for other in range(len(meeting) // STRIDE):
        while meeting[other * STRIDE] == 0 and clock.nanoseconds(scratch) < limit:
            pass
    started = clock.nanoseconds(scratch)
    for _ in range(repeats):
        kernel(a, b, coefficients, table, out)
    scratch[5] = clock.nanoseconds(scratch)
    scratch[4] = started
    spin(scratch)
    scratch[6] = spin(scratch)


@jit.driver
def digest(words: Any) -> Any:
    """A checksum of the bits, dependent on their places."""
    total = np.int64(0)
    for i in range(len(words)):
        total += words[i] * (2 * i + 1)
    return total
