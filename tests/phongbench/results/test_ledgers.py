"""Performance ledgers on disk: what was written is read, and nothing else is."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from phongbench.errors import CorruptRunError, InputError, PhongbenchError
from phongbench.results import ledgers
from phongbench.results.ledgers import Entry, Ledger

ENTRY = Entry("kernel", "exact Phong", "l2", 0.365, "ns", "adding", 2.5, 2.4, 2.6, 24)
HERE = {"machine_fingerprint": "m", "code": "c", "machine": {"cpu": "a processor"}}
LEDGER = Ledger("20261130-101500", HERE, (ENTRY, replace(ENTRY, name="Gaussian", ratio_low=None, ratio_high=None)))


def test_what_is_written_is_read(tmp_path: Path) -> None:
    file = ledgers.write(LEDGER, tmp_path / "before.json")
    assert ledgers.read(file) == LEDGER
    assert [path.name for path in tmp_path.iterdir()] == ["before.json"]


def test_without_a_name_it_lies_beside_the_runs_by_time_and_content(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    first, other = ledgers.write(LEDGER), ledgers.write(replace(LEDGER, entries=(ENTRY,)))
    assert first.parent == other.parent == Path("phongbench-runs/ledgers")
    assert first.name.startswith("20261130-101500-")
    assert first != other


def test_a_ledger_of_now_tells_where_it_comes_from_and_no_path(tmp_path: Path) -> None:
    made = ledgers.of_now([ENTRY], 1, ("phongbench", "bench", "--out", str(tmp_path / "x.json")))
    read = ledgers.read(ledgers.write(made, tmp_path / "x.json"))
    assert len(read.provenance["machine_fingerprint"]) == 16
    assert str(tmp_path) not in json.dumps(read.as_dict())


def _set(*steps: Any) -> Callable[[Any], None]:
    """Change what stands at these steps to the last of them."""

    def change(document: Any) -> None:
        *way, last, value = steps
        for step in way:
            document = document[step]
        document[last] = value

    return change


@pytest.mark.parametrize("sealed", [False, True], ids=["the digest is the old one", "the digest is right"])
@pytest.mark.parametrize(
    ("change", "told"),
    [
        (_set("entries", 0, "ratio", 2.45), None),
        (_set("entries", 0, "ratio", 3.0), "does not lie in its interval"),
        (_set("entries", 0, "ratio", -1.0), "entries.0.ratio|entries\\[0\\].ratio"),
        (_set("entries", 0, "ratio_low", None), "does not lie in its interval"),
        (_set("entries", 0, "value", "fast"), "is not a number"),
        (_set("entries", 0, "value", float("inf")), "finite"),
        (_set("entries", 0, "part", "car"), "unknown part"),
        (_set("entries", 0, "more", 1), "unknown key"),
        (_set("entries", 0, "rounds", 0), "whole number"),
        (_set("entries", 1, "name", "exact Phong"), "stands there twice"),
        (_set("entries", {}), "is not a list"),
        (_set("provenance", "machine_fingerprint", 5), "is not a string"),
        (_set("provenance", "machine", []), "object"),
        (_set("further", 1), "unknown key"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_was_changed_is_refused(tmp_path: Path, change: Any, told: str | None, sealed: bool) -> None:
    document = LEDGER.as_dict()
    change(document)
    if sealed:
        document["digest"] = ledgers._digest({key: value for key, value in document.items() if key != "digest"})
    file = tmp_path / "changed.json"
    file.write_text(json.dumps(document))
    if sealed and told is None:
        assert ledgers.read(file).entries[0].ratio == 2.45
        return
    with pytest.raises(InputError if sealed else CorruptRunError, match=told if sealed else "has changed"):
        ledgers.read(file)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "not valid JSON"),
        ("[1]", "a ledger is a table"),
        ("{}", "is no ledger"),
        ('{"schema": 1, "run": "a"}', "is no ledger"),
        ('{"ledger": 2, "digest": ""}', "has schema 2"),
        ('{"ledger": true}', "whole number"),
        ('{"ledger": 1}', "digest is missing"),
        ("[" * 100_000, "too deep"),
        ("\0", "not valid JSON"),
    ],
)
def test_other_files_are_refused_with_their_name_and_what_to_do(tmp_path: Path, text: str, told: str) -> None:
    file = tmp_path / "other.json"
    file.write_text(text)
    with pytest.raises(InputError, match=told) as found:
        ledgers.read(file)
    assert "other.json" in str(found.value.where)


def test_half_a_ledger_is_refused_wherever_it_ends(tmp_path: Path) -> None:
    text = ledgers.write(LEDGER, tmp_path / "whole.json").read_text()
    for end in range(0, len(text) - 2, 97):
        (tmp_path / "half.json").write_text(text[:end])
        with pytest.raises(PhongbenchError):
            ledgers.read(tmp_path / "half.json")


def test_what_is_not_there_is_said_to_be_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot read the ledger"):
        ledgers.read(tmp_path / "none.json")
