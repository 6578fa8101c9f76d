"""Cuts of tables as pandas has them; `records` makes the same of tables that are read without it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from phongbench.results.manifests import legible
from phongbench.results.records import Records
from phongbench.results.schema import RAW

if TYPE_CHECKING:
    import pandas as pd


def read_frame(file: Path, *, compact: bool = False) -> pd.DataFrame:
    """A table of a run, compact as `compacted` makes it. CorruptRunError where it cannot be read."""
    from pyarrow import parquet, types

    with legible(file):
        kinds = {field.name: field.type for field in parquet.read_schema(file)}
        text = [name for name, kind in kinds.items() if types.is_string(kind) or types.is_large_string(kind)]
        table = parquet.read_table(file, read_dictionary=text if compact else None)
        # column by column, each freed when it is converted: both whole need twice the memory
        frame = table.to_pandas(split_blocks=True, self_destruct=True)
    return compacted(frame) if compact else frame


def compacted(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows with text as categories, in the order of strings: numbers are shared, and cuts are half as large."""
    rows = rows.astype({name: "category" for name in rows.columns if rows[name].dtype == "str"})
    held = {name: rows[name].cat for name in rows.columns if rows[name].dtype == "category"}
    return rows.assign(**{name: text.reorder_categories(sorted(text.categories)) for name, text in held.items()})


def plain(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows with categories as strings: they sort and compare alike, however a file holds them."""
    names = [name for name in rows.columns if rows[name].dtype == "category"]
    return rows.astype(dict.fromkeys(names, "str")) if names else rows


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
