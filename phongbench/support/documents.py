"""Strict reading of a document, TOML or JSON: every value is typed, every key is known, every error names its line."""

import json
import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from phongbench.errors import InputError, UnknownNameError
from phongbench.support.document_paths import Source, Steps, shown

Vector = tuple[float, float, float]
#: largest number a document may hold: its square is still far from float32's end
LARGEST = 1e9
#: bytes a document may have
LARGEST_FILE = 4 << 20


def load(path: Path) -> tuple[dict[str, Any], Source]:
    """The data of a file, JSON if its name ends so and TOML otherwise, and where errors in it are to point."""
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise InputError(
                f"the file has more than {LARGEST_FILE >> 20} MB", str(path), "meshes belong into OBJ files"
            )
        text = path.read_text(encoding="utf-8-sig")  # Windows' editors put a byte order mark first
    except OSError as problem:
        what = f"cannot read the scene: {problem.strerror}"
        raise InputError(what, str(path), "give the path of a TOML file") from problem
    except UnicodeDecodeError as problem:
        line = problem.object.count(b"\n", 0, problem.start) + 1
        raise InputError("cannot read the scene: not UTF-8", f"{path}:{line}", "save it as text in UTF-8") from problem
    if path.suffix.lower() == ".json":
        try:
            data = json.loads(text)
        except (ValueError, RecursionError) as problem:
            raise _malformed("JSON", problem, path, text) from problem
        if not isinstance(data, dict):
            raise InputError("not a JSON object", str(path), "a scene is an object with camera, materials, objects")
        return data, Source(str(path))
    try:
        return tomllib.loads(text), Source(str(path), text)
    except (ValueError, RecursionError) as problem:
        raise _malformed("TOML", problem, path, text) from problem


#: Python reads no integer of more digits
_MOST_DIGITS = 4300


def _malformed(kind: str, problem: Exception, path: Path, text: str) -> InputError:
    """The error to raise about a text that cannot be parsed, with its line if anything tells it."""
    what, told = str(problem), re.search(r"line (\d+)", str(problem))
    line = told[1] if told else None
    if isinstance(problem, RecursionError):
        what = "lists or tables within one another, too deep to read"
    elif line is None and (endless := re.search(rf"\d{{{_MOST_DIGITS}}}", text)):
        what, line = "a number with thousands of digits", text.count("\n", 0, endless.start()) + 1
    return InputError(f"not valid {kind}: {what}", f"{path}:{line}" if line else str(path))


