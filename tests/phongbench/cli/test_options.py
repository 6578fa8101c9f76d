"""What holds for every option of every command."""

from collections.abc import Iterator

import click

from phongbench.cli.main import main

#: defaults that are no value: nothing is added where they stand
NOTHING = (None, False, True, (), "", "0", 0)


def options(command: click.Command, words: str = "phongbench") -> Iterator[tuple[str, click.Option]]:
    """Every option of a command and of those inside it, with the words that lead to it."""
    yield from ((f"{words} {one.opts[0]}", one) for one in command.params if isinstance(one, click.Option))
    for name, inner in command.commands.items() if isinstance(command, click.Group) else ():
        yield from options(inner, f"{words} {name}")


def test_help_tells_every_default() -> None:
    having = {words: option for words, option in options(main) if option.to_info_dict()["default"] not in NOTHING}
    assert len(having) > 20
    assert [words for words, option in having.items() if not (option.show_default or option.is_flag)] == []
