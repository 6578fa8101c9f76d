"""Rows of a stored run: filtered, sorted, cut into pages, written as JSON, CSV or Parquet."""

import base64
import hashlib
import io
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import orjson
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq
from starlette.requests import Request
from starlette.responses import Response

from phongbench.results.runs import Run
from phongbench.results.schema import TABLES
from phongbench.support.strict_json import strict
from phongbench_api.http import media
from phongbench_api.http.problems import NotFoundError, RequestError
from phongbench_api.runs.run_store import RunStore
from phongbench_api.runs.table_cache import TableCache, column_kinds

#: by what a request may name them, where it cannot send Accept: a link, or pandas' readers
FORMATS = {"json": media.JSON, "csv": media.CSV, "parquet": media.PARQUET}
FAMILY = tuple(FORMATS.values())
DEFAULT_LIMIT = 1000
#: predicted seconds of a page: filter, sort, write
PAGE = 0.05
#: and of writing one value of it
VALUE = 4e-7
_USUAL_COLUMNS = 32
_PIECE = 1000
#: what a request may filter by, per table
KEYS = {
    name: [column for column in table.names if column in (*table.key, "verdict", "outcome")]
    for name, table in TABLES.items()
}
_MOST_FILTERS = 64
_PLAIN = ("columns", "sort", "limit", "cursor", "format")


@dataclass(frozen=True, slots=True)
class RowQuery:
    """Which rows: filters by column, columns to give, order, page; and as what, None: as Accept says."""

    filters: dict[str, list[str]]
    columns: list[str] | None
    sort: list[tuple[str, str]]
    limit: int
    cursor: str | None
    media_type: str | None

    def digest(self, table: str) -> str:
        """Changes with all that decides the order of the rows, but not with the page."""
        decisive = orjson.dumps([table, sorted(self.filters.items()), self.sort])
        return hashlib.sha256(decisive).hexdigest()[:12]


def requested(request: Request, table: str, most: int) -> RowQuery:
    """The parameters of a request for rows; RequestError names the one that is wrong."""
    filters: dict[str, list[str]] = {}
    plain: dict[str, str] = {}
    pairs = request.query_params.multi_items()
    if len(pairs) > _MOST_FILTERS:
        raise RequestError(f"more than {_MOST_FILTERS} parameters", "(query)")
    for name, value in pairs:
        if name in _PLAIN:
            if name in plain:
                raise RequestError("is given twice", name)
            plain[name] = value
        elif name in KEYS[table]:
            filters.setdefault(name, []).append(value)
        else:
            known = ", ".join((*KEYS[table], *_PLAIN))
            raise RequestError("a parameter that rows do not have", "(unknown)", f"known: {known}")
    order = [
        (word.removeprefix("-"), "descending" if word.startswith("-") else "ascending")
        for word in plain.get("sort", "").split(",")
        if word
    ]
    chosen = [word for word in plain["columns"].split(",") if word] if "columns" in plain else None
    if plain.get("format", "json") not in FORMATS:
        raise RequestError(f"must be one of {', '.join(FORMATS)}", "format")
    media_type = FORMATS.get(plain.get("format", ""))
    return RowQuery(filters, chosen, order, _limit(plain.get("limit"), most), plain.get("cursor"), media_type)


def _limit(text: str | None, most: int) -> int:
    if text is None:
        return min(DEFAULT_LIMIT, most)
    if not (text.isascii() and text.isdigit() and len(text) < 10 and 1 <= int(text) <= most):
        raise RequestError(f"must be a whole number from 1 to {most}", "limit")
    return int(text)


def page(store: RunStore, cache: TableCache, run_name: str, table: str, query: RowQuery) -> dict[str, Any]:
    """`rows` as a pyarrow table, `total` rows that fit the filters, and the cursor of the `next` page or None."""
    run, path, known = opened(store, run_name, table)
    chosen = _known(query.columns if query.columns is not None else list(known), known, "columns")
    _known([name for name, _ in query.sort], known, "sort")
    needed = list(dict.fromkeys([*query.filters, *(name for name, _ in query.sort)]))
    _known(needed, known, "(query)")
    stamp = store.stamp(run)
    picked = _positions(cache.table(path, stamp, needed), query, known) if needed else None
    total = len(picked) if picked is not None else int(run.manifest["files"][path.name]["rows"])
    start = _start(query, table, total)
    whole = cache.table(path, stamp, chosen)
    rows = whole.take(picked.slice(start, query.limit)) if picked is not None else whole.slice(start, query.limit)
    end = start + rows.num_rows
    return {"rows": rows, "total": total, "next": _cursor(query, table, end) if end < total else None}


def opened(store: RunStore, run_name: str, table: str) -> tuple[Run, Path, dict[str, str]]:
    """The run, the file of its table, and the columns of that with their kinds; NotFoundError where it has none."""
    run = store.intact(run_name)
    path = run.path / f"{table}.parquet"
    if path.name not in run.manifest["files"]:
        raise NotFoundError(f"the run has no table {table}")
    return run, path, column_kinds(path)


def _known(wanted: list[str], known: dict[str, Any], field: str) -> list[str]:
    if (not wanted and field == "columns") or len(set(wanted)) != len(wanted) or not set(wanted) <= set(known):
        raise RequestError("names a column that is not there, or one twice", field, f"known: {', '.join(known)}")
    return wanted


def _positions(table: Any, query: RowQuery, known: dict[str, str]) -> Any:
    """The positions of the rows that fit, in the requested order; equal rows keep the file's order."""
    mask = None
    for name, words in query.filters.items():
        fits = _fits(table.column(name), words, known[name], name)
        mask = fits if mask is None else pc.and_(mask, fits)
    fitting = pa.array(range(0)) if mask is None else pc.indices_nonzero(pc.fill_null(mask, False))
    if not query.sort:
        return fitting
    part = table if mask is None else table.take(fitting)
    plain = pa.table({name: _plain(part.column(name)) for name, _ in query.sort})
    order = pc.sort_indices(plain, sort_keys=query.sort)
    return order if mask is None else pc.take(fitting, order)


