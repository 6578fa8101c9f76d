"""Paths that users name: what is wrong with one is told in one way, whether it is read from or written to.

A path that cannot be meant, such as a folder in place of a file, is wrong input. What the disk refuses where the path
is right is the disk's fault: no space, no permission to write, an error of the device.
"""

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from phongbench.errors import InputError, StorageError

#: what the system says of a path that nothing can be written to on any disk
_NO_SUCH_PLACE = frozenset({errno.EISDIR, errno.ENOTDIR, errno.EEXIST, errno.ENAMETOOLONG, errno.ELOOP, errno.EINVAL})
#: what it says of a device that fails while a file is read
_FAULTS = frozenset({errno.EIO, errno.ENXIO, errno.ENODEV, getattr(errno, "ESTALE", errno.EIO)})


@contextmanager
def reading(path: Path | str, kind: str, fix: str | None = None) -> Iterator[None]:
    """Turn what keeps a file from being read into an InputError that names it, or a StorageError if the disk fails.

    kind  what the file is: "plan", "mesh"
    fix   what to give instead
    """
    try:
        yield
    except (OSError, ValueError) as problem:  # ValueError: a name that no file can have
        if isinstance(problem, UnicodeError):  # a ValueError, too, and about the content
            raise
        what = f"cannot read the {kind}: {getattr(problem, 'strerror', None) or problem}"
        error = StorageError if getattr(problem, "errno", None) in _FAULTS else InputError
        raise error(what, str(path) or "''", fix) from problem


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn what keeps a place from being written to into an InputError, or a StorageError if the disk refuses."""
    try:
        yield
    except OSError as problem:
        what = f"cannot write: {problem.strerror or problem}"
        if problem.errno in _NO_SUCH_PLACE:
            raise InputError(what, str(path), "choose another name or folder") from problem
        fix = "free some space" if problem.errno == errno.ENOSPC else "choose a folder that can be written to"
        raise StorageError(what, str(path), fix) from problem


def make_folder(path: Path) -> None:
    """Make a folder and those above it, where they are missing; InputError where a file is in the way."""
    with writing(path):
        if is_file(path):
            raise InputError("cannot write: it is a file, not a folder", str(path), "choose another folder")
        # a link that leads nowhere leads to the folder from now on
        Path(os.path.realpath(path)).mkdir(parents=True, exist_ok=True)


def check_file(path: Path) -> None:
    """Raise what would keep a file of this name from being written; to be asked before long work.

    InputError for a folder's name, a place below a file and other names that no file can have; StorageError where
    nothing can be put into the folder.
    """
    if is_folder(path):
        raise InputError("cannot write: it is a folder", str(path), "name a file in it")
    with writing(path), suppress(FileNotFoundError):
        if not stat.S_ISREG(path.stat().st_mode):
            return  # a device or a pipe
    home = next(folder for folder in Path(os.path.realpath(path)).parents if folder.exists())
    if not os.access(home, os.W_OK | os.X_OK):
        raise StorageError(f"cannot write: nothing can be put into {home}", str(path), "choose another folder")


def is_file(path: Path | str) -> bool:
    """Whether a file is there; False also for names that no file can have."""
    return os.path.isfile(path)  # noqa: PTH113 - Path.is_file raises for names that are too long


def is_folder(path: Path | str) -> bool:
    """Whether a folder is there; False also for names that no folder can have."""
    return os.path.isdir(path)  # noqa: PTH112 - as above
