"""What a study that is under way has finished: numbered parts of its sweep, and each probe's tables.

A killed run is resumed from them. A shard keeps single blocks, too, of the batches that it shares with another.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from phongbench.errors import CorruptRunError
from phongbench.support.atomic_files import write_text, write_whole

if TYPE_CHECKING:
    import pandas as pd

#: folder of the parts, in that of the run
PARTS = "parts"


def append_part(path: Path, number: int, frame: pd.DataFrame) -> None:
    """Write finished work of a sweep that still runs."""
    write_whole(path / PARTS / f"{number:06d}.parquet", lambda p: frame.to_parquet(p, engine="pyarrow", index=False))


def read_parts(path: Path) -> list[pd.DataFrame]:
    """The parts written so far, in order. CorruptRunError names one that cannot be read."""
    import pandas as pd

    frames = []
    for file in sorted((path / PARTS).glob("[0-9]*.parquet")):
        try:
            frames.append(pd.read_parquet(file))
        except (OSError, ValueError) as problem:
            raise CorruptRunError(f"cannot be read: {problem}", str(file), "start over with --fresh") from problem
    return frames


def write_probe(path: Path, probe: str, tables: Mapping[str, pd.DataFrame], facts: Mapping[str, Any]) -> None:
    """Write what a finished probe has measured, whole: a resumed run does not measure it again.

    facts  what it says beside its tables, as plain data for JSON
    """
    box = path / PARTS / f"{probe}.{{}}.parquet"
    for name, frame in tables.items():
        file = Path(str(box).format(name))
        write_whole(file, partial(frame.to_parquet, engine="pyarrow", index=False))
    done = json.dumps({"tables": sorted(tables), "facts": facts})
    write_whole(path / PARTS / f"{probe}.json", lambda p: write_text(p, done))


def read_probe(path: Path, probe: str) -> tuple[dict[str, pd.DataFrame], dict[str, Any]] | None:
    """The tables and facts that `write_probe` wrote; None if the probe has not finished."""
    import pandas as pd

    note = path / PARTS / f"{probe}.json"
    if not note.is_file():
        return None
    try:
        done = json.loads(note.read_text(encoding="utf-8"))
        tables = {name: pd.read_parquet(path / PARTS / f"{probe}.{name}.parquet") for name in done["tables"]}
        return tables, done["facts"]
    except (OSError, ValueError, KeyError) as problem:
        raise CorruptRunError(f"cannot be read: {problem}", str(note), "start over with --fresh") from problem


def write_block(path: Path, batch: int, start: int, arrays: Mapping[str, Any]) -> None:
    """Write what was measured of one slab of a batch, the slab that begins at this pair."""

    def write(file: Path) -> None:
        with file.open("wb") as stream:
            np.savez_compressed(stream, **arrays)

    write_whole(path / PARTS / f"block-{batch:07d}-{start:012d}.npz", write)


def block_files(path: Path) -> dict[tuple[int, int], Path]:
    """The files that `write_block` wrote, by batch and start, in their order."""
    files = sorted((path / PARTS).glob("block-*.npz"))
    named = [(re.fullmatch(r"block-([0-9]{7,})-([0-9]{12,})\.npz", file.name), file) for file in files]
    return dict(sorted(((int(words[1]), int(words[2])), file) for words, file in named if words))


def read_block(file: Path) -> dict[str, NDArray[Any]]:
    """The arrays of a block. CorruptRunError if it cannot be read."""
    try:
        # opened here: NumPy leaves a file open that is no archive
        with file.open("rb") as stream, np.load(stream, allow_pickle=False) as arrays:
            return dict(arrays)
    except (OSError, ValueError, EOFError, BadZipFile) as problem:
        raise CorruptRunError(f"cannot be read: {problem}", str(file), "start over with --fresh") from problem


def digests(path: Path) -> dict[str, str]:
    """SHA-256 of every file of finished work, by its name."""
    return {file.name: sha256(file) for file in sorted((path / PARTS).glob("[!.]*")) if file.is_file()}


def sha256(file: Path) -> str:
    """The SHA-256 of a file, in hex digits."""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
