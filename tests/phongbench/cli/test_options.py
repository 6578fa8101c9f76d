"""What holds for every option of every command."""

from collections.abc import Iterator

import click
import pytest
from click.testing import CliRunner

from phongbench.cli.main import main

#: defaults that are no value, as Python writes them
NOTHING = ("None", "False", "True", "()", "''", "'0'", "0")
#: no noise, no other scale, no delay: what they are by default goes without saying
UNSAID = {"phongbench inverse line --noise", "phongbench inverse line --scale", "phongbench serve --drain"}


def options(command: click.Command, words: str = "phongbench") -> Iterator[tuple[str, click.Option]]:
    """Every option of a command and of those inside it, with the words that lead to it."""
    yield from ((f"{words} {one.opts[0]}", one) for one in command.params if isinstance(one, click.Option))
    for name, inner in command.commands.items() if isinstance(command, click.Group) else ():
        yield from options(inner, f"{words} {name}")


def test_help_tells_every_default() -> None:
    having = {words: one for words, one in options(main) if repr(one.to_info_dict()["default"]) not in NOTHING}
    assert len(having) > 20
    assert {words for words, one in having.items() if not (one.show_default or one.is_flag)} == UNSAID


@pytest.mark.parametrize("words", ["merge", "claims", "verify", "compare"])
def test_a_command_about_runs_asks_for_them(words: str) -> None:
    ended = CliRunner().invoke(main, [words])
    assert ended.exit_code == 2
    assert "Missing argument" in ended.stderr
