"""The machines that costs are known of, as a table."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from phongbench.cli.main import main
from phongbench.targets.listing import listing


def test_what_is_absent_says_why_and_only_that(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    _, *lines = CliRunner().invoke(main, ["targets"]).stdout.splitlines()
    for one, line in zip(listing(), lines, strict=True):
        assert line.startswith(one["name"])
        assert line.endswith(f"absent: {one['why_not']}") == (not one["available"])
        assert ("absent" in line) == (not one["available"])
