"""A second process draws the same figures; without it, or if it fails, the report is the same."""

from __future__ import annotations

import dataclasses
import io
import pickle
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import pandas as pd
import pytest

from phongbench.analysis.rows import Rows
from phongbench.results import runs
from phongbench_reports import build, second_process
from phongbench_reports.figures import FIGURES
from phongbench_reports.kept import MADE
from phongbench_reports.plots import ink
from phongbench_reports.second_process import begun, beside, drawn

#: enough for both processes to draw some
FEW = ("error_angle", "error_gamma", "heatmap", "split", "speed")


@pytest.fixture(scope="module", autouse=True)
def few_figures(only_figures: Callable[..., AbstractContextManager[None]]) -> Iterator[None]:
    """Reports have these figures only."""
    with only_figures(*FEW):
        yield


@pytest.fixture(scope="module")
def files(stored: runs.Run, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The report that one process makes."""
    return _contents(build(stored, tmp_path_factory.mktemp("alone")))


def _contents(index: Path) -> dict[str, bytes]:
    files = (file for file in index.parent.rglob("*.*") if file.name != MADE)
    found = {str(file.relative_to(index.parent)): file.read_bytes() for file in files}
    assert sum(name.startswith("figures") for name in found) == 2 * len(FEW)
    return found


def test_the_answer_of_the_other_process_holds_what_was_asked(stored: runs.Run) -> None:
    names = [FIGURES[0].name, FIGURES[-1].name]
    answers = io.BytesIO()
    second_process.serve(str(stored.path), [f"{name}\n" for name in names], answers)
    answers.seek(0)
    found = {name: pickle.load(answers) for name in names}
    assert answers.read() == b""
    study = Rows(stored)
    with ink():
        for entry in (FIGURES[0], FIGURES[-1]):
            own = drawn(study, entry)
            assert found[entry.name].pair == own.pair
            assert found[entry.name].content.takeaway == own.content.takeaway
            pd.testing.assert_frame_equal(found[entry.name].content.data, own.content.data)


def test_two_processes_share_the_figures(stored: runs.Run) -> None:
    names = list(FEW)
    with begun(stored.path) as other, beside(other, names) as shared:
        first = next(shared.mine())
        theirs = shared.theirs()  # all the others, from the last on
    assert [first, *reversed(theirs)] == names


def test_two_processes_write_the_same_bytes_as_one(
    stored: runs.Run, files: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.modules["phongbench_reports"], "cores", lambda: 2)
    assert _contents(build(stored, tmp_path / "report", processes=2)) == files


def test_what_a_failed_process_leaves_is_drawn_here(
    stored: runs.Run, files: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.modules["phongbench_reports"], "cores", lambda: 2)
    lost = dataclasses.replace(stored, path=tmp_path / "no such run")
    for name in (file.removesuffix(".parquet") for file in stored.manifest["files"]):
        lost.__dict__[name] = getattr(stored, name)
    lost.__dict__["compact_accuracy"] = stored.compact_accuracy
    lost.__dict__["_records"] = {"accuracy": stored.records("accuracy")}
    with begun(lost.path) as other, beside(other, ["split"]) as shared:
        assert shared.theirs() == {}
    assert _contents(build(lost, tmp_path / "report", processes=2)) == files
