"""The manifest of a stored run, as `runs.load` reads it: whoever wrote it, what it holds has the types it must have."""

import json
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import Any

from phongbench.errors import CorruptRunError, InputError
from phongbench.inputs.plan import PRESETS, Plan
from phongbench.support.user_paths import reading

#: what to do about a run that is not as it was written
REMEDY = "restore the folder from a copy, or run the study again with the same plan and seed"
#: keys that only a manifest of ours has together
_OURS = ("schema", "run")
_NUMBER = (int, float)


@contextmanager
def legible(table: Path) -> Iterator[None]:
    """Turn what goes wrong where a table of a run is read into CorruptRunError."""
    try:
        yield
    except (OSError, ValueError) as problem:
        raise CorruptRunError(f"cannot be read: {problem}", str(table), REMEDY) from problem


def read_manifest(file: Path, schema: int) -> dict[str, Any]:
    """The manifest in this file, of this schema, its types checked.

    InputError where no run of ours is: no file, one that may not be read, or another program's. CorruptRunError where
    one was: the file is not whole, is of another schema, or has values of other types.
    """
    try:
        with reading(file, "manifest", "give the folder of a run; `phongbench list` shows those here"):
            text = file.read_bytes() if file.exists() else None
        data = None if text is None else json.loads(text)
    except (ValueError, RecursionError) as problem:
        raise CorruptRunError(f"is not valid JSON: {problem}", str(file), REMEDY) from problem
    if text is None or (isinstance(data, dict) and data and not any(key in data for key in _OURS)):
        what = "is not a run: it has no manifest" + ("" if text is None else " of ours")
        raise InputError(what, str(file.parent), "`phongbench list` shows the runs")
    if not isinstance(data, dict) or not data.keys() >= _TYPES.keys():
        raise CorruptRunError("is not a phongbench manifest", str(file), REMEDY)
    if data["schema"] != schema:
        what = f"has schema {data['schema']!r}; this phongbench reads {schema}"
        raise CorruptRunError(what, str(file), "use the version that wrote it")
    for key, fits in {**_TYPES, **_OPTIONAL}.items():
        if key in data and not fits(data[key]):
            raise CorruptRunError(f"holds no {key} that this version knows", str(file), REMEDY)
    return data


def _text(value: Any) -> bool:
    return isinstance(value, str)


def _whole(value: Any) -> bool:
    return type(value) is int and value >= 0


def _table(value: Any) -> bool:
    return isinstance(value, dict)


def _texts(value: Any) -> bool:
    return isinstance(value, list) and all(map(_text, value))


def _files(value: Any) -> bool:
    """Tables by the names of their files, which lie in the run's own folder."""
    return isinstance(value, dict) and all(
        re.fullmatch(r"[a-z_]+\.parquet", name)
        and isinstance(facts, dict)
        and _text(facts.get("sha256"))
        and _whole(facts.get("rows"))
        and _whole(facts.get("bytes"))
        for name, facts in value.items()
    )


def _plan(value: Any) -> bool:
    """A plan with fields of ours only, each of the type that it has in a preset."""
    if not isinstance(value, dict):
        return False
    try:
        plan = Plan.from_dict(value)
    except TypeError:
        return False
    return all(_alike(getattr(plan, field.name), getattr(PRESETS["full"], field.name)) for field in fields(Plan))


def _alike(value: Any, usual: Any) -> bool:
    if isinstance(usual, tuple):
        member = usual[0] if usual else ""
        return isinstance(value, tuple) and all(_alike(one, member) for one in value)
    if isinstance(usual, float):
        return isinstance(value, _NUMBER) and not isinstance(value, bool)
    return type(value) is type(usual)


def _shard(value: Any) -> bool:
    """Which shard of how many, what decides its bits, and once it is finished its failures and digests of its files."""
    return (
        isinstance(value, dict)
        and _whole(value.get("index"))
        and _whole(value.get("count"))
        and 1 <= value["index"] <= value["count"]
        and _names(value.get("arithmetic"))
        and _table(value.get("failures", {}))
        and _names(value.get("parts", {}))
    )


def _names(value: Any) -> bool:
    return isinstance(value, dict) and all(map(_text, value.values()))


_TYPES: Mapping[str, Callable[[Any], bool]] = {
    "schema": _whole,
    "run": _text,
    "state": lambda value: value in ("complete", "partial"),
    "plan": _plan,
    "seed": _whole,
    "code": _text,
    "provenance": _table,
    "files": _files,
}
#: keys of complete runs, and those that only some have
_OPTIONAL: Mapping[str, Callable[[Any], bool]] = {
    "with": _texts,
    "violations": _texts,
    "failures": _table,
    "probes": _table,
    "shard": _shard,
    "cluster": lambda value: isinstance(value, dict) and all(map(_whole, value.values())),
    "merged": lambda value: isinstance(value, list) and all(map(_table, value)),
    "seconds": lambda value: isinstance(value, dict) and all(type(v) in _NUMBER for v in value.values()),
}
