"""Performance ledgers: what `phongbench bench` measured on one machine, a JSON file that `phongbench compare` reads.

Every entry is a time over that of a yardstick timed in the same rounds. Only such ratios, and only those of one
machine, can be compared between ledgers; the times themselves are kept to be looked at.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from sys import float_info
from typing import Any

from phongbench.errors import CorruptRunError, InputError
from phongbench.results import provenance
from phongbench.results.runs import DEFAULT_ROOT
from phongbench.support import documents
from phongbench.support.atomic_files import write_text, write_whole
from phongbench.support.documents import Table
from phongbench.support.user_paths import is_file

SCHEMA = 1
#: where ledgers lie unless they are told where to
FOLDER = DEFAULT_ROOT / "ledgers"
#: kinds of entries: calibrating loops, our loops over pairs, the sweep, shading, pictures of scenes, stages of a study
PARTS = ("ceiling", "kernel", "sweep", "shading", "scene", "stage")
_REMEDY = "restore it from a copy, or measure again: phongbench bench --out FILE"
_WRITTEN = "give a file that `phongbench bench` wrote; of a run, its folder"


@dataclass(frozen=True)
class Entry:
    """One measured time; part, name and place are its key.

    part     of PARTS
    place    its working set or size
    value    the least time, in `unit`, > 0
    over     the yardstick
    ratio    time over the yardstick's, the median over the rounds, > 0; ratio_low and ratio_high are the ends of its
             interval of 99 %, None below 8 rounds
    """

    part: str
    name: str
    place: str
    value: float
    unit: str
    over: str
    ratio: float
    ratio_low: float | None
    ratio_high: float | None
    rounds: int

    @property
    def key(self) -> tuple[str, ...]:
        """What is the same in two ledgers if they tell of the same thing."""
        return self.part, self.name, self.place, self.unit, self.over


@dataclass(frozen=True)
class Ledger:
    """What was measured when, where and by which code; `provenance` as in a run's manifest."""

    made: str
    provenance: Mapping[str, Any]
    entries: tuple[Entry, ...]

    def as_dict(self) -> dict[str, Any]:
        """The document, with the digest of all the rest."""
        rest = {
            "ledger": SCHEMA,
            "made": self.made,
            "provenance": dict(self.provenance),
            "entries": [asdict(entry) for entry in self.entries],
        }
        rest = json.loads(json.dumps(rest))  # as a reader finds it
        return {**rest, "digest": _digest(rest)}


def of_now(entries: Iterable[Entry], seed: int, command: Iterable[str]) -> Ledger:
    """A ledger of what was just measured here."""
    where_from = provenance.collect(seed, tuple(command)).as_dict()
    return Ledger(f"{datetime.now(UTC):%Y%m%d-%H%M%S}", where_from, tuple(entries))


def write(ledger: Ledger, path: Path | None = None) -> Path:
    """Write a ledger, into FOLDER by a name of its own by default; where it is."""
    document = ledger.as_dict()
    file = path or FOLDER / f"{ledger.made}-{document['digest'][:8]}.json"
    text = json.dumps(document, indent=2, sort_keys=True, allow_nan=False) + "\n"
    write_whole(file, lambda temporary: write_text(temporary, text))
    return file


def read(path: Path) -> Ledger:
    """The ledger in this file.

    InputError where there is none: no file, other JSON, another schema. CorruptRunError where it was changed.
    """
    if not is_file(path):
        raise InputError("cannot read the ledger: there is no such file", str(path), _WRITTEN)
    table = documents.load(path, "ledger", _REMEDY)
    if "ledger" not in table.data:
        raise InputError("is no ledger", str(path), _WRITTEN)
    schema = table.whole("ledger")
    if schema != SCHEMA:
        raise InputError(
            f"has schema {schema}; this phongbench reads {SCHEMA}", str(path), "use the version that wrote it"
        )
    rest = {key: value for key, value in table.data.items() if key != "digest"}
    if table.text("digest") != _digest(rest):
        raise CorruptRunError("its content has changed (SHA-256 differs)", str(path), _REMEDY)
    made, where_from = table.text("made"), table.table("provenance")
    for key in ("machine_fingerprint", "code"):
        where_from.text(key)
    where_from.table("machine").text("cpu")
    entries = tuple(_entry(row) for row in table.tables("entries"))
    table.finish()
    if twice := sorted({entry.key for entry in entries if sum(e.key == entry.key for e in entries) > 1}):
        raise table.error(f"{' '.join(twice[0][:3])} stands there twice", "entries", _REMEDY)
    return Ledger(made, where_from.data, entries)


def _entry(row: Table) -> Entry:
    ends = [None if row.value(key, 0) is None else _positive(row, key) for key in ("ratio_low", "ratio_high")]
    entry = Entry(
        part=row.text("part", among=PARTS),
        name=row.text("name"),
        place=row.text("place"),
        value=_positive(row, "value"),
        unit=row.text("unit"),
        over=row.text("over"),
        ratio=_positive(row, "ratio"),
        ratio_low=ends[0],
        ratio_high=ends[1],
        rounds=row.whole("rounds", low=1),
    )
    row.finish()
    low, high = ends
    if (low is None) != (high is None) or not (low or 0) <= entry.ratio <= (high or float_info.max):
        raise row.error("the ratio does not lie in its interval", "ratio", _REMEDY)
    return entry


def _positive(row: Table, key: str) -> float:
    return row.number(key, low=float_info.min, high=documents.FINITE)


def _digest(document: Mapping[str, Any]) -> str:
    text = json.dumps(document, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
