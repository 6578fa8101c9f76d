"""One process at a time writes into a run's folder."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import filelock

from phongbench.errors import LockedError
from phongbench.support.user_paths import make_folder, writing


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold a run's folder; LockedError if another process does. The folder is made if it is missing."""
    make_folder(path)
    lock = filelock.FileLock(path / ".lock", timeout=0)
    with writing(path):
        try:
            lock.acquire()
        except filelock.Timeout as problem:  # an OSError itself, so it is caught apart
            fix = "wait for it, or give another --out"
            raise LockedError("another phongbench run is writing here", str(path), fix) from problem
    try:
        yield
    finally:
        lock.release()
        (path / ".lock").unlink(missing_ok=True)
