"""Talk goes to stderr, data to stdout, and numbers are short."""

import pytest

from phongbench.cli.terminal import TerminalProgress, table, text_of


@pytest.mark.parametrize(
    ("value", "shown"), [(None, ""), (float("nan"), ""), (0.012345678, "0.01235"), (7, "7"), ("x", "x")]
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
    assert "accuracy" in err
    assert "a [bold] remark" in err


def test_quiet_progress_says_nothing(capsys):
    with TerminalProgress(quiet=True) as progress:
        progress.stage("accuracy")
        progress.note("remark")
    assert capsys.readouterr() == ("", "")
