"""A report is drawn again where anything that decides its bytes has changed, and only there."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest

from phongbench.results import answering, runs
from phongbench_reports import build, drawing, kept

FEW = ("speed",)


class DrawnError(Exception):
    """The report is drawn."""


@pytest.fixture(autouse=True)
def few_figures(only_figures: Callable[..., AbstractContextManager[None]]) -> Any:
    with only_figures(*FEW):
        yield


@pytest.fixture(scope="module")
def made(
    stored: runs.Run,
    tmp_path_factory: pytest.TempPathFactory,
    only_figures: Callable[..., AbstractContextManager[None]],
) -> Path:
    """A run with its report."""
    folder = tmp_path_factory.mktemp("made") / "run"
    shutil.copytree(stored.path, folder)
    with only_figures(*FEW):
        build(runs.load(folder), folder / "report")
    return folder


@pytest.fixture
def folder(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of it, which a test may change; drawing again is told by DrawnError."""

    def draw(*_: Any, **__: Any) -> None:
        raise DrawnError

    monkeypatch.setattr(drawing, "sections_of", draw)
    return Path(shutil.copytree(made, tmp_path / "run"))


def _again(folder: Path, **options: Any) -> Path:
    return build(runs.load(folder), folder / "report", **options)


def test_what_is_there_already_is_not_drawn_again(folder: Path) -> None:
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert _again(folder) == folder / "report" / "index.html"
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


def test_a_run_that_was_moved_keeps_its_report(folder: Path) -> None:
    moved = folder.rename(folder.parent / "moved")
    assert _again(moved).parent.parent == moved


def _flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


CHANGES: dict[str, Callable[[Path], Any]] = {
    "a figure": lambda run: _flip(run / "report" / "figures" / f"{FEW[0]}-dark.svg"),
    "numbers": lambda run: _flip(run / "report" / "data" / f"{FEW[0]}.csv"),
    "no page": lambda run: (run / "report" / "index.html").unlink(),
    "a table": lambda run: _flip(run / "worst.parquet"),
    "another seed": lambda run: runs.write_manifest(run, {**runs.load(run).manifest, "seed": 2}),
    "no note": lambda run: (run / "report" / kept.MADE).unlink(),
    "an empty note": lambda run: (run / "report" / kept.MADE).write_text("[]"),
    "a cut note": lambda run: (run / "report" / kept.MADE).write_text('{"of": "'),
    "a note of no files": lambda run: (run / "report" / kept.MADE).write_text(
        json.dumps({"of": kept.origin(runs.load(run), FEW), "files": {}})
    ),
}


@pytest.mark.parametrize("change", CHANGES)
def test_whatever_changes_the_report_is_drawn_again(folder: Path, change: str) -> None:
    CHANGES[change](folder)
    with pytest.raises(DrawnError):
        _again(folder)


def _plugged(**_: Any) -> list[str]:
    return ["mine"]


@pytest.mark.parametrize(
    ("module", "name", "other"),
    [
        (answering, "digest_of_folder", lambda _: "other"),
        (answering, "fingerprint_machine", lambda: "other"),
        (kept, "version", lambda _: "9.9"),
        (answering, "entry_points", _plugged),
    ],
    ids=["code", "machine", "library", "plug-in"],
)
def test_another_program_draws_it_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch, module: Any, name: str, other: Any
) -> None:
    monkeypatch.setattr(module, name, other)
    with pytest.raises(DrawnError):
        _again(folder)


def test_other_figures_are_drawn(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawing, "FIGURES", ())
    with pytest.raises(DrawnError):
        _again(folder)


def test_a_single_file_is_always_drawn(folder: Path) -> None:
    with pytest.raises(DrawnError):
        _again(folder, single_file=True)


def _files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_new_folder_becomes_a_copy_of_the_runs_own_report(folder: Path, tmp_path: Path) -> None:
    new = tmp_path / "deep" / "new"
    assert kept.there(runs.load(folder), new) == new / "index.html"
    assert _files(new) == _files(folder / "report")
    assert kept.there(runs.load(folder), new) == new / "index.html"


def test_what_lies_in_a_folder_is_not_mixed_with_a_copy(folder: Path, tmp_path: Path) -> None:
    new = tmp_path / "new"
    new.mkdir()
    assert kept.there(runs.load(folder), new) is None
    assert _files(new) == {}


@pytest.mark.parametrize("change", CHANGES)
def test_a_report_that_is_not_as_it_was_is_neither_there_nor_copied(folder: Path, tmp_path: Path, change: str) -> None:
    CHANGES[change](folder)
    run = runs.load(folder)
    assert kept.there(run, folder / "report") is None
    assert kept.there(run, tmp_path / "new") is None
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("name", ["../worst.parquet", "/etc/hostname", "figures/../../manifest.json", "a\n.css", "."])
def test_a_note_names_no_file_of_elsewhere(folder: Path, tmp_path: Path, name: str) -> None:
    run, note = runs.load(folder), folder / "report" / kept.MADE
    made = json.loads(note.read_text())
    (folder / "a\n.css").touch()
    place = folder / "report" / name
    made["files"][name] = hashlib.sha256(place.read_bytes()).hexdigest() if place.is_file() else ""
    note.write_text(json.dumps(made))
    assert kept.there(run, tmp_path / "new") is None


@pytest.mark.parametrize("figures", [None, "front", {"front": 1}, [{}], [None], 3])
def test_a_note_of_other_figures_counts_for_nothing(folder: Path, figures: Any) -> None:
    note = folder / "report" / kept.MADE
    note.write_text(json.dumps({**json.loads(note.read_text()), "figures": figures}))
    assert kept.there(runs.load(folder), folder / "report") is None


def test_the_command_that_finds_it_there_imports_nothing_that_draws(folder: Path) -> None:
    code = (
        "import sys; from phongbench.cli.main import main\n"
        "try: main(['report', sys.argv[1]])\n"
        "finally: print(*sys.modules, file=sys.stderr)"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    command = [sys.executable, "-c", code, str(folder)]
    done = subprocess.run(command, check=False, capture_output=True, text=True, env=environment)
    assert done.stdout.splitlines() == [str(folder / "report" / "index.html")], done.stderr
    imported = {name.partition(".")[0] for name in done.stderr.split()}
    assert "phongbench_reports" in imported
    assert not {"jinja2", "matplotlib", "numba", "pandas", "pyarrow", "scipy"} & imported
