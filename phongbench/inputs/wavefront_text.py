"""The text of Wavefront files, OBJ and MTL, in any encoding and layout, and the notes on what is made of it.

Text stays bytes, which whole files are searched and parsed in; only names are decoded. A line that continues another
ends in CONTINUED instead of a line feed, so that lines can still be counted.
"""

import codecs
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from phongbench.errors import InputError
from phongbench.support.user_paths import reading

CONTINUED = b"\v"
#: a comment begins a line or follows a blank: elsewhere # is part of a name
_COMMENT = re.compile(rb"(?<![^ ])#")
#: bytes that tell UTF-16 without a byte order mark
_FIRST = 16
#: characters of a line that an error shows
_SHOWN = 60


def _latin_1(problem: UnicodeError) -> tuple[str, int]:
    assert isinstance(problem, UnicodeDecodeError)
    return problem.object[problem.start : problem.end].decode("latin-1"), problem.end


codecs.register_error("phongbench-latin-1", _latin_1)


class Notes:
    """What is changed or left out in a file: one sentence for each kind, with the line that shows it first."""

    def __init__(self) -> None:
        self._lines: dict[str, int | None] = {}
        self._counts: Counter[str] = Counter()

    def add(self, kind: str, line: int | None = None, count: int = 1) -> None:
        """Note that this line, or the whole file, holds `count` of a kind."""
        if count:
            self._lines.setdefault(kind, line)
            self._counts[kind] += count

    def sentences(self) -> tuple[str, ...]:
        """The notes, in the order in which their kinds came up."""
        return tuple(self._sentence(kind, line) for kind, line in self._lines.items())

    def _sentence(self, kind: str, line: int | None) -> str:
        count = self._counts[kind]
        if line is None:
            return kind if count == 1 and ":" in kind else f"{kind}: {count}"
        return f"line {line}: {kind}" + (f" ({count:,} lines)" if count > 1 else "")


def read(path: Path, kind: str, fix: str) -> bytes:
    """The text of a file: lines end in a line feed and do not begin with a blank, blanks are spaces.

    kind  what the file is, for the error: "mesh" or "MTL file"
    Raises InputError if the file cannot be read or is no text.
    """
    with reading(path, kind, fix):
        data = path.read_bytes()
    data = _utf_8(data)
    data = data.rstrip(b"\0")  # some programs fill the last block
    if b"\0" in data:
        raise InputError(f"the {kind} is not a text file", str(path), fix)
    data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").translate(bytes.maketrans(b"\t\v\f", b"   ")) + b"\n"
    if re.search(rb"\\ *\n", data):
        data = _joined(data) + b"\n"
    return re.sub(rb"^[ \v]+", b"", data, flags=re.MULTILINE) if b"\n " in data or data[:1] == b" " else data


def _utf_8(data: bytes) -> bytes:
    """UTF-16 as UTF-8, whether a byte order mark or only every other byte tells; all else as it is, without a mark."""
    even, odd = data[:_FIRST:2], data[1:_FIRST:2]
    encoding = None
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        encoding = "utf-16"
    elif odd and not any(odd) and all(even):
        encoding = "utf-16-le"
    elif even and not any(even) and all(odd):
        encoding = "utf-16-be"
    if encoding:
        data = data.decode(encoding, errors="replace").encode("utf-8", errors="replace")
    return data.removeprefix(codecs.BOM_UTF8)


def _joined(data: bytes) -> bytes:
    """The text with continued lines joined; a comment that ends in a backslash, as paths do, is not continued."""

    def end(found: re.Match[bytes]) -> bytes:
        line = data[data.rfind(b"\n", 0, found.start()) + 1 : found.start()]
        return found[0] if _COMMENT.search(line) else b" " + CONTINUED

    return re.sub(rb"\\ *\n", end, data)


def numbered(text: bytes) -> Iterator[tuple[int, bytes]]:
    """The lines of a text, each with the number of the line of the file that it begins at."""
    number = 1
    for line in text.split(b"\n"):
        yield number, line
        number += 1 + line.count(CONTINUED)


def name(text: bytes) -> str:
    """A name as text, with single blanks: UTF-8, or Latin-1 where it is none."""
    return b" ".join(text.split()).decode("utf-8", errors="phongbench-latin-1")


def printable(text: str) -> str:
    """A name as it may be shown: what could move a cursor is escaped."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def without_comment(text: str) -> str:
    """A name up to its comment: # after a blank, which may as well be part of the name."""
    return "" if text == "#" or text.startswith("# ") else text.split(" #", 1)[0]


def shown(line: bytes) -> str:
    """A line as errors quote it."""
    text = name(line)
    return repr(text if len(text) <= _SHOWN else f"{text[:_SHOWN]}...")
