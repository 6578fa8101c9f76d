"""Provenance tells what explains a result, and neither who nor where."""

import getpass
import json
import socket
from pathlib import Path

import pytest

from phongbench.results import provenance
from phongbench.results.machine import MEMORY_CAP, Caches, cache_sizes


def test_it_is_plain_data_with_typed_keys() -> None:
    found = provenance.collect(7, ["phongbench", "run"])
    data = json.loads(json.dumps(found.as_dict()))
    assert data["seed"] == 7
    assert data["command"] == ["phongbench", "run"]
    assert data["versions"]["numpy"] == found.versions.numpy is not None
    assert data["machine"]["caches"]["l1"] == found.machine.caches.l1 > 0
    assert data["machine"]["memory_set_cap"] == MEMORY_CAP
    assert data["flags"]["vector_bits"] in (128, 256, 512)
    assert found.machine.threads >= 1
    assert found.machine.cpu


def test_it_names_neither_host_nor_user_nor_path() -> None:
    here = Path(__file__).resolve()
    text = json.dumps(
        provenance.collect(0, [str(here), "--out", str(Path.home() / "runs"), f"--with={here}"]).as_dict()
    )
    words = set(text.replace('"', " ").replace(",", " ").split())
    assert not {socket.gethostname(), getpass.getuser()} & words
    assert str(here.parent) not in text
    assert not [word for word in words if word.startswith("/")]


@pytest.mark.parametrize(
    ("word", "reduced"),
    [
        ("run", "run"),
        ("plans/mine.toml", "mine.toml"),
        ("/somewhere/runs/", "runs"),
        ("--out=/somewhere/runs", "--out=runs"),
        ("--with=a/b.py,c/d.py", "--with=b.py,d.py"),
        ("..\\plans\\mine.toml", "mine.toml"),
        ("--alpha=10,50", "--alpha=10,50"),
        ("1/255", "1/255"),
        ("", ""),
    ],
)
def test_paths_are_reduced_to_names(word: str, reduced: str) -> None:
    assert provenance.without_paths([word]) == (reduced,)


def test_fingerprints_are_stable_and_short() -> None:
    assert provenance.fingerprint_machine() == provenance.fingerprint_machine()
    assert len({provenance.fingerprint_machine(), provenance.fingerprint_code()}) == 2
    assert all(
        len(f) == 16 and int(f, 16) >= 0 for f in (provenance.fingerprint_machine(), provenance.fingerprint_code())
    )


def caches(folder: Path, *rows: tuple[str, str, str]) -> Caches:
    for number, (level, kind, size) in enumerate(rows):
        index = folder / f"index{number}"
        index.mkdir(parents=True)
        for name, text in (("level", level), ("type", kind), ("size", size)):
            (index / name).write_text(text + "\n")
    return cache_sizes(folder)


def test_cache_sizes_are_read_from_the_system(tmp_path: Path) -> None:
    rows = [("1", "Data", "48K"), ("1", "Instruction", "64K"), ("2", "Unified", "2048K"), ("3", "Unified", "480M")]
    assert caches(tmp_path / "cache", *rows) == Caches(48 << 10, 2 << 20, 480 << 20)


def test_without_a_third_level_the_second_is_the_last(tmp_path: Path) -> None:
    assert caches(tmp_path / "cache", ("1", "Data", "64K"), ("2", "Unified", "12M")).last == 12 << 20


def test_a_system_that_tells_nothing_gets_a_cautious_guess(tmp_path: Path) -> None:
    assert cache_sizes(tmp_path / "absent") == Caches(32 << 10, 1 << 20, 8 << 20)
    assert caches(tmp_path / "odd", ("", "Data", "many"), ("3", "Unified", "")) == Caches()
