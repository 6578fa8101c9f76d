"""Rows of a stored run: filtered, sorted, cut into pages, written as JSON, CSV or Parquet."""

import base64
import hashlib
import io
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import orjson
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq
from starlette.requests import Request
from starlette.responses import Response

from phongbench.results.schema import TABLES
from phongbench_api.http import media as wire
from phongbench_api.http.problems import NotFoundError, RequestError
from phongbench_api.runs import table_cache
from phongbench_api.service import Service

FAMILY = (wire.JSON, wire.CSV, wire.PARQUET)
EXAMPLE: dict[str, Any] = {"rows": [], "total": 0, "next": None}
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


@dataclass(frozen=True, slots=True)
class RowsAsk:
    """What rows: filters by column, columns to tell, order, page."""

    filters: dict[str, list[str]]
    columns: list[str] | None
    sort: list[tuple[str, str]]
    limit: int
    cursor: str | None

    def digest(self, table: str) -> str:
        """Changes with all that decides the order of the rows, but not with the page."""
        told = orjson.dumps([table, sorted(self.filters.items()), self.sort])
        return hashlib.sha256(told).hexdigest()[:12]


def asked(request: Request, table: str, most: int) -> RowsAsk:
    """The parameters of a request for rows; RequestError names the one that is wrong."""
    filters: dict[str, list[str]] = {}
    plain: dict[str, str] = {}
    pairs = request.query_params.multi_items()
    if len(pairs) > _MOST_FILTERS:
        raise RequestError(f"more than {_MOST_FILTERS} parameters", "(query)")
    for name, value in pairs:
        if name in ("columns", "sort", "limit", "cursor"):
            if name in plain:
                raise RequestError("is given twice", name)
            plain[name] = value
        elif name in KEYS[table]:
            filters.setdefault(name, []).append(value)
        else:
            known = ", ".join((*KEYS[table], "columns", "sort", "limit", "cursor"))
            raise RequestError("a parameter that rows do not have", "(unknown)", f"known: {known}")
    order = [
        (word.removeprefix("-"), "descending" if word.startswith("-") else "ascending")
        for word in plain.get("sort", "").split(",")
        if word
    ]
    chosen = [word for word in plain["columns"].split(",") if word] if "columns" in plain else None
    return RowsAsk(filters, chosen, order, _limit(plain.get("limit"), most), plain.get("cursor"))


def _limit(text: str | None, most: int) -> int:
    if text is None:
        return min(DEFAULT_LIMIT, most)
    if not (text.isascii() and text.isdigit() and len(text) < 10 and 1 <= int(text) <= most):
        raise RequestError(f"must be a whole number from 1 to {most}", "limit")
    return int(text)


def page(service: Service, run_name: str, table: str, ask: RowsAsk, gone: Callable[[], bool]) -> dict[str, Any]:
    """`rows` as a pyarrow table, `total` rows that fit the filters, and the cursor of the `next` page or None."""
    run = service.store.intact(run_name)
    path = run.path / f"{table}.parquet"
    if path.name not in run.manifest["files"]:
        raise NotFoundError(f"the run has no table {table}")
    known = table_cache.names(path)
    chosen = _known(ask.columns if ask.columns is not None else list(known), known, "columns")
    _known([name for name, _ in ask.sort], known, "sort")
    needed = list(dict.fromkeys([*ask.filters, *(name for name, _ in ask.sort)]))
    _known(needed, known, "(query)")
    stamp = service.store.stamp(run)
    picked = _positions(service.columns.table(path, stamp, needed), ask, known) if needed else None
    total = len(picked) if picked is not None else int(run.manifest["files"][path.name]["rows"])
    start = _start(ask, table, total)
    whole = service.columns.table(path, stamp, chosen)
    rows = whole.take(picked.slice(start, ask.limit)) if picked is not None else whole.slice(start, ask.limit)
    end = start + rows.num_rows
    return {"rows": rows, "total": total, "next": _cursor(ask, table, end) if end < total else None}


