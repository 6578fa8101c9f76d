"""The lines of an OBJ file as arrays: those of one kind are parsed together, so a million triangles take seconds."""

import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.inputs.wavefront_text import CONTINUED, read, shown

Indices = NDArray[np.int64]

EXAMPLE = "give a Wavefront OBJ file with vertices (v) and faces (f)"
_REPAIR = "repair the line, or export the mesh again"
#: kinds of lines; BLANK ones are comments and texture coordinates, too
BLANK, VERTEX, NORMAL, FACE, OTHER = range(5)
_NUMBER = re.compile(rb"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|nan|inf|infinity)", re.IGNORECASE)
_CORNER = re.compile(rb"[-+]?\d+(?:/[-+]?\d*){0,2}")
#: how Microsoft's library writes what is not a number
_NO_NUMBER = re.compile(rb"\d\.#(?:IND|QNAN|SNAN|INF)\w*")


class ObjLines:
    """The lines of a file and the kind of each.

    data    bytes        the file's text, see wavefront_text
    starts  int64 (n,)   where each line begins
    kinds   uint8 (n,)   BLANK, VERTEX, NORMAL, FACE or OTHER
    """

    def __init__(self, path: Path) -> None:
        self.path, self.data = path, read(path, "mesh", EXAMPLE)
        self._bytes = np.frombuffer(self.data, np.uint8)
        ends = np.flatnonzero(self._bytes == ord("\n")) + 1
        self._continued = np.flatnonzero(self._bytes == CONTINUED[0])
        self.starts = np.concatenate([[0], ends[:-1]])
        self._lengths = ends - self.starts
        self.kinds = self._kinds()

    def _kinds(self) -> NDArray[np.uint8]:
        one, two, three = (self._bytes[np.minimum(self.starts + i, len(self._bytes) - 1)] for i in range(3))
        v, short, pair = one == ord("v"), two <= ord(" "), three <= ord(" ")
        kinds = np.full(len(self.starts), OTHER, np.uint8)
        kinds[(one == ord("\n")) | (one == ord("#")) | (v & (two == ord("t")) & pair)] = BLANK
        kinds[v & short] = VERTEX
        kinds[v & (two == ord("n")) & pair] = NORMAL
        kinds[(one == ord("f")) & short] = FACE
        return kinds

    def of(self, kind: int) -> Indices:
        """The indices of the lines of a kind."""
        return np.flatnonzero(self.kinds == kind)

    def number(self, line: int) -> int:
        """The number in the file of the line with this index, from 1."""
        return 1 + line + int(np.searchsorted(self._continued, self.starts[line]))

    def others(self) -> Iterator[tuple[int, bytes, bytes]]:
        """The index, the keyword and the rest of each line of another kind."""
        for line in self.of(OTHER).tolist():
            key, _, rest = self._line(line).partition(b" ")
            yield line, key, rest

    def _line(self, line: int) -> bytes:
        return self.data[self.starts[line] : self.starts[line] + self._lengths[line]].strip()

    def refuse(self, line: int, what: str) -> NoReturn:
        """Raise InputError about a line."""
        where = f"{self.path}:{self.number(line)}"
        raise InputError(f"{what}, not {shown(self._line(line))}", where, _REPAIR)

    def vectors(self, kind: int) -> tuple[Array, Indices]:
        """The first three numbers of each line of a kind, and how many there are; vertices are finite."""
        what = f"a {'vertex' if kind == VERTEX else 'normal'} is three finite numbers"
        text = self._text(kind)
        if b"#" in text:
            text = re.sub(rb"#[^\n]*", b"", _NO_NUMBER.sub(b"nan", text))
        _, counts = _words(text)
        values = _parsed(text, np.float64)
        if values is None or len(values) != counts.sum() or counts.min(initial=3) < 3:
            self._refuse_first(kind, what, _NUMBER)
        first = np.cumsum(counts) - counts
        vectors = values[first[:, None] + np.arange(3)]
        if kind == VERTEX and not (finite := np.isfinite(vectors).all(axis=1)).all():
            self.refuse(int(self.of(kind)[finite.argmin()]), what)
        return vectors, counts

    def corners(self) -> tuple[Indices, Indices, Indices]:
        """The vertex and the normal that each corner of a face names, 0 for none, and each face's number of corners."""
        text = re.sub(rb"#[^\n]*", b"", self._text(FACE)).replace(b"//", b"/0/")
        if b"/ " in text or b"/\n" in text:
            text = re.sub(rb"/(?=\s)", b"/0", text)
        starts, counts = _words(text)
        if counts.min(initial=3) < 3:
            self.refuse(int(self.of(FACE)[(counts < 3).argmax()]), "a face has three corners or more")
        slashes = np.flatnonzero(np.frombuffer(text, np.uint8) == ord("/"))
        parts = 1 + np.diff(np.searchsorted(slashes, np.append(starts, len(text))))
        values = _parsed(text.replace(b"/", b" "), np.int64)
        if values is None or len(values) != parts.sum() or parts.max(initial=1) > 3:
            self._refuse_first(FACE, "a corner is the number of a vertex", _CORNER)
        first = np.cumsum(parts) - parts
        normals = np.where(parts == 3, values[np.minimum(first + 2, len(values) - 1)], 0)
        return values[first], normals, counts

    def _text(self, kind: int) -> bytes:
        """The lines of a kind without their keywords."""
        chosen = self.kinds == kind
        lengths = self._lengths[chosen]
        text = self._bytes[np.repeat(chosen, self._lengths)]
        starts = np.cumsum(lengths) - lengths
        text[starts] = ord(" ")
        if kind == NORMAL:
            text[starts + 1] = ord(" ")
        return bytes(text)

    def _refuse_first(self, kind: int, what: str, word: re.Pattern[bytes]) -> NoReturn:
        """Raise InputError about the first line of a kind with another word than this, or with fewer than three."""
        for line in self.of(kind).tolist():
            words = _NO_NUMBER.sub(b"nan", self._line(line)).partition(b"#")[0].split()[1:]
            if len(words) < 3 or not all(map(word.fullmatch, words)):
                self.refuse(line, what)
        raise InputError(what, str(self.path), _REPAIR)


def _words(text: bytes) -> tuple[Indices, Indices]:
    """Where each word begins, and how many each line has."""
    data = np.frombuffer(text, np.uint8)
    blank = data <= ord(" ")
    starts = np.flatnonzero(~blank & np.append(True, blank[:-1]))
    counts = np.diff(np.searchsorted(starts, np.flatnonzero(data == ord("\n"))), prepend=0)
    return starts, counts


def _parsed(text: bytes, dtype: type[np.generic]) -> NDArray[Any] | None:
    """The numbers of a text; None if it holds anything else."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # NumPy only warns of what is not a number
        try:
            return np.fromstring(text, dtype, sep=" ")
        except (DeprecationWarning, ValueError):
            return None
