"""What a sweep has measured, written down while it goes on, so that a killed one is resumed."""

import time
from collections.abc import Iterable
from pathlib import Path

import pandas as pd

from phongbench.accuracy import tables
from phongbench.accuracy.sweep import Measured
from phongbench.results import checkpoints

#: what is finished is written down after so many seconds, or so many rows, which bounds the memory
CHECKPOINT_SECONDS, CHECKPOINT_ROWS = 5.0, 10_000


def keep(path: Path, parts: list[pd.DataFrame], measured: Iterable[Measured | pd.DataFrame]) -> None:
    """Write finished batches, or parts of several, into a run's folder as they come, and add them to `parts`; what is
    done when an error ends the sweep is kept, too.
    """
    fresh: list[Measured | pd.DataFrame] = []
    written, rows = time.monotonic(), 0
    try:
        for one in measured:
            fresh.append(one)
            rows += len(one) if isinstance(one, pd.DataFrame) else one.rows
            if time.monotonic() - written > CHECKPOINT_SECONDS or rows > CHECKPOINT_ROWS:
                append(path, parts, fresh)
                written, rows = time.monotonic(), 0
    finally:
        append(path, parts, fresh)


def append(path: Path, parts: list[pd.DataFrame], fresh: list[Measured | pd.DataFrame]) -> None:
    """Write these as the next part, and forget them; `parts` are all before it."""
    frames = [one for one in fresh if isinstance(one, pd.DataFrame)]
    if batches := [one for one in fresh if not isinstance(one, pd.DataFrame)]:
        frames.append(tables.part(batches))
    if frames:
        whole = pd.concat(frames, ignore_index=True) if len(frames) > 1 else frames[0]
        checkpoints.append_part(path, len(parts), whole)
        parts.append(whole)
        fresh.clear()
