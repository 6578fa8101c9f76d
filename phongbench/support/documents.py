"""The one reader of strict documents, TOML or JSON: values are typed, keys are known, errors name the place.

Scenes, plans and shading requests are read by it; what they mean is their own business.
"""

import json
import math
import re
import sys
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from phongbench.errors import InputError, UnknownNameError
from phongbench.support.document_paths import DATA, Source, Steps, shown
from phongbench.support.user_paths import reading

Vector = tuple[float, float, float]
#: largest number a scene may hold: its square is still far from float32's end
LARGEST = 1e9
#: no bound but that a number is finite
FINITE = sys.float_info.max
#: bytes a document may have
LARGEST_FILE = 4 << 20
#: Python reads no integer of more digits
_MOST_DIGITS = 4300


def load(path: Path, kind: str, fix: str | None = None) -> "Table":
    """The document in a file, JSON if its name ends so and TOML otherwise.

    kind  what errors call it: a scene, a plan
    fix   where a malformed one is told how it is written
    """
    with reading(path, kind, "give the path of a TOML file"), path.open("rb") as file:
        data = file.read(LARGEST_FILE + 1)
    if len(data) > LARGEST_FILE:
        raise InputError(f"a {kind} has at most {LARGEST_FILE >> 20} MB", str(path), "leave data to other files")
    try:
        text = data.decode("utf-8-sig")  # Windows' editors put a byte order mark first
    except UnicodeDecodeError as problem:
        at = problem.object.count(b"\n", 0, problem.start) + 1
        raise InputError(f"cannot read the {kind}: not UTF-8", f"{path}:{at}", "save it as text in UTF-8") from problem
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    form, parse = ("JSON", json.loads) if path.suffix.lower() == ".json" else ("TOML", tomllib.loads)
    try:
        document = parse(text)
    except (ValueError, RecursionError) as problem:
        what, line = _malformed(problem, text)
        raise InputError(f"not valid {form}: {what}", f"{path}:{line}" if line else str(path), fix) from problem
    return Table.of(document, Source(str(path), text if form == "TOML" else ""), kind)


def _malformed(problem: Exception, text: str) -> tuple[str, int | None]:
    """What is wrong with a text that cannot be parsed, and its line if anything says it."""
    what, named = str(problem), re.search(r"line (\d+)", str(problem))
    line: int | None = int(named[1]) if named else None
    if isinstance(problem, RecursionError):
        what = "lists or tables within one another, too deep to read"
    elif line is None and (endless := re.search(rf"\d{{{_MOST_DIGITS}}}", text)):
        what, line = "a number with thousands of digits", text.count("\n", 0, endless.start()) + 1
    return what, line


