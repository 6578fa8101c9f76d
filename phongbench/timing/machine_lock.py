"""The machine-wide lock of timing runs: two timings at once would measure each other."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import filelock

from phongbench.errors import LockedError, StorageError

LOCK_NAME = "phongbench-timing.lock"


def _holder(note: Path) -> str:
    try:
        return f" (process {int(note.read_text())})"
    except (OSError, ValueError):
        return ""


@contextmanager
def machine_lock() -> Iterator[None]:
    """Held while timing. Lets go when the process dies; LockedError names the process that holds it."""
    path = Path(tempfile.gettempdir()) / LOCK_NAME
    lock, note = filelock.FileLock(path, mode=0o666, timeout=0), path.with_suffix(".pid")
    try:
        lock.acquire()
    except filelock.Timeout as problem:
        raise LockedError(
            f"another phongbench{_holder(note)} is timing on this machine",
            path.name,
            "wait for it, or leave timing out",
        ) from problem
    except OSError as problem:
        raise StorageError(
            f"the lock of timing runs cannot be opened: {problem.strerror}", path.name, "delete it, or set TMPDIR"
        ) from problem
    try:
        with suppress(OSError):
            note.write_text(str(os.getpid()))
        yield
    finally:
        with suppress(OSError):
            note.unlink()
        lock.release()
