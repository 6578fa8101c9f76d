"""Every command on terminals of four widths and in a pipe: no word is split, nothing is cut, nothing is padded."""

import copy
import pydoc
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner
from made_up_bench import BENCH

from phongbench.benchmarks import ledger
from phongbench.cli import layout
from phongbench.cli.main import main
from phongbench.results import ledgers
from phongbench.results.runs import Run

WIDTHS = (60, 80, 100, 160)
FIRST, SECOND = "20260101-000000-0123abcd", "20260102-000000-0123abcd"
#: of each command what prints something of its own
LINES = (
    "list",
    "show latest --verbose",
    "show latest --target cpu,rdna2",
    f"verify {FIRST}",
    f"compare {FIRST} {SECOND}",
    "compare before.json after.json",
    "front latest --alpha 10..50 --all",
    "front latest --alpha 50 --target rdna2",
    "recommend --alpha 50 --max-error 0.02",
    "recommend --alpha 10,50 --max-error 0.02 --target cpu,rdna2 --inputs cosine",
    "recommend --materials scene.mtl --max-error 0.02",
    "claims latest",
    "claims latest --verbose",
    "approximations",
    "targets",
    "doctor",
    "bench --out bench.json",
    "render --list",
    "run --only lyon --alpha 10..50 --gamma 8 --precision float32 --samples 2000 --dry-run",
)
#: what takes long to answer
SLOW = tuple(
    f"phongbench.analysis.{name}"
    for name in (
        "claims.answer", "compare.compare", "front.points", "recommend.recommend",
        "material_advice.for_materials", "summary.summarise", "verdict.verdict",
    )
)  # fmt: skip
#: heads of first columns: a stacked row begins with what stands there, and not with its head
HEADS = {
    "run", "alpha", "formula", "material", "name", "check", "by", "scene", "in", "work", "call", "stage", "what",
}  # fmt: skip
#: what prints documents or code, which are not laid out, or shares its printing with those above
OTHERS = {"report", "merge", "serve", "shade", "shader", "inverse"}


@pytest.fixture
def printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stored: Callable[..., Run]) -> Callable[..., list[str]]:
    """The lines of a command on a terminal that is so wide, in a folder with two runs."""
    machine = {"provenance": {"machine_fingerprint": "m"}}
    first = stored(FIRST, **machine)
    changed = first.accuracy.assign(max_abs=first.accuracy["max_abs"] * 1.5)
    stored(SECOND, accuracy=changed, ratio=lambda row: 0.5 if row.approximation == "lyon" else 1.0, **machine)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.mtl").write_text("newmtl polished_gold\nNs 50\nnewmtl dull\nNs 2\n")
    checks = [{"check": "kernel cache", "state": "good", "detail": f"{'/a/rather/long/path' * 3} (53.0 MiB)"}]
    monkeypatch.setattr("phongbench.study.doctor.examine", lambda: checks)
    monkeypatch.setattr("phongbench.study.forecast.forecast", lambda *_: _Forecast())
    monkeypatch.setattr("phongbench.benchmarks.ledger.measure", lambda names, **_: BENCH)
    for name, changed in (("before.json", 1.0), ("after.json", 2.0)):
        scaled = tuple(_scaled(entry, changed) for entry in ledger.entries(BENCH))
        ledgers.write(ledgers.Ledger("20260101-000000", PROVENANCE, scaled), tmp_path / name)
    for place in SLOW:  # only how an answer is printed differs between widths
        monkeypatch.setattr(place, _once(pydoc.locate(place)))

    def run(words: str, width: int | None) -> list[str]:
        monkeypatch.setattr(layout, "width_of", lambda *, err=False: width)
        found = CliRunner().invoke(main, words.split())
        assert found.exit_code in (0, 1), found.output
        assert isinstance(found.exception, SystemExit | None), found.exception
        return found.output.splitlines()

    return run


def _once(answer: Any) -> Callable[..., Any]:
    """The function, asked once for each question; runs are the same in a test."""
    known: dict[str, Any] = {}

    def asked(*positional: Any, **question: Any) -> Any:
        key = repr(question)
        if key not in known:
            known[key] = answer(*positional, **question)
        return copy.deepcopy(known[key])

    return asked


PROVENANCE = {"machine_fingerprint": "m", "code": "c", "machine": {"cpu": "a processor"}}


def _scaled(entry: ledgers.Entry, factor: float) -> ledgers.Entry:
    ends = {name: end and factor * end for name in ("ratio_low", "ratio_high") for end in [getattr(entry, name)]}
    return replace(entry, ratio=factor * entry.ratio, **ends)


class _Forecast:
    def as_dict(self) -> dict[str, Any]:
        return {"cells": 1764, "bytes": 4_908_440, "seconds": {"accuracy": 15.9, "stability": 4.0, "timing": 6.0}}


@pytest.mark.parametrize("words", LINES)
def test_a_command_prints_the_same_words_at_every_width(printed: Callable[..., list[str]], words: str) -> None:
    piped = printed(words, None)
    assert piped
    assert [line for line in piped if line != line.rstrip()] == []
    expected = _words(piped)
    for width in WIDTHS:
        lines = printed(words, width)
        assert [line for line in lines if line != line.rstrip()] == []
        assert _words(lines) <= expected
        assert expected - _words(lines) <= HEADS
        too_wide = [line for line in lines if len(line) > width and max(map(len, line.split())) <= width - 20]
        assert too_wide == []


def _words(lines: list[str]) -> set[str]:
    """The words that stand in these lines, without rules and the backslashes of commands that go on."""
    return {word for line in lines for word in line.split() if not re.fullmatch(r"─+|\\", word)}


def test_every_command_is_among_them() -> None:
    shown = {words.split()[0] for words in LINES}
    assert shown | OTHERS == set(main.commands)
    assert all(isinstance(command, click.Command) for command in main.commands.values())
