"""The made-up run and its report, for all tests of reports."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from made_up_run import MadeUpRun, make_run

import phongbench_reports


@pytest.fixture(scope="session")
def made_up() -> Callable[..., MadeUpRun]:
    """Factory of made-up runs; keyword arguments as in make_run."""
    return make_run


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory) -> MadeUpRun:
    return make_run(tmp_path_factory.mktemp("run"))


@pytest.fixture(scope="session")
def report(run: MadeUpRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of that run's report."""
    return phongbench_reports.build(run, tmp_path_factory.mktemp("report")).parent