def _plain(column: Any) -> Any:
    return column.cast(column.type.value_type) if pa.types.is_dictionary(column.type) else column


def _fits(column: Any, words: list[str], kind: str, name: str) -> Any:
    """Which entries equal one of the words; "none" also means an entry that is missing."""
    column = column.combine_chunks()
    wanted = [value for word in words if (value := _value(word, kind, name)) is not None]
    missing = pc.is_null(column) if any(word == "none" for word in words) else None
    if pa.types.is_dictionary(column.type):
        hits = pc.is_in(column.dictionary, value_set=pa.array(wanted, type=column.dictionary.type))
        fits = pc.take(hits, column.indices)
    else:
        fits = pc.is_in(column, value_set=pa.array(wanted, type=column.type))
    return fits if missing is None else pc.or_kleene(pc.fill_null(fits, False), missing)


def _value(word: str, kind: str, name: str) -> Any:
    if kind == "text":
        return word
    if word == "none":
        return None
    if kind == "flag" and word in ("true", "false"):
        return word == "true"
    try:
        number = float(word)
    except ValueError:
        number = math.nan
    wanted = {"flag": "true or false", "whole": "a whole number"}.get(kind, "a number")
    if kind == "flag" or not math.isfinite(number) or (kind == "whole" and (number % 1 or abs(number) > 2**53)):
        raise RequestError(f"must be {wanted}", name)
    return int(number) if kind == "whole" else number


def _cursor(query: RowQuery, table: str, start: int) -> str:
    return base64.urlsafe_b64encode(f"{query.digest(table)}.{start}".encode()).decode().rstrip("=")


def _start(query: RowQuery, table: str, total: int) -> int:
    if query.cursor is None:
        return 0
    try:
        text = base64.urlsafe_b64decode(query.cursor + "=" * (-len(query.cursor) % 4)).decode("ascii")
    except ValueError:
        text = ""
    digest, _, start = text.partition(".")
    if digest != query.digest(table) or not start.isdigit() or len(start) > 12 or int(start) > total:
        raise RequestError("is not the `next` of an answer to this question", "cursor", "begin again without it")
    return int(start)


def cost(query: RowQuery) -> float:
    """Predicted seconds of a page."""
    return PAGE + query.limit * VALUE * (len(query.columns) if query.columns else _USUAL_COLUMNS)


def answer(media_type: str, page: dict[str, Any], spans: media.Spans) -> Response:
    """The page in this media type; outside JSON, total and next are headers."""
    write: dict[str, Callable[[Any], bytes]] = {media.CSV: _csv, media.PARQUET: _parquet}
    body = _json(page) if media_type == media.JSON else write[media_type](page["rows"])
    headers = {"phongbench-total": str(page["total"])} | ({"phongbench-next": page["next"]} if page["next"] else {})
    return media.response(body, media_type, spans, headers)


def _json(page: dict[str, Any]) -> bytes:
    """The page as JSON, written piece by piece: other threads get the interpreter in between."""
    rows = page["rows"]
    pieces = [_records(rows.slice(start, _PIECE)) for start in range(0, rows.num_rows, _PIECE)]
    rest = orjson.dumps({"total": page["total"], "next": page["next"]})
    return b'{"rows":[' + b",".join(pieces) + b"]," + rest[1:]


def _records(rows: Any) -> bytes:
    columns = [_values(rows.column(name)) for name in rows.column_names]
    names = rows.column_names
    return orjson.dumps([dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)])[1:-1]


def _values(column: Any) -> list[Any]:
    """A column's values as JSON has them."""
    values: list[Any] = _plain(column).to_pylist()
    return strict(values) if pa.types.is_floating(column.type) else values


def _csv(rows: Any) -> bytes:
    out = io.BytesIO()
    pa_csv.write_csv(pa.table({name: _plain(rows.column(name)) for name in rows.column_names}), out)
    return out.getvalue()


def _parquet(rows: Any) -> bytes:
    out = io.BytesIO()
    pq.write_table(rows, out, compression="zstd")
    return out.getvalue()


def request(table: str) -> str:
    """A request for some rows and columns of a table, for the documentation."""
    known = TABLES[table]
    columns = [*known.key[:4], *(name for name in known.names if name not in known.key)][:7]
    chosen = "approximation=lyon&" if "approximation" in known.key else ""
    return f"/v1/runs/latest/{table}?{chosen}columns={','.join(columns)}&limit=2"


def parameters(table: str) -> list[dict[str, Any]]:
    """The query of a table for the OpenAPI."""
    many = [
        {
            "name": name,
            "in": "query",
            "schema": {"type": "array", "items": {"type": "string"}},
            "explode": True,
            "description": f"rows whose {name} is one of these; `none`: where it is missing",
        }
        for name in KEYS[table]
    ]
    one = {
        "columns": ({"type": "string"}, "names separated by commas; left out: all"),
        "sort": ({"type": "string"}, "names separated by commas, each with `-` before it for descending"),
        "limit": ({"type": "integer", "minimum": 1, "maximum": 50_000, "default": DEFAULT_LIMIT}, "rows of an answer"),
        "cursor": ({"type": "string"}, "`next` of the answer before"),
        "format": ({"type": "string", "enum": [*FORMATS]}, "instead of Accept, which a link cannot send"),
    }
    return many + [{"name": n, "in": "query", "schema": s, "description": d} for n, (s, d) in one.items()]
