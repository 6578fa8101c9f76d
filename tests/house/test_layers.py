"""The layers in pyproject.toml hold: lower modules know nothing of higher ones, and every module has its place."""

from pathlib import Path

import pytest
from importlinter.cli import lint_imports


def test_every_import_contract_is_kept(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status = lint_imports(config_filename=str(root / "pyproject.toml"), no_cache=True, no_logo=True)
    assert status == 0, capsys.readouterr().out
