"""The README keeps its promises: commands that run, links that lead somewhere, numbers that a program wrote."""

import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from phongbench.cli import main

README = Path(__file__).resolve().parents[2] / "README.md"
GENERATED = {"verdict", "front", "speed", "throughput", "machine"}
MARKED = re.compile(r"<!-- generated: (\w+) -->(.*?)<!-- /generated: (\w+) -->", re.DOTALL)
CONSOLE = re.compile(r"^```console\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def commands(program: str) -> list[str]:
    """The commands of that program shown in the README's console blocks."""
    lines = [line for block in CONSOLE.findall(README.read_text()) for line in block.splitlines()]
    return [line.removeprefix("$ ") for line in lines if line.startswith(f"$ {program} ")]


@pytest.mark.parametrize("command", commands("phongbench"))
def test_a_command_shown_is_understood(command: str) -> None:
    # --help is answered only after every command and option of the line was found, and before anything runs.
    arguments = shlex.split(command, comments=True)[1:]
    result = CliRunner().invoke(main, [*arguments, "--help"])
    assert result.exit_code == 0, result.output


@pytest.mark.parametrize("command", commands("make"))
def test_a_goal_shown_exists(root: Path, command: str) -> None:
    goals = re.findall(r"^([a-z]+):.*## ", (root / "Makefile").read_text(), re.MULTILINE)
    assert shlex.split(command, comments=True)[1] in goals


def test_the_first_commands_are_run_and_test() -> None:
    assert [command.split("#")[0].strip() for command in commands("make")[:2]] == ["make run", "make test"]


def test_every_generated_part_is_there_once_and_filled() -> None:
    # An empty part means that `make docs` has not run.
    parts = [(opened, body.strip(), closed) for opened, body, closed in MARKED.findall(README.read_text())]
    assert sorted(opened for opened, _, _ in parts) == sorted(GENERATED)
    assert all(opened == closed for opened, _, closed in parts)
    assert [opened for opened, body, _ in parts if not body] == []


def test_every_link_into_the_repository_leads_to_a_file(root: Path) -> None:
    links = re.findall(r"\]\((?!https?:|#)([^)#\s]+)", README.read_text())
    assert not [link for link in links if not (root / link).exists()]
