"""Schemas of answers: a few words to write them with, those of rows by the tables, and what an answer looks like."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

from phongbench.results.columns import Column, Table

Schema = dict[str, Any]
TEXT: Schema = {"type": "string"}
WHOLE: Schema = {"type": "integer"}
FLAG: Schema = {"type": "boolean"}
#: JSON has no other numbers than finite ones; the others travel as their names
NOT_FINITE: Schema = {"type": "string", "enum": ["NaN", "Infinity", "-Infinity"]}
REAL: Schema = {"anyOf": [{"type": "number"}, NOT_FINITE]}
_KINDS = {"str": TEXT, "bool": FLAG, "int64": WHOLE, "Int64": WHOLE, "float64": REAL}


@dataclass(frozen=True, slots=True)
class Answer:
    """What an operation answers as JSON.

    schema   of every answer; members may be added to it
    example  one answer, of which lists are cut short
    """

    schema: Schema
    example: Any


def or_none(schema: Schema, meaning: str = "") -> Schema:
    """The schema of a value that may be missing, which is null then."""
    choices = [*schema.get("anyOf", [schema]), {"type": "null"}]
    return {"anyOf": choices} | ({"description": meaning} if meaning else {})


def list_of(items: Schema, meaning: str = "") -> Schema:
    """The schema of a list."""
    return {"type": "array", "items": items} | ({"description": meaning} if meaning else {})


def record(members: Mapping[str, Schema], *, optional: Mapping[str, Schema] | None = None, meaning: str = "") -> Schema:
    """The schema of an object with these members, and perhaps others."""
    schema: Schema = {"type": "object", "required": list(members), "properties": {**members, **(optional or {})}}
    return schema | ({"description": meaning} if meaning else {})


def by_name(schema: Schema, meaning: str = "") -> Schema:
    """The schema of an object whose names are data."""
    return {"type": "object", "additionalProperties": schema} | ({"description": meaning} if meaning else {})


def told(schema: Schema, meaning: str) -> Schema:
    """The schema with its meaning."""
    return {**schema, "description": meaning}


def of(example: Any, *missing: str) -> Schema:
    """The schema that an example stands for.

    missing  members, at any depth, that may be null
    """
    if isinstance(example, dict):
        return record({k: or_none(of(v, *missing)) if k in missing else of(v, *missing) for k, v in example.items()})
    if isinstance(example, list | tuple):
        return list_of(of(example[0], *missing)) if example else {"type": "array"}
    kinds = ((bool, FLAG), (int, WHOLE), (float, REAL), (str, TEXT))
    return next((dict(schema) for kind, schema in kinds if isinstance(example, kind)), {"type": "null"})


def answer(example: Any, *missing: str) -> Answer:
    """An answer by its example; `missing` as for `of`."""
    return Answer(of(example, *missing), example)


@cache
def _examples() -> dict[str, Any]:
    text = (resources.files("phongbench_api") / "examples.json").read_text(encoding="utf-8")
    loaded: dict[str, Any] = json.loads(text)
    return loaded


def example(operation: str) -> Any:
    """A real answer of an operation, cut short; `python -m answer_examples` in tests/api writes them."""
    return _examples().get(operation)


def rows(name: str, table: Table) -> Answer:
    """What the rows of a table are answered as; a row has the columns that were asked for."""
    row = record({}, optional={column.name: _cell(column) for column in table.columns}, meaning=table.meaning)
    following = or_none(TEXT, "the `cursor` of the next page; null at the end")
    total = told(WHOLE, "how many rows fit the filters")
    shown = example(f"rows_{name}") or {"rows": [], "total": 0, "next": None}  # of a table that is new
    return Answer(record({"rows": list_of(row), "total": total, "next": following}), shown)


def _cell(column: Column) -> Schema:
    """A value of a column; any may be missing, such as in a run of an older version."""
    unit = f", in {column.unit}" if column.unit and column.unit != "1" else ""
    return or_none(_KINDS[column.kind], column.meaning + unit)
