"""Every target is listed, with what it rests on and what it lacks."""

import json

import pytest
from click.testing import CliRunner

from phongbench.cli.main import main
from phongbench.targets.chips import TARGETS
from phongbench.targets.listing import listing

KEYS = {"name", "cost_kind", "available", "rows", "tool", "tool_version", "why_not"}


def test_every_target_is_there_also_those_that_are_absent() -> None:
    rows = {row["name"]: row for row in listing()}
    assert list(rows) == ["cpu", "gpu", "page", *TARGETS]
    assert all(row.keys() >= KEYS for row in rows.values())
    assert all((row["why_not"] is None) == row["available"] for row in rows.values())
    assert {name for name, row in rows.items() if row["cost_kind"] == "compiled"} == set(TARGETS)
    assert all(rows[name]["available"] and rows[name]["rows"] > 100 for name in TARGETS)


def test_without_compilers_they_still_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    for target in TARGETS.values():
        monkeypatch.setattr(type(target), "why_not", lambda self: "apt has it")
    rows = [row for row in listing() if row["cost_kind"] == "compiled"]
    assert all(row["available"] and not row["compiles"] and row["needs"] == "apt has it" for row in rows)


def test_the_command_shows_them() -> None:
    text = CliRunner().invoke(main, ["targets"])
    assert text.exit_code == 0
    assert "AMD RDNA 2" in text.output
    document = json.loads(CliRunner().invoke(main, ["targets", "--json"]).output)
    assert [row["name"] for row in document["targets"]] == [row["name"] for row in listing()]