def _known(wanted: list[str], known: dict[str, Any], field: str) -> list[str]:
    if (not wanted and field == "columns") or len(set(wanted)) != len(wanted) or not set(wanted) <= set(known):
        raise RequestError("names a column that is not there, or one twice", field, f"known: {', '.join(known)}")
    return wanted


def _positions(table: Any, ask: RowsAsk, known: dict[str, str]) -> Any:
    """The positions of the rows that fit, in the order asked for; equal rows keep the file's order."""
    mask = None
    for name, words in ask.filters.items():
        fits = _fits(table.column(name), words, known[name], name)
        mask = fits if mask is None else pc.and_(mask, fits)
    found = pa.array(range(0)) if mask is None else pc.indices_nonzero(pc.fill_null(mask, False))
    if not ask.sort:
        return found
    part = table if mask is None else table.take(found)
    plain = pa.table({name: _plain(part.column(name)) for name, _ in ask.sort})
    order = pc.sort_indices(plain, sort_keys=ask.sort)
    return order if mask is None else pc.take(found, order)


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


def _cursor(ask: RowsAsk, table: str, start: int) -> str:
    return base64.urlsafe_b64encode(f"{ask.digest(table)}.{start}".encode()).decode().rstrip("=")


def _start(ask: RowsAsk, table: str, total: int) -> int:
    if ask.cursor is None:
        return 0
    try:
        text = base64.urlsafe_b64decode(ask.cursor + "=" * (-len(ask.cursor) % 4)).decode("ascii")
    except ValueError:
        text = ""
    digest, _, start = text.partition(".")
    if digest != ask.digest(table) or not start.isdigit() or len(start) > 12 or int(start) > total:
        raise RequestError("is not the `next` of an answer to this question", "cursor", "begin again without it")
    return int(start)


def cost(ask: RowsAsk) -> float:
    """Predicted seconds of a page."""
    return PAGE + ask.limit * VALUE * (len(ask.columns) if ask.columns else _USUAL_COLUMNS)


def answer(media: str, found: dict[str, Any], spans: wire.Spans) -> Response:
    """The page in the media type asked for; outside JSON, total and next are headers."""
    write: dict[str, Callable[[Any], bytes]] = {wire.CSV: _csv, wire.PARQUET: _parquet}
    body = _json(found) if media == wire.JSON else write[media](found["rows"])
    spans.mark("encode")
    headers = {"phongbench-total": str(found["total"])} | ({"phongbench-next": found["next"]} if found["next"] else {})
    return Response(body, headers=headers | spans.header(), media_type=media)


def _json(found: dict[str, Any]) -> bytes:
    """The page as JSON, written piece by piece: other threads get the interpreter in between."""
    rows = found["rows"]
    pieces = [_records(rows.slice(start, _PIECE)) for start in range(0, rows.num_rows, _PIECE)]
    rest = orjson.dumps({"total": found["total"], "next": found["next"]})
    return b'{"rows":[' + b",".join(pieces) + b"]," + rest[1:]


def _records(rows: Any) -> bytes:
    columns = [_values(rows.column(name)) for name in rows.column_names]
    names = rows.column_names
    return orjson.dumps([dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)])[1:-1]


def _values(column: Any) -> list[Any]:
    """A column's values as JSON can tell them."""
    values: list[Any] = _plain(column).to_pylist()
    return wire.strict(values) if pa.types.is_floating(column.type) else values


def _csv(rows: Any) -> bytes:
    out = io.BytesIO()
    pa_csv.write_csv(pa.table({name: _plain(rows.column(name)) for name in rows.column_names}), out)
    return out.getvalue()


def _parquet(rows: Any) -> bytes:
    out = io.BytesIO()
    pq.write_table(rows, out, compression="zstd")
    return out.getvalue()


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
    }
    return many + [{"name": n, "in": "query", "schema": s, "description": d} for n, (s, d) in one.items()]
