"""Targets that were measured elsewhere, such as the GPU of whoever opened the explorer: one JSON file each.

A file is what the page wrote down: times in ns of whole highlights, from rounds that took exact Phong and a bare dot
product in turn with the others. `add` checks every number and keeps the file as phongbench-runs/targets/NAME.json, in
the folder of the runs, where the command, the library and the service find it. The document:

    {"schema": 1, "target": "page-adreno-740", "cost_kind": "measured", "unit": "ns", "precision": "float32",
     "adapter": "Adreno (TM) 740", "tool": "WebGPU", "tool_version": "Chrome 142", "phongbench": "0.1.0",
     "dot": {"cost": 0.031, "low": 0.030, "high": 0.032},
     "rows": [{"formula": "lyon:dot:8", "alpha": 50, "cost": 0.052, "low": 0.051, "high": 0.054}, ..]}

low and high are the ends of a 99 % interval: of the ratio to exact Phong, times exact Phong's cost; of exact Phong
itself, of the ratio to it of a second copy. Times are those of the code that this version writes, so what another one
measured is refused.
"""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from phongbench import __version__
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import Formula
from phongbench.results.runs import ADDED, DEFAULT_ROOT
from phongbench.support.atomic_files import write_text, write_whole
from phongbench.support.document_paths import UNTRUSTED
from phongbench.support.documents import Table, load
from phongbench.support.user_paths import is_file, is_folder, reading
from phongbench.targets.code_shapes import Code, code

SCHEMA = 1
#: names begin so, and say the adapter in letters of a file's name
NAME = re.compile(r"page-[a-z0-9](?:[a-z0-9-]{0,46}[a-z0-9])?")
#: in which a measured row's code is compared with another's
LANGUAGE = "glsl"
PRECISION, UNIT, KIND = "float32", "ns", "measured"
#: ns that no highlight takes less or more than
LEAST, MOST = 1e-7, 1e9
_MOST_ROWS, _LONGEST = 1000, 200
_NOUN = "measurement"
_FIX = "measure it again in the explorer, and give the file as it was downloaded"


@dataclass(frozen=True, slots=True)
class Timed:
    """A time of one highlight in ns, dot product included, with the ends of its interval."""

    cost: float
    low: float
    high: float


@dataclass(frozen=True)
class MeasuredTable:
    """The costs on a target that was measured.

    adapter                 what the browser calls the GPU
    tool, tool_version      what measured
    dot                     the bare dot product
    rows                    shape of the code -> (name of the first formula that stands for it, its time)
    """

    name: str
    adapter: str
    tool: str
    tool_version: str
    dot: Timed
    rows: Mapping[str, tuple[str, Timed]]

    @property
    def unit(self) -> str:
        """Of its costs."""
        return UNIT

    @property
    def language(self) -> str:
        """In which code is looked up."""
        return LANGUAGE

    @property
    def precision(self) -> str:
        """Of the code that was measured."""
        return PRECISION

    def known(self, wanted: Code) -> Timed | None:
        """The time of code that was measured, or of code that differs from it in numbers only; None for other code."""
        row = self.rows.get(wanted.shape)
        return None if row is None else row[1]

    @cached_property
    def baseline(self) -> Timed:
        """Exact Phong's time."""
        found = self.known(code(Formula(), 50.0, LANGUAGE))
        assert found is not None, "checked when it was read"
        return found

    def ratios(self, timed: Timed) -> tuple[float, float, float]:
        """Time over that of exact Phong, and the ends of its interval."""
        exact = self.baseline
        return timed.cost / exact.cost, timed.low / exact.cost, timed.high / exact.cost


#: where measured targets are looked up: the folder of the runs in which they were added, or the only one that counts
Shelf = Path | MeasuredTable


def read(path: Path) -> MeasuredTable:
    """The measurement in a file; InputError names file, key and what is wrong."""
    if path.suffix.lower() != ".json":
        raise InputError("a measurement is a JSON file", str(path), _FIX)
    with reading(path, _NOUN, _FIX):
        path.open("rb").close()
    return _read(load(path, _NOUN, _FIX))


def of_document(document: Any) -> MeasuredTable:
    """The measurement in a document that anyone may have sent; InputError names the key, and repeats nothing of it."""
    return _read(Table.of(document, UNTRUSTED, _NOUN))


