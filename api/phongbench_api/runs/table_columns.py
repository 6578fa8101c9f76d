"""What the columns of a stored table mean, and the values that its rows can be filtered by."""

from typing import Any

import pyarrow.compute as pc

from phongbench.results.columns import Column
from phongbench.results.schema import TABLES
from phongbench_api.runs.row_query import KEYS, opened
from phongbench_api.runs.run_store import RunStore
from phongbench_api.runs.table_cache import TableCache

#: a filter with more values than these is not offered as a list
FEW = 64


def columns(store: RunStore, cache: TableCache, run_name: str, table: str) -> dict[str, Any]:
    """The table, how many rows it has, and its columns in their order; NotFoundError where the run lacks it."""
    run, path, known = opened(store, run_name, table)
    filters = [name for name in KEYS[table] if name in known]
    held = cache.table(path, store.stamp(run), filters)
    told = {column.name: column for column in TABLES[table].columns}
    return {
        "run": run.id,
        "table": table,
        "meaning": TABLES[table].meaning,
        "rows": int(run.manifest["files"][path.name]["rows"]),
        "columns": [
            _column(told.get(name) or Column(name, "", ""), kind)
            | {"filter": name in filters, "values": _values(held.column(name)) if name in filters else None}
            for name, kind in known.items()
        ],
    }


def _column(column: Column, kind: str) -> dict[str, Any]:
    about = {"unit": column.unit, "meaning": column.meaning, "key": column.key}
    return {"name": column.name, "kind": kind, **about}


def _values(column: Any) -> list[Any] | None:
    """The values of a column in their order, None for missing ones last; None where there are many."""
    found: list[Any] = pc.unique(column.combine_chunks()).to_pylist()
    return sorted(found, key=lambda value: (value is None, value)) if len(found) <= FEW else None
