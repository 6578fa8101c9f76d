"""What is written: whole, through links, into folders that are made, and never over a device."""

import errno
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from phongbench.errors import InputError, StorageError
from phongbench.support.atomic_files import write_bytes
from phongbench.support.user_paths import check_file, make_folder, reading, writing


def test_a_link_stays_a_link_and_its_file_is_written(tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to("deep/down/file")
    write_bytes(link, b"one")
    write_bytes(link, b"two")
    assert link.is_symlink()
    assert (tmp_path / "deep" / "down" / "file").read_bytes() == b"two"
    assert [path.name for path in (tmp_path / "deep" / "down").iterdir()] == ["file"]


def test_a_pipe_is_written_to_and_stays_a_pipe(tmp_path: Path) -> None:
    """As are /dev/stdout and /dev/null, which a file moved over them would take away from everyone."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        check_file(pipe)
        write_bytes(pipe, b"said")
        assert os.read(reader, 10) == b"said"
        assert pipe.is_fifo()
    finally:
        os.close(reader)


def test_a_folder_is_made_where_a_link_leads_nowhere(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("not/yet")
    make_folder(tmp_path / "link")
    assert (tmp_path / "not" / "yet").is_dir()


@pytest.mark.parametrize("ask", [check_file, make_folder, lambda path: write_bytes(path, b"")])
def test_what_can_be_no_file_or_folder_is_wrong_input(tmp_path: Path, ask: Callable[[Path], None]) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "loop").symlink_to("loop")
    for name in ("file/x", "file/x/y", "loop/x", "x" * 300, f"{'x' * 300}/y"):
        with pytest.raises(InputError, match="cannot write"):
            ask(tmp_path / name)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "loop"]


@pytest.mark.parametrize(
    ("number", "error"),
    [(errno.ENOSPC, StorageError), (errno.EIO, StorageError), (errno.EROFS, StorageError), (errno.EISDIR, InputError)],
)
def test_a_disk_that_refuses_is_told_from_a_wrong_path(tmp_path: Path, number: int, error: type[Exception]) -> None:
    with pytest.raises(error, match="cannot write"), writing(tmp_path):
        raise OSError(number, os.strerror(number))


@pytest.mark.parametrize(
    ("number", "error"),
    [(errno.EIO, StorageError), (errno.ENOENT, InputError), (errno.EACCES, InputError), (errno.ELOOP, InputError)],
)
def test_a_disk_that_fails_is_told_from_a_file_that_is_not_there(
    tmp_path: Path, number: int, error: type[Exception]
) -> None:
    with pytest.raises(error, match="cannot read the plan"), reading(tmp_path, "plan"):
        raise OSError(number, os.strerror(number))
    with pytest.raises(InputError, match="null"), reading("a\0b", "plan"):
        Path("a\0b").read_bytes()
