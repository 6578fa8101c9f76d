"""Files appear whole or not at all: written under a temporary name, synced, renamed."""

import errno
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from phongbench.errors import StorageError


@contextmanager
def storage(path: Path) -> Iterator[None]:
    """Turn what the disk refuses into a StorageError that names the place."""
    try:
        yield
    except OSError as problem:
        fix = "free some space" if problem.errno == errno.ENOSPC else "give a folder that can be written with --out"
        raise StorageError(f"cannot write: {problem.strerror or problem}", str(path), fix) from problem


def write_whole(path: Path, write: Callable[[Path], None]) -> None:
    """Call `write` with a temporary path beside `path`, sync, rename.

    Readers see the old file or the new one, never a part.
    """
    temporary = path.with_name(f".{path.name}.partial")
    with storage(path):
        try:
            write(temporary)
            with temporary.open("rb+") as file:  # Windows syncs only what can be written to
                os.fsync(file.fileno())
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 with unix line ends; for `write_whole`."""
    path.write_text(text, encoding="utf-8", newline="\n")
