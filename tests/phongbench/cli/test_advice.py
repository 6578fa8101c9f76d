"""What `recommend` asks for."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from phongbench.cli.main import main


@pytest.mark.parametrize(
    ("words", "said"),
    [([], "Missing option '--max-error'"), (["--inverse-error", "1"], "phongbench run --probe inverse")],
)
def test_an_error_is_named_of_highlights_or_of_normals(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    found = CliRunner().invoke(main, ["recommend", "--alpha", "50", *words])
    assert (found.exit_code, found.stdout) == (2, "")
    assert said in found.stderr
