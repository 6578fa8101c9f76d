"""Rows of a table as records: plain dicts, None for what is missing; chosen by their columns, and read without pandas.

To import pandas takes longer than most answers. A table is held column by column as NumPy has it, text as numbers that
stand for its distinct values, so that rows are chosen before any is made; of a file only the columns that are asked
about are read.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from phongbench.results.manifests import legible
from phongbench.results.schema import CASE, COVERAGES, RAW, TABLES

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

Row = dict[str, Any]


@dataclass(frozen=True)
class Column:
    """A column: numbers, NaN where one is missing, or places in `names`, -1 where text is missing.

    values  (n,) of float64, bool or int
    names   the distinct texts; None for a column of numbers
    whole   whether the numbers stand for whole ones, though some are missing
    """

    values: NDArray[Any]
    names: Sequence[str] | None = None
    whole: bool = False

    def equal(self, places: NDArray[np.intp], values: Sequence[Any]) -> NDArray[np.bool_]:
        """At which of these places it has one of the values."""
        if self.names is not None:
            values = [self.names.index(value) for value in values if value in self.names]
        held = self.values[places]
        return np.logical_or.reduce([held == value for value in values]) if values else np.zeros(len(held), bool)

    def at(self, places: NDArray[np.intp]) -> list[Any]:
        """Its values there."""
        held = self.values[places]
        if self.names is not None:
            texts = [*self.names, None]
            return [texts[place] for place in held.tolist()]
        if self.values.dtype.kind != "f":
            return list(held.tolist())
        number = int if self.whole else float
        return [number(value) if value == value else None for value in held.tolist()]


@dataclass(frozen=True)
class Records:
    """Rows of a table, in its order.

    load    names of columns -> these columns; asked once for each
    known   the columns that there are
    places  of the rows in the table, (n,)
    """

    load: Callable[[Sequence[str]], Mapping[str, Column]]
    known: Sequence[str]
    places: NDArray[np.intp]

    @staticmethod
    def of(frame: pd.DataFrame) -> Records:
        """The rows of a frame."""
        return _kept(lambda names: {name: _of_series(frame[name]) for name in names}, list(frame.columns), len(frame))

    @staticmethod
    def none(name: str) -> Records:
        """No rows of a table of a run."""
        return _kept(lambda names: dict.fromkeys(names, Column(np.zeros(0))), TABLES[name].names, 0)

    @staticmethod
    def read(file: Path, name: str, more: Mapping[str, Any]) -> Records:
        """The rows of a table of a run in its file.

        name  of the table
        more  values of columns that the file lacks
        Raises CorruptRunError where it cannot be read, if need be when a column is first asked about.
        """
        from pyarrow import parquet

        with legible(file):
            facts = parquet.read_metadata(file)
            held, count = facts.schema.to_arrow_schema().names, facts.num_rows
            texts = [column.name for column in TABLES[name].columns if column.kind == "str" and column.name in held]
        usual = {key: value for key, value in more.items() if key not in held}
        keys = [key for key in TABLES[name].key if key in held]

        def load(names: Sequence[str]) -> Mapping[str, Column]:
            wanted = dict.fromkeys([*names, *(keys if set(names) & set(keys) else ())])  # together in less time
            # opened for each reading: who keeps a run, as a service does, is not to keep its files open
            with legible(file), parquet.ParquetFile(file, read_dictionary=texts, memory_map=True) as stored:
                if stored.metadata.num_rows != count:
                    raise ValueError("it was replaced while it was read")
                table = stored.read([key for key in wanted if key not in usual])
                columns = {key: _of_arrow(table.column(key), key) for key in table.column_names}
            return columns | {key: _constant(usual[key], count) for key in names if key in usual}

        return _kept(load, [*held, *usual], count)

    def __len__(self) -> int:
        return len(self.places)

    def at(self, **wanted: Any) -> Records:
        """The rows whose columns equal the wanted values; a tuple means any of its values."""
        columns, places = self.load(list(wanted)), self.places
        for name, value in wanted.items():
            places = places[columns[name].equal(places, value if isinstance(value, tuple) else (value,))]
        return replace(self, places=places)

    def together(self, other: Records) -> Records:
        """These rows and those that another cut of the same table has besides, in its order."""
        return replace(self, places=_ascending(np.concatenate([self.places, other.places])))

    def distinct(self, name: str) -> list[Any]:
        """The values of a column, ascending; what is missing is none."""
        column = self.load([name])[name]
        if column.names is not None:
            counts = np.bincount(column.values[self.places] + np.intp(1), minlength=len(column.names) + 1)[1:]
            return sorted(text for text, count in zip(column.names, counts.tolist(), strict=True) if count)
        return [value for value in _ascending(column.values[self.places]).tolist() if value == value]

    def of_frame(self, frame: pd.DataFrame) -> pd.DataFrame:
        """The same rows of the frame that they were made of."""
        return frame.iloc[self.places]

    def rows(self, names: Iterable[str]) -> list[Row]:
        """These columns of every row."""
        wanted = list(names)
        columns = self.load(wanted)
        lists = [columns[name].at(self.places) for name in wanted]
        return [dict(zip(wanted, row, strict=True)) for row in zip(*lists, strict=True)]

    def as_given(self) -> Records:
        """The rows of formulas that take their pair of vectors as it is."""
        return self.at(**RAW)

    def strongest(self) -> Records:
        """Of rows that differ in their coverage only, the strongest; the order of the rest is kept."""
        if "coverage" not in self.known or not len(self):
            return self
        same = [name for name in CASE if name in self.known]
        columns = self.load([*same, "coverage"])
        held = columns["coverage"]
        rank = np.array([COVERAGES.index(name) for name in held.names or ()])[held.values[self.places]]
        if (rank == rank[0]).all():
            return self
        case = np.zeros(len(self), np.int64)
        for name in same:  # one number for each case
            case = _numbered(case) * len(self) + _numbered(columns[name].values[self.places])
        order = np.lexsort((rank, case))  # keeps the order of equals
        last = np.append(case[order][1:] != case[order][:-1], True)
        return replace(self, places=self.places[np.sort(order[last])])


def by(names: Iterable[str]) -> Callable[[Row], tuple[tuple[bool, Any], ...]]:
    """To sort rows by these columns, ascending, what is missing last."""
    wanted = list(names)
    return lambda row: tuple((row[name] is None, row[name]) for name in wanted)


def key(names: Iterable[str]) -> Callable[[Row], tuple[Any, ...]]:
    """What rows of the same values have in common."""
    wanted = list(names)
    return lambda row: tuple(row[name] for name in wanted)


def first_of(rows: Iterable[Row], names: Iterable[str]) -> list[Row]:
    """The first row of each that have the same values in these columns."""
    found: dict[tuple[Any, ...], Row] = {}
    identity = key(names)
    for row in rows:
        found.setdefault(identity(row), row)
    return list(found.values())


def _kept(load: Callable[[Sequence[str]], Mapping[str, Column]], known: Sequence[str], count: int) -> Records:
    columns: dict[str, Column] = {}

    def remembered(names: Sequence[str]) -> Mapping[str, Column]:
        if lacking := [name for name in dict.fromkeys(names) if name not in columns]:
            columns.update(load(lacking))
        return columns

    return Records(remembered, known, np.arange(count))


def _ascending(values: NDArray[Any]) -> NDArray[Any]:
    """Each value once, NaN not at all; np.unique imports masked arrays for that."""
    held = np.sort(values)
    return held[np.append(held[:-1] != held[1:], True) & (held == held)] if len(held) else held


def _numbered(values: NDArray[Any]) -> NDArray[np.int64]:
    """A number for each value, the same for equal ones, NaN among them."""
    return np.searchsorted(_ascending(values), values)


def _constant(value: Any, count: int) -> Column:
    return Column(np.zeros(count, np.intp), [value]) if isinstance(value, str) else Column(np.full(count, value))


def _of_arrow(column: pa.ChunkedArray, name: str) -> Column:
    import pyarrow as pa

    kinds = (pa.types.is_dictionary, pa.types.is_boolean, pa.types.is_integer, pa.types.is_floating)
    if not any(kind(column.type) for kind in kinds):
        raise ValueError(f"{name} holds {column.type}")
    if not pa.types.is_dictionary(column.type):
        return Column(_numbers(column.combine_chunks()), whole=pa.types.is_integer(column.type))
    one: Any = column.unify_dictionaries().combine_chunks()
    one = one.chunk(0) if isinstance(one, pa.ChunkedArray) and one.num_chunks else one
    if isinstance(one, pa.ChunkedArray):  # of no rows
        return Column(np.zeros(0, np.intp), [])
    places = _numbers(one.indices)
    return _of_names(np.where(places >= 0, places, -1), one.dictionary.to_pylist())


def _of_names(places: NDArray[Any], names: Sequence[str]) -> Column:
    """Text in an eighth of the memory, where there are few distinct ones, as there are."""
    return Column(places.astype(np.int8 if len(names) < 128 else np.int64), names)


def _numbers(array: pa.Array) -> NDArray[Any]:
    """The numbers or truths of an array, NaN where one is missing; pyarrow itself would import pandas."""
    import pyarrow as pa

    valid, data = array.buffers()
    held = slice(array.offset, array.offset + len(array))
    if pa.types.is_boolean(array.type):
        return _bits(data, held).astype(bool)
    letter = "f" if pa.types.is_floating(array.type) else "i"
    values = np.frombuffer(data, f"{letter}{array.type.bit_width // 8}")[held] if len(array) else np.zeros(0)
    return np.where(_bits(valid, held), values, np.nan) if array.null_count else values


def _bits(buffer: Any, held: slice) -> NDArray[np.uint8]:
    return np.unpackbits(np.frombuffer(buffer, np.uint8), bitorder="little")[held]


def _of_series(column: pd.Series[Any]) -> Column:
    kind = column.dtype.kind
    if kind in "bf" or (kind in "iu" and not column.hasnans):
        return Column(np.asarray(column.to_numpy()))
    if kind in "iu":
        return Column(column.to_numpy(np.float64, na_value=np.nan), whole=True)
    places, names = column.factorize()
    if all(isinstance(name, str) for name in names):
        return _of_names(np.asarray(places), list(names))
    numbers = np.array([*names, np.nan], np.float64)[places]
    return Column(numbers, whole=all(isinstance(name, int) for name in names))
