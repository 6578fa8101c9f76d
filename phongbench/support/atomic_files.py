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


def write_whole(path: Path, write: Callable[[Path], object], *, sync: bool = True) -> None:
    """Call `write` with a temporary path beside `path`, sync, rename.

    Readers see the old file or the new one, never a part. Without `sync`, for what can be made again, this holds unless
    the machine itself goes down.
    """
    temporary = path.with_name(f".{path.name}.partial")
    with storage(path):
        try:
            write(temporary)
            if sync:
                with temporary.open("rb+") as file:  # Windows syncs only what can be written to
                    os.fsync(file.fileno())
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 with unix line ends; for `write_whole`."""
    path.write_text(text, encoding="utf-8", newline="\n")


def write_bytes(path: Path, content: bytes, *, sync: bool = True) -> None:
    """Write these bytes whole, into a folder that is made if it is missing; `sync` as for `write_whole`."""
    with storage(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, lambda temporary: temporary.write_bytes(content), sync=sync)