def _read(table: Table) -> MeasuredTable:
    schema = table.whole("schema", high=1 << 30)
    if schema != SCHEMA:
        raise table.error(f"schema {schema} is another version's; this one reads {SCHEMA}", "schema", _FIX)
    name = table.text("target")
    if not NAME.fullmatch(name):
        raise table.error("is not a name such as page-adreno-740", "target", "small letters, digits and hyphens")
    for key, only in (("cost_kind", KIND), ("unit", UNIT), ("precision", PRECISION)):
        table.text(key, among=(only,))
    adapter, tool, version = (_words(table, key) for key in ("adapter", "tool", "tool_version"))
    if _words(table, "phongbench") != __version__:
        what = f"another version of phongbench measured it; the code that {__version__} writes may be other code"
        raise table.error(what, "phongbench", _FIX)
    dot = _timed(table.table("dot"))
    found = MeasuredTable(name, adapter, tool, version, dot, _rows(table, dot))
    table.finish()
    if found.known(code(Formula(), 50.0, LANGUAGE)) is None:
        raise table.error("exact Phong was not measured, which the others are compared with", "rows", _FIX)
    return found


def _words(table: Table, key: str) -> str:
    text = table.text(key)
    if not text.strip() or len(text) > _LONGEST or not text.isprintable():
        raise table.error(f"{key} is not a line of at most {_LONGEST} characters", key, _FIX)
    return text


def _timed(row: Table) -> Timed:
    """A time with its interval; InputError for ends that do not lie around it."""
    cost, low, high = (row.number(key, None, LEAST, MOST) for key in ("cost", "low", "high"))
    if not low <= cost <= high:
        raise row.error(f"the interval {low:g} .. {high:g} does not hold the cost {cost:g}", "cost", _FIX)
    if not {"formula", "alpha"} & row.data.keys():
        row.finish()
    return Timed(cost, low, high)


def _rows(table: Table, dot: Timed) -> dict[str, tuple[str, Timed]]:
    """Times by the shape of the code; of two formulas with one code the first stands for both."""
    rows: dict[str, tuple[str, Timed]] = {}
    seen: set[tuple[Formula, float]] = set()
    for row in table.tables("rows", most=_MOST_ROWS):
        with row.located("formula"):
            formula = Formula.parse(row.text("formula"))
            alpha = row.number("alpha", None, 0.0, 1e6)
            one = code(formula, alpha, LANGUAGE)
        timed = _timed(row)
        row.finish()
        if timed.high < dot.low:
            raise row.error(f"takes {timed.cost:g} ns, less than the dot product that it begins with", "cost", _FIX)
        if (formula, alpha) in seen:
            raise row.error(f"{formula} at alpha {alpha:g} is there twice", "formula", _FIX)
        seen.add((formula, alpha))
        rows.setdefault(one.shape, (one.name, timed))
    return rows


def add(path: Path, root: Path = DEFAULT_ROOT) -> tuple[MeasuredTable, Path]:
    """Keep a measurement among the runs of `root`; what it holds, and its place there.

    An earlier one of the same target is replaced. Nothing is written unless the whole file is right.
    Raises InputError as `read`, StorageError where it cannot be written.
    """
    found = read(path)
    with reading(path, _NOUN):
        document = json.loads(path.read_text(encoding="utf-8-sig"))
    place = place_of(found.name, root)
    text = json.dumps(document, indent=1, sort_keys=True, allow_nan=False) + "\n"
    write_whole(place, lambda file: write_text(file, text))
    return found, place


def names(root: Shelf = DEFAULT_ROOT) -> list[str]:
    """The targets that were added here, in order."""
    if isinstance(root, MeasuredTable):
        return [root.name]
    folder = root / ADDED
    with reading(folder, "folder of the targets"):
        files = sorted(folder.iterdir()) if is_folder(folder) else []
    return [file.stem for file in files if file.suffix == ".json" and NAME.fullmatch(file.stem)]


def place_of(name: str, root: Path = DEFAULT_ROOT) -> Path:
    """Where the file of a target lies."""
    return root / ADDED / f"{name}.json"


def added(name: str, root: Shelf = DEFAULT_ROOT) -> MeasuredTable:
    """A target that was added; UnknownNameError where it was not, InputError where its file was changed since."""
    if isinstance(root, MeasuredTable):
        if name != root.name:
            raise UnknownNameError("target", name, names(root), "target")
        return root
    place = place_of(name, root)
    if not NAME.fullmatch(name) or not is_file(place):
        raise UnknownNameError("target", name, names(root), "target")
    state = place.stat()
    return _kept(place, (state.st_mtime_ns, state.st_size))


@lru_cache(32)
def _kept(place: Path, _state: tuple[int, int]) -> MeasuredTable:
    """The table of a file, read once for each state of it."""
    found = read(place)
    if found.name != place.stem:
        raise InputError(f"holds {found.name}", str(place), "add it again: phongbench targets add FILE.json")
    return found
