"""A report is drawn again where anything that decides its bytes has changed, and only there."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest

from phongbench.results import answering, runs
from phongbench_reports import build, kept

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

    monkeypatch.setattr(sys.modules["phongbench_reports.build"], "sections_of", draw)
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
    monkeypatch.setattr(sys.modules["phongbench_reports.build"], "FIGURES", ())
    with pytest.raises(DrawnError):
        _again(folder)


def test_a_single_file_is_always_drawn(folder: Path) -> None:
    with pytest.raises(DrawnError):
        _again(folder, single_file=True)
