"""What a table of a run is: its columns, each with type, unit and meaning."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, slots=True)
class Column:
    """A column: `kind` is its pandas type (Int64 may be missing); a key column helps to identify the row.

    optional  runs of older versions lack it
    """

    name: str
    kind: str
    meaning: str
    unit: str = ""
    key: bool = False
    optional: bool = False


@dataclass(frozen=True)
class Table:
    """A table of a run, stored as <name>.parquet."""

    meaning: str
    columns: tuple[Column, ...]

    @property
    def names(self) -> list[str]:
        """Its columns, in their order."""
        return [column.name for column in self.columns]

    @property
    def required(self) -> list[str]:
        """Those that every run of the table has."""
        return [column.name for column in self.columns if not column.optional]

    @property
    def key(self) -> list[str]:
        """The columns that identify a row."""
        return [column.name for column in self.columns if column.key]

    @property
    def types(self) -> dict[str, str]:
        """Column -> pandas type."""
        return {column.name: column.kind for column in self.columns}

    def frame(self, rows: Iterable[Mapping[str, Any]] = ()) -> pd.DataFrame:
        """The table of these rows, typed even where there are none; what a row lacks is missing."""
        import pandas as pd

        return pd.DataFrame(list(rows), columns=self.names).astype(self.types)


def key_column(name: str, kind: str, meaning: str, unit: str = "") -> Column:
    """A column that helps to identify a row."""
    return Column(name, kind, meaning, unit, key=True)


def table(meaning: str, *columns: Column) -> Table:
    """The table of these columns."""
    return Table(meaning, columns)
