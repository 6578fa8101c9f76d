"""What a study that is under way has finished: numbered parts of its sweep, and each probe's tables.

A killed run is resumed from them.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
