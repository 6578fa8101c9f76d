"""Talk goes to stderr, data to stdout, and numbers are short."""

import pytest

from phongbench.cli.layout import table, text_of
from phongbench.cli.terminal import TerminalProgress


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (None, ""),
        (float("nan"), ""),
        (0.012345678, "0.01235"),
        (7, "7"),
        (159828, "159,828"),
        ({"a": 0.5}, "a 0.5"),
        ("x", "x"),
    ],
)
def test_values_are_shown_as_people_read_them(value, shown):
    assert text_of(value) == shown


def test_a_table_goes_to_stdout_whole(capsys):
    table("Title", ("a", "b"), [("x" * 60, 1.0), ("[red]y", None)])
    out, err = capsys.readouterr()
    assert "x" * 60 in out
    assert "[red]y" in out
    assert err == ""


def test_stages_are_told_on_stderr_where_there_is_no_terminal(capsys):
    with TerminalProgress() as progress:
        progress.stage("accuracy", 10.0)
        progress.advance(5.0)
        progress.note("a [bold] remark")
    out, err = capsys.readouterr()
    assert out == ""
    assert err.splitlines()[0] == "accuracy"  # not counted, for nobody said how many there are
    assert "a [bold] remark" in err


def test_stages_are_counted_and_one_that_begins_again_keeps_its_number(capsys):
    with TerminalProgress() as progress:
        progress.stages(2)
        for stage in ("sweeping", "timing", "timing"):
            progress.stage(stage, 1.0)
    assert [line.split()[:4] for line in capsys.readouterr().err.splitlines()] == [
        ["1", "of", "2", "sweeping"],
        ["2", "of", "2", "timing"],
        ["2", "of", "2", "timing"],
    ]


def test_details_are_told_to_those_who_ask(capsys):
    for verbose in (False, True):
        with TerminalProgress(verbose=verbose) as progress:
            progress.detail("2 laws have no bound")
        assert ("2 laws" in capsys.readouterr().err) == verbose


def test_quiet_progress_says_nothing(capsys):
    with TerminalProgress(quiet=True) as progress:
        progress.stage("accuracy")
        progress.note("remark")
    assert capsys.readouterr() == ("", "")
