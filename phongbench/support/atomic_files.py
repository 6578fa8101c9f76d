"""Files appear whole or not at all: written under a temporary name, synced, renamed."""

import os
from collections.abc import Callable
from pathlib import Path

from phongbench.support.user_paths import check_file, make_folder, writing


def write_whole(path: Path, write: Callable[[Path], object], *, sync: bool = True) -> None:
    """Call `write` with a temporary path beside `path`, sync, rename; folders that are missing are made.

    Readers see the old file or the new one, never a part. Without `sync`, for what can be made again, this holds unless
    the machine itself goes down. A link stays: its file is written. A device or a pipe is written to as it is.

    Raises InputError for a path that can be no file's, StorageError if the disk refuses.
    """
    check_file(path)
    if path.exists() and not path.is_file():
        with writing(path):
            write(path)
        return
    target = Path(os.path.realpath(path))
    make_folder(target.parent)
    temporary = target.with_name(f".{target.name}.partial")
    with writing(path):
        try:
            write(temporary)
            if sync:
                with temporary.open("rb+") as file:  # Windows syncs only what can be written to
                    os.fsync(file.fileno())
            temporary.replace(target)
        finally:
            temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 with unix line ends; for `write_whole`."""
    path.write_text(text, encoding="utf-8", newline="\n")


def write_bytes(path: Path, content: bytes, *, sync: bool = True) -> None:
    """Write these bytes whole; `sync` as for `write_whole`."""
    write_whole(path, lambda temporary: temporary.write_bytes(content), sync=sync)
