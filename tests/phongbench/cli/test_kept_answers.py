"""front, show and recommend, asked once more: the same text, without a table read."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner, Result

from phongbench.cli.common import ROOT
from phongbench.cli.main import main
from phongbench.cli.study_answers import summary
from phongbench.results import answering, runs

RUN = "20260101-000000-0123abcd"
ASKED = (
    "front latest --alpha 50 --all",
    "front latest --alpha 10..50 --metric rms --json",
    "front latest --alpha 50 --target cpu,rdna2 --json",
    "show latest --verbose",
    "show latest --target cpu,rdna2 --json",
    "recommend --alpha 50 --max-error 0.05",
    "recommend --alpha 10,50 --max-error 1/20 --target rdna2,gcn4 --json",
    "recommend --alpha 50 --max-error 0.05 --code glsl",
)


class MadeAnewError(Exception):
    """An answer was made, not kept."""


def _refuse(*_: Any) -> str:
    raise MadeAnewError


def _asked(words: str) -> Result:
    return CliRunner().invoke(main, words.split())


@pytest.fixture
def here(stored: Callable[..., runs.Run], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> runs.Run:
    """A run in the folder that the commands stand in."""
    monkeypatch.chdir(tmp_path)
    return stored(RUN)


@pytest.mark.parametrize("words", ASKED)
def test_who_asks_again_reads_the_same_text(here: runs.Run, monkeypatch: pytest.MonkeyPatch, words: str) -> None:
    first = _asked(words)
    monkeypatch.setattr(answering, "_text", _refuse)
    again = _asked(words)
    assert first.exit_code == 0, first.output
    assert (again.exit_code, again.stdout, again.stderr) == (0, first.stdout, first.stderr)


def test_how_an_answer_is_shown_is_no_other_question(here: runs.Run, monkeypatch: pytest.MonkeyPatch) -> None:
    assert _asked("show latest").exit_code == 0
    monkeypatch.setattr(answering, "_text", _refuse)
    assert "verdict" in json.loads(_asked("show latest --json").stdout)


def test_no_answer_of_a_changed_run_is_repeated(here: runs.Run) -> None:
    words = "front latest --alpha 50"
    assert _asked(words).exit_code == 0
    with (here.path / "timing.parquet").open("ab") as file:
        file.write(b"more")
    refused = _asked(words)
    assert refused.exit_code == 6
    assert "timing.parquet" in refused.stderr


def test_a_question_that_is_refused_is_refused_again(here: runs.Run) -> None:
    for _ in range(2):
        refused = _asked("front latest --alpha 50 --stratum nowhere")
        assert refused.exit_code == 2
        assert "highlight" in refused.stderr


def test_nothing_within_the_budget_exits_alike_again(here: runs.Run) -> None:
    first, again = (_asked("recommend --alpha 50 --max-error 1e-9") for _ in range(2))
    assert first.exit_code == again.exit_code == 1
    assert first.stdout == again.stdout


def test_a_study_that_ends_has_answered_show_and_what_it_proposes(
    here: runs.Run, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = dict.fromkeys(("accuracy", "compiling", "total"), 1.0)
    outcome = SimpleNamespace(
        run=runs.find("latest", ROOT), finished_before=False, report=None, evaluations=1, cells=1, seconds=whole
    )
    summary(outcome)
    proposed = re.search(r"phongbench (recommend .*)", capsys.readouterr().out)
    assert proposed
    monkeypatch.setattr(answering, "_text", _refuse)
    assert "What to ship" in _asked("show latest").stdout
    assert "Largest error at most" in _asked(proposed[1]).stdout
