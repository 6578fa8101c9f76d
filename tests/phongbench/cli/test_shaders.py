"""Which formula `phongbench shader` writes."""

import json

import pytest
from click.testing import CliRunner

from phongbench.cli.main import main


@pytest.mark.parametrize(
    ("words", "name"),
    [
        (["lyon:dot:8"], "lyon:dot:8"),
        (["lyon:dot:8:minimax"], "lyon:dot:8:minimax"),
        (["lyon:dot:8", "--beta", "minimax"], "lyon:dot:8:minimax"),
        (["lyon:dot:8:minimax", "--beta", "taylor"], "lyon:dot:8"),
        (["lyon:dot:8@reflect/each"], "lyon:dot:8@reflect/each"),
    ],
)
def test_options_count_before_what_is_spelled(words: list[str], name: str) -> None:
    told = CliRunner().invoke(main, ["shader", *words, "--alpha", "50", "--json"])
    assert json.loads(told.stdout)["name"] == name
