"""An answer is kept with its run: given again where nothing that decides it has changed, and only there."""

import gc
import json
import math
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from phongbench.errors import InputError
from phongbench.results import answering, runs

#: of every kind that an answer holds
ANSWER = {
    "text": 'Δ > 1, "quoted"\n',
    "numbers": (1, 0.1, np.float64(1 / 3), np.int64(7), np.bool_(True)),
    "none": None,
    "far": [math.nan, math.inf, -math.inf, 5e-324],
}


class Asked:
    """Answers `what` and counts how often it was asked."""

    __name__ = "asked"

    def __init__(self, what: Any = ANSWER) -> None:
        self.what, self.times = what, 0

    def __call__(self, run: Any, *, root: Path, **question: Any) -> Any:
        self.times += 1
        return self.what


@pytest.fixture
def run(tmp_path: Path) -> runs.Run:
    """A run of one file."""
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "worst.parquet").write_bytes(b"rows" * 9)
    return runs.Run(folder, {"run": "a", "files": {"worst.parquet": {}}})


@pytest.fixture
def ask(run: runs.Run, tmp_path: Path) -> Callable[..., Any]:
    """Ask that run, among whose runs targets may be added: (make, run=run, **question)."""
    return lambda make, run=run, **question: answering.kept(run, tmp_path, make, **question)


def test_the_same_question_is_answered_once_and_alike(ask: Callable[..., Any]) -> None:
    make = Asked()
    first, again = ask(make, alpha="50", targets=("cpu",)), ask(make, targets=["cpu"], alpha="50")
    assert make.times == 1
    assert json.dumps(first) == json.dumps(again)
    assert first["numbers"] == [1, 0.1, 1 / 3, 7, True]
    assert first["text"] == ANSWER["text"]
    assert first["far"][1:] == [math.inf, -math.inf, 5e-324]
    assert math.isnan(first["far"][0])


@pytest.mark.parametrize("other", [{"alpha": "51"}, {"alpha": 50}, {"alpha": "50", "space": "half"}, {}])
def test_another_question_has_its_own_answer(ask: Callable[..., Any], other: dict[str, Any]) -> None:
    ask(Asked(1), alpha="50")
    assert ask(Asked(2), **other) == 2
    assert ask(Asked(3), alpha="50") == 1


def _flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[-2] ^= 1
    path.write_bytes(data)


def _answer_of(folder: Path) -> Path:
    return next((folder / runs.ANSWERS).iterdir())


CHANGES: dict[str, Callable[[Path], Any]] = {
    "a table": lambda run: _flip(run / "worst.parquet"),
    "a digit of the answer": lambda run: _flip(_answer_of(run)),
    "a cut answer": lambda run: _answer_of(run).write_text(_answer_of(run).read_text()[:-2]),
    "no UTF-8": lambda run: _answer_of(run).write_bytes(b"\xff" * 99),
    "nothing": lambda run: _answer_of(run).write_bytes(b""),
    "deleted": lambda run: shutil.rmtree(run / runs.ANSWERS),
    "an added target": lambda run: (run.parent / runs.ADDED).mkdir() or (run.parent / "targets/page-a.json").touch(),
}


@pytest.mark.parametrize("change", CHANGES)
def test_whatever_changes_it_is_answered_anew(ask: Callable[..., Any], run: runs.Run, change: str) -> None:
    ask(Asked("12"))
    CHANGES[change](run.path)
    assert ask(Asked("34")) == "34"
    assert ask(Asked("56")) == "34"


@pytest.mark.parametrize("name", ["digest_of_folder", "versions", "flags", "fingerprint_machine"])
def test_another_program_or_machine_answers_anew(
    ask: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    ask(Asked(1))
    monkeypatch.setattr(answering, name, lambda *_: "other")
    assert ask(Asked(2)) == 2


def test_another_manifest_is_another_run(ask: Callable[..., Any], run: runs.Run) -> None:
    ask(Asked(1))
    assert ask(Asked(2), run=runs.Run(run.path, {**run.manifest, "seed": 2})) == 2


@pytest.mark.parametrize("reason", ["plug-ins", "no run", "a table that is missing"])
def test_what_more_may_decide_is_never_kept(
    ask: Callable[..., Any], run: runs.Run, monkeypatch: pytest.MonkeyPatch, reason: str
) -> None:
    if reason == "plug-ins":
        monkeypatch.setattr(answering, "entry_points", lambda **_: ["mine"])
    elif reason == "a table that is missing":
        (run.path / "worst.parquet").unlink()
    make = Asked()
    whom = {"run": None} if reason == "no run" else {}
    assert json.dumps(ask(make, **whom)) == json.dumps(ask(make, **whom))
    assert make.times == 2
    assert not (run.path / runs.ANSWERS).exists()


def test_an_error_is_not_kept(ask: Callable[..., Any]) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise InputError("not measured")

    for _ in range(2):
        with pytest.raises(InputError, match="not measured"):
            ask(refuse)


@pytest.mark.parametrize("wanted", [True, False])
def test_garbage_is_collected_afterwards_as_before(ask: Callable[..., Any], wanted: bool) -> None:
    def make(*_: Any, **question: Any) -> bool:
        if question["wrong"]:
            raise InputError("not measured")
        return gc.isenabled()

    before = gc.isenabled()
    try:
        gc.enable() if wanted else gc.disable()
        assert ask(make, wrong=False) is False
        with pytest.raises(InputError):
            ask(make, wrong=True)
        assert gc.isenabled() is wanted
    finally:
        gc.enable() if before else gc.disable()


def test_where_nothing_can_be_written_it_answers_all_the_same(ask: Callable[..., Any], run: runs.Run) -> None:
    (run.path / runs.ANSWERS).write_text("a file in the way")
    assert (ask(Asked(1)), ask(Asked(2))) == (1, 2)


def test_a_link_is_not_followed(ask: Callable[..., Any], run: runs.Run, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (run.path / runs.ANSWERS).symlink_to(elsewhere)
    assert (ask(Asked(1)), ask(Asked(2))) == (1, 2)
    assert list(elsewhere.iterdir()) == []


def test_so_many_are_kept_and_nothing_else_is_touched(
    ask: Callable[..., Any], run: runs.Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(answering, "MOST", 2)
    mine = run.path / runs.ANSWERS / "mine.json"
    mine.parent.mkdir()
    mine.touch()
    for number in range(4):
        ask(Asked(number), alpha=number)
    assert len(list(mine.parent.iterdir())) == 3
    assert ask(Asked("new"), alpha=3) == 3
    assert mine.exists()


def test_a_run_that_is_discarded_loses_its_answers(ask: Callable[..., Any], run: runs.Run) -> None:
    ask(Asked(1))
    runs.clear(run.path)
    assert list(run.path.iterdir()) == []


def test_the_digest_of_a_folder_knows_names_and_bytes_but_not_what_python_compiles(tmp_path: Path) -> None:
    def digest() -> str:
        return answering.digest_of_folder(tmp_path)

    (tmp_path / "a.json").write_text("1")
    before = digest()
    (tmp_path / "__pycache__").mkdir()
    (tmp_path / "__pycache__" / "a.pyc").write_text("1")
    assert digest() == before
    (tmp_path / "a.json").rename(tmp_path / "b.json")
    renamed = digest()
    (tmp_path / "b.json").write_text("2")
    assert len({before, renamed, digest()}) == 3