@dataclass(slots=True)
class Table:
    """A table of a document that is being read: what it is asked for is typed, what nobody asked for is an error."""

    data: Mapping[str, Any]
    source: Source
    steps: Steps = ()
    asked: dict[str, None] = field(default_factory=dict)

    def where(self, key: str | None = None) -> str:
        """Where the table stands, or one of its values."""
        return self.source.where(self.steps if key is None else (*self.steps, key))

    def fault(self, what: str, key: str | None = None, fix: str | None = None) -> InputError:
        """The error to raise about a value of this table, or about all of it."""
        return InputError(what, self.where(key if key in self.data else None), fix)

    @contextmanager
    def blamed(self, key: str | None = None) -> Iterator[None]:
        """Errors of the library raised inside are about this table, and say so."""
        try:
            yield
        except UnknownNameError as problem:
            raise UnknownNameError(problem.kind, problem.name, problem.known, self.where(key)) from problem
        except InputError as problem:
            about = f"{problem.where}: {problem.what}" if problem.where else problem.what
            raise InputError(about, self.where(key), problem.fix) from problem

    def has(self, key: str) -> bool:
        """Whether the key is there; asking makes it known."""
        self.asked[key] = None
        return key in self.data

    def value(self, key: str, default: Any = None) -> Any:
        """A value as it stands; without a default it must be there."""
        if self.has(key):
            return self.data[key]
        if default is None:
            raise InputError(f"{key} is missing", self.where(), f"add: {key} = ...")
        return default

    def number(self, key: str, default: float | None = None, low: float = -LARGEST, high: float = LARGEST) -> float:
        """A finite number in low .. high."""
        return self._number(self.value(key, default), key, low, high)

    def whole(self, key: str, default: int | None = None, low: int = 0, high: int = 1 << 31) -> int:
        """A whole number in low .. high."""
        value = self.value(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise self.fault(f"{self._told(key, value)} is not a whole number from {low} to {high}", key)
        return value

    def flag(self, key: str, default: bool) -> bool:
        """True or false."""
        value = self.value(key, default)
        if not isinstance(value, bool):
            raise self.fault(f"{self._told(key, value)} is neither true nor false", key)
        return value

    def text(self, key: str, default: str | None = None, among: Iterable[str] = ()) -> str:
        """A string; one of `among` if these are given."""
        value = self.value(key, default)
        if not isinstance(value, str):
            raise self.fault(f"{self._told(key, value)} is not a string", key)
        known = tuple(among)
        if known and value not in known:
            raise UnknownNameError(key, value, known, self.where(key))
        return value

    def numbers(
        self,
        key: str,
        count: int,
        default: tuple[float, ...] | None = None,
        low: float = -LARGEST,
        high: float = LARGEST,
    ) -> tuple[float, ...]:
        """So many numbers in low .. high."""
        return self._row(self.value(key, default), key, count, low, high, key)

    def rows(self, key: str, counts: tuple[int, ...], length: int) -> list[tuple[float, ...]]:
        """Lists of `length` numbers each, as many as one of `counts`."""
        value = self.value(key)
        if not isinstance(value, list) or len(value) not in counts:
            raise self.fault(f"{key} is not a list of {' or '.join(map(str, counts))} rows", key)
        return [self._row(row, f"{key}[{i}]", length, -LARGEST, LARGEST, key) for i, row in enumerate(value)]

    def vector(self, key: str, default: Vector | None = None) -> Vector:
        """Three numbers."""
        x, y, z = self.numbers(key, 3, default)
        return x, y, z

    def direction(self, key: str, default: Vector | None = None) -> Vector:
        """Three numbers that are not all 0, scaled to length 1."""
        x, y, z = self.vector(key, default)
        length = math.hypot(x, y, z)
        if length < 1e-9:
            raise self.fault(f"{self._told(key, [x, y, z])} has no direction", key)
        return x / length, y / length, z / length

    def colour(self, key: str, default: Vector | None = None, high: float = 1.0) -> Vector:
        """Red, green and blue in 0 .. high."""
        r, g, b = self.numbers(key, 3, default, 0.0, high)
        return r, g, b

    def table(self, key: str) -> "Table":
        """A table inside; empty if it is not there."""
        return self.inside(key, self.value(key, {}), key)

    def tables(self, key: str, most: int) -> list["Table"]:
        """A list of tables; empty if it is not there."""
        value = self.value(key, [])
        if not isinstance(value, list) or not all(isinstance(member, dict) for member in value):
            raise self.fault(f"{key} is not a list of tables", key, f"write [[{key}]] above each of them")
        if len(value) > most:
            raise self.fault(f"{len(value)} {key} are more than {most}", key)
        return [Table(member, self.source, (*self.steps, key, i)) for i, member in enumerate(value)]

    def named(self, key: str) -> dict[str, "Table"]:
        """Tables by name: [key.name]; errors call those of a stranger by their number."""
        inside = self.table(key)
        steps: Iterable[str | int] = range(len(inside.data)) if self.source.afar else inside.data
        return {
            name: inside.inside(name, value, step)
            for step, (name, value) in zip(steps, inside.data.items(), strict=True)
        }

    def unknown(self, kind: str, name: object, known: Iterable[str], key: str) -> InputError:
        """The error to raise about a name of the document's own that this value refers to, and that is not there."""
        if self.source.afar:
            return InputError(f"there is no {kind} of that name", self.where(key), f"add it to {kind}s")
        names = [shown(each) for each in known]
        if not names:
            return InputError(f"there is no {kind} {name!r}, nor any other", self.where(key), f"add one to {kind}s")
        return UnknownNameError(kind, name, names, self.where(key))

    def finish(self) -> None:
        """Refuse the first key that nobody asked for."""
        for key in self.data:
            if key not in self.asked:
                where = (*self.steps, "(unknown)" if self.source.afar else key)
                raise UnknownNameError("key", key, self.asked, self.source.where(where))

    def inside(self, name: str, value: Any, step: str | int) -> "Table":
        """A value that must be a table, and what errors about it call the step to it."""
        steps = (*self.steps, step)
        if not isinstance(value, dict):
            raise InputError(f"{self._told(name, value, step)} is not a table", self.source.where(steps))
        return Table(value, self.source, steps)

    def _told(self, key: str, value: Any, step: str | int | None = None) -> str:
        """`key = value`; of a stranger's document only which one it is."""
        if self.source.afar:
            return "it" if isinstance(step, int) else key
        return f"{key} = {_shown(value)}"

    def _row(self, value: Any, name: str, count: int, low: float, high: float, key: str) -> tuple[float, ...]:
        if not isinstance(value, list | tuple) or len(value) != count:
            raise self.fault(f"{self._told(name, value)} is not a list of {count} numbers", key)
        return tuple(self._number(v, f"{name}[{i}]", low, high, key) for i, v in enumerate(value))

    def _number(self, value: Any, name: str, low: float, high: float, key: str | None = None) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.fault(f"{self._told(name, value)} is not a number", key or name)
        if not low <= value <= high:  # NaN is not either
            raise self.fault(f"{self._told(name, value)} is outside {low:g} .. {high:g}", key or name)
        return float(value)


def _shown(value: Any) -> str:
    """A value of a document, short enough for a message."""
    text = json.dumps(value, default=str)
    return text if len(text) <= 60 else f"{text[:57]}..."
