"""Cuts of tables as pandas has them; `records` makes the same of tables that are read without it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from phongbench.results.records import Records
from phongbench.results.schema import RAW

if TYPE_CHECKING:
    import pandas as pd


def strongest(rows: pd.DataFrame) -> pd.DataFrame:
    """Of accuracy rows that differ in their coverage only, the strongest, see `Records.strongest`."""
    return Records.of(rows).strongest().of_frame(rows)


def with_raw(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows with the columns recipe and normalise, which older ones lack: of these every formula took its pair."""
    import pandas as pd

    missing = {name: pd.array([value] * len(rows), dtype="str") for name, value in RAW.items() if name not in rows}
    return rows.assign(**missing) if missing else rows


def as_given(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows of formulas that take their pair of vectors as it is."""
    rows = with_raw(rows)
    raw = (rows["recipe"] != RAW["recipe"]) | (rows["normalise"] != RAW["normalise"])
    return rows[~raw] if raw.any() else rows