@dataclass(slots=True)
class Table:
    """A table (in JSON, an object) that is being read: each method checks a value, and `finish` refuses the rest.

    A method without a default needs its key. Errors are InputErrors that name the place of the value; of an untrusted
    document they repeat nothing but keys that were read.
    """

    data: Mapping[str, Any]
    source: Source = DATA
    steps: Steps = ()
    known: dict[str, None] = field(default_factory=dict)

    @classmethod
    def of(cls, document: Any, source: Source, kind: str) -> "Table":
        """The outermost table of a document, which `kind` names in the error about anything else."""
        if not isinstance(document, dict):
            raise InputError(f"a {kind} is a table of keys and values", source.where(()), "in JSON an object: {...}")
        return cls(document, source)

    def where(self, *steps: str | int) -> str:
        """Where the table stands, or a value in it."""
        return self.source.where((*self.steps, *steps))

    def error(self, what: str, key: str | None = None, fix: str | None = None) -> InputError:
        """The error to raise about a value of this table, or about all of it."""
        return InputError(what, self.where(*([key] if key and key in self.data else [])), fix)

    @contextmanager
    def located(self, key: str | None = None) -> Iterator[None]:
        """Errors of the library raised inside are about the value here that they name, or `key`, or all of it."""
        try:
            yield
        except InputError as problem:
            steps = (problem.where or "").split(".")
            if steps[0] not in self.known:
                problem.what = f"{problem.where}: {problem.what}" if problem.where else problem.what
                steps = [] if key is None else [key]
            problem.where = self.where(*steps)
            raise

    def has(self, key: str) -> bool:
        """Whether the key is there; it is a known one from now on."""
        self.known[key] = None
        return key in self.data

    def value(self, key: str, default: Any = None) -> Any:
        """A value as it stands."""
        if self.has(key):
            return self.data[key]
        if default is None:
            near = (
                [] if self.source.untrusted else get_close_matches(key, [k for k in self.data if k not in self.known])
            )
            fix = f"did you mean it by {shown(near[0])}?" if near else f"add: {key} = ..."
            raise InputError(f"{key} is missing", self.where(key), fix)
        return default

    def number(self, key: str, default: float | None = None, low: float = -LARGEST, high: float = LARGEST) -> float:
        """A finite number in low .. high."""
        return self._number(self.value(key, default), (key,), low, high)

    def whole(self, key: str, default: int | None = None, low: int = 0, high: int = 1 << 31) -> int:
        """A whole number in low .. high."""
        value = self.value(key, default)
        if type(value) is not int or not low <= value <= high:
            raise self.wrong(f"is not a whole number from {low} to {high}", value, key)
        return value

    def flag(self, key: str, default: bool | None = None) -> bool:
        """True or false."""
        value = self.value(key, default)
        if not isinstance(value, bool):
            raise self.wrong("is neither true nor false", value, key)
        return value

    def text(self, key: str, default: str | None = None, among: Iterable[str] = ()) -> str:
        """A string; one of `among` if these are given."""
        value = self.value(key, default)
        if not isinstance(value, str):
            raise self.wrong("is not a string", value, key)
        names = tuple(among)
        if names and value not in names:
            raise UnknownNameError(key, value[:60], names, self.where(key))
        return value

    def members(self, key: str, default: list[Any] | None = None, most: int = 1 << 31) -> list[Any]:
        """A list as it stands, of at most so many members."""
        value = self.value(key, default)
        if not isinstance(value, list):
            raise self.wrong("is not a list", value, key)
        if len(value) > most:
            raise self.error(f"{len(value)} {key} are more than {most}", key)
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
        return self._row(self.value(key, default), (key,), count, low, high)

    def rows(self, key: str, counts: tuple[int, ...], length: int) -> list[tuple[float, ...]]:
        """Lists of `length` numbers each, as many as one of `counts`."""
        value = self.members(key)
        if len(value) not in counts:
            raise self.error(f"{key} is not a list of {' or '.join(map(str, counts))} rows", key)
        return [self._row(row, (key, i), length, -LARGEST, LARGEST) for i, row in enumerate(value)]

    def vector(self, key: str, default: Vector | None = None, high: float = LARGEST) -> Vector:
        """Three numbers."""
        x, y, z = self.numbers(key, 3, default, -high, high)
        return x, y, z

    def direction(self, key: str, default: Vector | None = None) -> Vector:
        """Three numbers that are not all 0, scaled to length 1."""
        x, y, z = self.vector(key, default)
        length = math.hypot(x, y, z)
        if length == 0:
            raise self.wrong("has no direction", [x, y, z], key)
        return x / length, y / length, z / length

    def colour(self, key: str, default: Vector | None = None, high: float = 1.0) -> Vector:
        """Red, green and blue in 0 .. high."""
        r, g, b = self.numbers(key, 3, default, 0.0, high)
        return r, g, b

    def table(self, key: str, default: dict[str, Any] | None = None) -> "Table":
        """A table inside."""
        return self.inside(self.value(key, default), key)

    def tables(self, key: str, default: list[Any] | None = None, most: int = 1 << 31) -> list["Table"]:
        """A list of at most so many tables."""
        value = self.value(key, default)
        if not isinstance(value, list) and self.source.text:
            raise self.error(f"{key} is not a list of tables", key, f"write [[{key}]] above each of them")
        return [self.inside(member, key, i) for i, member in enumerate(self.members(key, default, most))]

    def named(self, key: str) -> dict[str, "Table"]:
        """Tables by name, [key.name]; none if the key is not there. Errors name untrusted ones by their number."""
        inside = self.table(key, {})
        members = enumerate(inside.data.items())
        return {name: inside.inside(v, i if self.source.untrusted else name) for i, (name, v) in members}

    def unknown(self, kind: str, name: object, known: Iterable[str], key: str) -> InputError:
        """The error to raise about a name of the document's own that this value refers to, and that is not there."""
        if self.source.untrusted:
            return InputError(f"there is no {kind} of that name", self.where(key), f"add it to {kind}s")
        names = [shown(each) for each in known]
        if not names:
            return InputError(f"there is no {kind} {name!r}, nor any other", self.where(key), f"add one to {kind}s")
        return UnknownNameError(kind, name, names, self.where(key))

    def finish(self) -> None:
        """Refuse the first key that was not read."""
        for key in self.data:
            if key not in self.known:
                raise UnknownNameError(
                    "key", key[:60], self.known, self.where("(unknown)" if self.source.untrusted else key)
                )

    def inside(self, value: Any, *steps: str | int) -> "Table":
        """A value that must be a table, at these steps from here."""
        if not isinstance(value, dict):
            raise self.wrong(f"is not {'a table' if self.source.text else 'an object'}", value, *steps)
        return Table(value, self.source, (*self.steps, *steps))

    def wrong(self, what: str, value: Any, *steps: str | int) -> InputError:
        """The error to raise about a value: `key = value is not ..`; of an untrusted document only `key is not ..`."""
        name = DATA.where(steps if isinstance(steps[0], str) else (*self.steps, *steps))
        if not self.source.untrusted:
            text = json.dumps(value, default=str)
            name += f" = {text if len(text) <= 60 else f'{text[:57]}...'}"
        return InputError(f"{name} {what}", self.where(*steps))

    def _row(self, value: Any, steps: Steps, count: int, low: float, high: float) -> tuple[float, ...]:
        if not isinstance(value, list | tuple) or len(value) != count:
            raise self.wrong(f"is not a list of {count} numbers", value, *steps)
        return tuple(self._number(v, (*steps, i), low, high) for i, v in enumerate(value))

    def _number(self, value: Any, steps: Steps, low: float, high: float) -> float:
        if type(value) not in (int, float):
            raise self.wrong("is not a number", value, *steps)
        if not low <= value <= high:  # NaN is not either
            bounds = f"outside {low:g} .. {high:g}" if high < FINITE else f"no finite number of at least {low:g}"
            raise self.wrong(f"is {bounds}", value, *steps)
        return float(value)
