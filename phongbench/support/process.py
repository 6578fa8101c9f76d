"""This process: its cores, the user's Ctrl-C, which must not get lost, and how often Python looks for cyclic garbage.

Python turns SIGINT into an exception wherever the main thread happens to be. Raised within a finaliser or a callback
from C, it is printed and forgotten, and the work goes on for hours. So the signal is also noted, and long work asks for
it at every step.
"""

import gc
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

#: objects made, less those freed, before Python looks; and how often it looks at the young before at the older ones
RARELY = (50_000, 20, 20)


def cores() -> int:
    """The cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def peak_mib() -> float | None:
    """The most memory that this process has held at once, in MiB; None where the system does not tell."""
    if sys.platform == "win32":
        return None
    import resource

    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return round(most / (1 << 20 if sys.platform == "darwin" else 1 << 10), 1)


@contextmanager
def heeded() -> Iterator[Callable[[], None]]:
    """Note SIGINT while the block runs; gives a check that raises KeyboardInterrupt if one came.

    Only in the main thread, and only where Python's own handler is in charge: a host program's handler stays, and so
    does the deafness of a job that a script put into the background.
    """
    interrupted = threading.Event()

    def check() -> None:
        if interrupted.is_set():
            raise KeyboardInterrupt

    def note(number: int, frame: Any) -> None:
        interrupted.set()
        raise KeyboardInterrupt

    ours = threading.current_thread() is threading.main_thread()
    if not ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield check
        return
    signal.signal(signal.SIGINT, note)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def seldom_collected() -> Iterator[None]:
    """Look for cyclic garbage rarely, for work that makes many objects and few cycles, as compiling and drawing do.

    By Python's own measure a study on a cold cache spends three seconds looking, a report a tenth of its time, and
    almost nothing is found: without looking at all a cold study holds a fifth more memory.
    """
    before = gc.get_threshold()
    gc.set_threshold(*RARELY)
    try:
        yield
    finally:
        gc.set_threshold(*before)
