"""What a sweep has measured, written down while it goes on, so that a killed one is resumed."""

import time
from collections.abc import Iterable
from pathlib import Path

import pandas as pd

from phongbench.accuracy import tables
from phongbench.accuracy.sweep import Measured
from phongbench.results import checkpoints

#: finished batches are written down after so many seconds, or so many rows, which bounds the memory
CHECKPOINT_SECONDS, CHECKPOINT_ROWS = 5.0, 10_000


def keep(path: Path, parts: list[pd.DataFrame], measured: Iterable[Measured | pd.DataFrame]) -> None:
    """Write finished batches into a run's folder as they come, and add them to `parts`; what is done when an error ends
    the sweep is kept, too.
    """
    fresh: list[Measured] = []
    written, rows = time.monotonic(), 0
    try:
        for batch in measured:
            if isinstance(batch, pd.DataFrame):  # a part already
                _write(path, parts, batch)
                continue
            fresh.append(batch)
            rows += batch.rows
            if time.monotonic() - written > CHECKPOINT_SECONDS or rows > CHECKPOINT_ROWS:
                append(path, parts, fresh)
                written, rows = time.monotonic(), 0
    finally:
        append(path, parts, fresh)


def append(path: Path, parts: list[pd.DataFrame], fresh: list[Measured]) -> None:
    """Write these batches as the next part, and forget them."""
    if fresh:
        _write(path, parts, tables.part(fresh))
        fresh.clear()


def _write(path: Path, parts: list[pd.DataFrame], frame: pd.DataFrame) -> None:
    checkpoints.append_part(path, len(list((path / checkpoints.PARTS).glob("[0-9]*"))), frame)
    parts.append(frame)
