"""Tables, notes and commands at every width: no word is split, nothing is cut, and a pipe gets no padding."""

import random
import re
import shlex
from collections import Counter

import pytest

from phongbench.cli import layout
from phongbench.cli.layout import pairs, table_lines, wrapped

WIDTHS = (60, 80, 100, 160)
WORDS = ("lyon:dot:32:minimax", "0.355 .. 0.413", "a longer reason, told in words", "", "7", "x" * 70)


@pytest.mark.parametrize("width", [*WIDTHS, None])
@pytest.mark.parametrize("seed", range(20))
def test_every_word_of_a_table_is_whole_at_any_width(width: int | None, seed: int) -> None:
    draw = random.Random(seed)
    columns = [draw.choice(("formula", "8-bit codes", "", "time / exact Phong")) for _ in range(draw.randint(1, 9))]
    rows = [[draw.choice(WORDS) for _ in columns] for _ in range(draw.randint(1, 6))]
    lines = table_lines(columns, rows, [draw.random() < 0.5 for _ in columns], width)
    told = "\n".join(lines).replace("─", " ").split()
    expected = [word for row in rows for cell in row for word in cell.split()]
    assert Counter(told) >= Counter(expected)
    assert all(line == line.rstrip() for line in lines)
    if width is not None:
        assert all(len(line) <= width or max(map(len, line.split())) > width - 10 for line in lines)


def test_a_row_is_a_line_in_a_pipe_and_a_block_where_it_does_not_fit() -> None:
    columns, right = ("formula", "error", "why"), (False, True, False)
    rows = [["lyon:dot:8", "0.01", "the cheapest of those that stay within the budget " * 2]]
    head, row = table_lines(columns, rows, right, None)
    assert head == "formula     error  why"
    assert row == f"lyon:dot:8   0.01  {rows[0][2].strip()}"
    stacked = table_lines(columns, rows, right, 60)
    assert stacked[:2] == ["lyon:dot:8", "  error  0.01"]
    assert table_lines(("alpha", "why"), [["5 .. 10", rows[0][2]]], (True, False), 60)[0] == "alpha 5 .. 10"
    assert table_lines(columns, rows, right, 100)[2].startswith("lyon:dot:8   0.01  the cheapest")


def test_columns_that_hold_nothing_are_left_out() -> None:
    assert table_lines(("a", "b"), [["1", ""]], (False, False), None) == ["a", "1"]


@pytest.mark.parametrize("width", WIDTHS)
def test_notes_wrap_at_words(width: int) -> None:
    text = "errors were measured, and are lower bounds: `recommend` proves bounds of lyon:cross:8@lengthwise/once, " * 3
    lines = wrapped(text, width)
    assert " ".join(lines).split() == text.split()
    assert all(len(line) <= width for line in lines)


@pytest.mark.parametrize("width", WIDTHS)
def test_a_command_that_is_copied_from_a_narrow_terminal_is_one_command(
    width: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(layout, "width_of", lambda *, err=False: width)
    words = "phongbench shader lyon:dot:32:minimax --alpha 50 --precision float16 --length-error 0.01 --target rdna2"
    layout.command(words, "as code: ")
    printed = capsys.readouterr().out
    assert all(len(line) <= width for line in printed.splitlines())
    assert shlex.split(re.sub(r"\\\n", "", printed).removeprefix("as code: ")) == words.split()


def test_facts_stand_below_one_another_and_long_ones_below_their_names() -> None:
    data = {"run": "r1", "raw normals": "at alpha 128 from edges of 2.4 degrees", "path": "p" * 60}
    lines = pairs(list(data.items()), 50)
    assert lines[0] == "run          r1"
    assert lines[1:3] == ["raw normals  at alpha 128 from edges of 2.4", "             degrees"]
    assert lines[3:] == ["path", f"  {'p' * 60}"]
