"""Where a value stands in a document: file, line and key, for errors to name."""

import json
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

#: keys and indices, outermost first
Steps = tuple[str | int, ...]


@dataclass(frozen=True, slots=True)
class Source:
    """Where a document came from, so that an error can say file and line.

    name       str   the file as the user named it; "" for a document that came as data
    text       str   its TOML text; "" where lines mean nothing
    untrusted  bool  whether anyone may have sent it: errors repeat nothing of it, and count what its author named
    """

    name: str = ""
    text: str = ""
    untrusted: bool = False

    def where(self, steps: Steps) -> str:
        """File, line and key of a value; only the key for data."""
        key = ""
        for step in steps:
            key += f"[{step}]" if isinstance(step, int) else f"{'.' if key else ''}{shown(step)}"
        if not self.name:
            return key or "document"
        place = f"{self.name}:{line_of(self.text, steps)}" if self.text else self.name
        return f"{place}: {key}" if key else place


#: a document that came as data, and one that anyone may have sent
DATA, UNTRUSTED = Source(), Source(untrusted=True)

#: a part of a key, and keys of such parts: at the beginning of a line, or in the brackets of a table's header
_PART = r"""(?:"(?:[^"\\]|\\.)*"|'[^']*'|[\w-]+)"""
_PARTS = re.compile(_PART)
_DOTTED = rf"{_PART}(?:\s*\.\s*{_PART})*"
_HEADER, _KEY = re.compile(rf"^\s*(\[\[?)\s*({_DOTTED})\s*\]"), re.compile(rf"^\s*({_DOTTED})\s*=")
#: keys that are shown as they are; other keys of a place may hold anything, even what moves a terminal's cursor
_BARE = re.compile(r"[\w-]+|\(unknown\)")


def line_of(text: str, steps: Steps) -> int:
    """The line (from 1) of a TOML text that holds the value at these steps, or the nearest thing around it."""
    best, found, prefix = 0, 1, ()  # type: tuple[int, int, Steps]
    counted: dict[Steps, int] = {}
    for number, line in enumerate(text.split("\n"), 1):
        here = prefix
        if header := _HEADER.match(line):
            *around, last = _steps(header[2])
            name = (*_latest(around, counted), last)
            if header[1] == "[[":
                counted[name] = counted.get(name, -1) + 1
                name = (*name, counted[name])
            prefix = here = name
        elif key := _KEY.match(line):
            here = (*prefix, *_steps(key[1]))
        if here == steps[: len(here)] and len(here) > best:
            best, found = len(here), number
    return found


def _latest(names: Iterable[str | int], counted: Mapping[Steps, int]) -> Steps:
    """The steps to what a header's names mean: of lists of tables the last one so far."""
    steps: Steps = ()
    for name in names:
        steps = (*steps, name)
        steps = (*steps, counted[steps]) if steps in counted else steps
    return steps


def _steps(name: str) -> Steps:
    return tuple(_unquoted(part) for part in _PARTS.findall(name))


def _unquoted(part: str) -> str:
    if part[0] == "'":
        return part[1:-1]
    if part[0] != '"':
        return part
    try:
        return str(tomllib.loads(f"k = {part}")["k"])
    except tomllib.TOMLDecodeError:
        return part


def shown(step: str) -> str:
    """A key as TOML writes it: quoted where it holds more than letters, digits, _ and -."""
    return step if _BARE.fullmatch(step) else json.dumps(step, ensure_ascii=not step.isprintable())
