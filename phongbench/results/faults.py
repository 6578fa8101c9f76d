"""What is wrong with the files of a stored run: each has the bytes and rows that its manifest says, or not."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from phongbench.results.checkpoints import sha256
from phongbench.support.user_paths import is_file


def digests_of(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """SHA-256 of these files, by their names in order; none of a file that cannot be read."""
    digests: dict[str, str] = {}
    for name in sorted(names):
        with suppress(OSError):
            digests[name] = sha256(folder / name)
    return digests


def faults(folder: Path, files: Mapping[str, Mapping[str, Any]], digests: Mapping[str, str]) -> list[str]:
    """What is wrong with each file that is not as it was written, in a sentence.

    files    what the manifest says of them
    digests  those that are known already
    """
    found = {name: _fault(folder / name, files[name], digests.get(name)) for name in sorted(files)}
    return [f"{name}: {fault}" for name, fault in found.items() if fault]


def _fault(path: Path, facts: Mapping[str, Any], digest: str | None) -> str | None:
    """What is wrong with a file of a run; None if it is as it was written."""
    try:
        if not is_file(path):
            return "is missing"
        if (size := path.stat().st_size) != facts["bytes"]:
            return f"has {size} bytes instead of {facts['bytes']}"
        if (digest or sha256(path)) != facts["sha256"]:
            return "its bytes have changed (SHA-256 differs)"
        if _rows_in(path) != facts["rows"]:
            return f"does not have {facts['rows']} rows"
    except (OSError, ValueError) as problem:
        return f"cannot be read: {getattr(problem, 'strerror', None) or problem}"
    return None


def _rows_in(path: Path) -> int:
    """How many rows a table of a run says that it has."""
    import pyarrow.parquet

    return int(pyarrow.parquet.read_metadata(path).num_rows)
