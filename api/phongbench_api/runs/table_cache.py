"""Columns of stored tables, read when first requested and held within a bound of memory.

Names are held as dictionaries of a few words, so that a filter compares whole numbers: a run of a million rows is
filtered in milliseconds.
"""

import threading
from collections import OrderedDict
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from phongbench.errors import CorruptRunError


class TableCache:
    """The columns of stored tables that were used last, at most `limit` bytes of them."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._columns: OrderedDict[tuple[Path, object, str], Any] = OrderedDict()
        self._lock = threading.Lock()

    @property
    def held(self) -> int:
        """Bytes in memory."""
        with self._lock:
            return sum(column.nbytes for column in self._columns.values())

    def table(self, path: Path, stamp: object, names: list[str]) -> Any:
        """A pyarrow table of these columns of a Parquet file whose state is `stamp`."""
        missing = [name for name in names if self._get(path, stamp, name) is None]
        fresh = dict(zip(missing, _read(path, missing), strict=True)) if missing else {}
        columns = [fresh[name] if name in fresh else self._get(path, stamp, name) for name in names]
        if any(column is None for column in columns):  # pushed out meanwhile
            columns = _read(path, names)
        self._store({(path, stamp, name): column for name, column in fresh.items()})
        return pa.table(dict(zip(names, columns, strict=True)))

    def _get(self, path: Path, stamp: object, name: str) -> Any:
        with self._lock:
            key = (path, stamp, name)
            if key in self._columns:
                self._columns.move_to_end(key)
            return self._columns.get(key)

    def _store(self, columns: dict[tuple[Path, object, str], Any]) -> None:
        with self._lock:
            self._columns |= columns
            total = sum(column.nbytes for column in self._columns.values())
            while total > self._limit and self._columns:
                total -= self._columns.popitem(last=False)[1].nbytes


def column_kinds(path: Path) -> dict[str, str]:
    """The columns of a Parquet file with their types: text, whole, real or flag."""
    try:
        return {field.name: _kind(field.type) for field in pq.read_schema(path)}
    except (OSError, pa.ArrowException) as problem:
        raise CorruptRunError(f"cannot be read: {type(problem).__name__}", str(path)) from problem


def _kind(kind: Any) -> str:
    if pa.types.is_boolean(kind):
        return "flag"
    return "whole" if pa.types.is_integer(kind) else "real" if pa.types.is_floating(kind) else "text"


def _read(path: Path, wanted: list[str]) -> list[Any]:
    try:
        table = pq.read_table(path, columns=wanted, use_threads=False)
    except (OSError, pa.ArrowException) as problem:
        raise CorruptRunError(f"cannot be read: {type(problem).__name__}", str(path)) from problem
    return [_compact(table.column(name).combine_chunks()) for name in wanted]


def _compact(column: Any) -> Any:
    text = pa.types.is_string(column.type) or pa.types.is_large_string(column.type)
    return column.dictionary_encode() if text else column
