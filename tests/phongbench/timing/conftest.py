"""No timing of a test waits for a real one, or hinders it."""

import tempfile
from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def own_lock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests neither wait for a real timing run nor hinder one."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
