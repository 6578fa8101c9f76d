"""The made-up run and its report, for all tests of reports."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from made_up_run import MadeUpRun, make_run

import phongbench_reports
from phongbench.inputs.plan import preset
from phongbench.results import runs, schema

#: tables of the made-up run that are stored
TABLES = ("accuracy", "timing", "worst", "meshes", "incidence", "incidence_times")


@pytest.fixture(scope="session")
def made_up() -> Callable[..., MadeUpRun]:
    """Factory of made-up runs; keyword arguments as in make_run."""
    return make_run


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory) -> MadeUpRun:
    return make_run(tmp_path_factory.mktemp("run"))


@pytest.fixture(scope="session")
def stored(run: MadeUpRun, tmp_path_factory: pytest.TempPathFactory) -> runs.Run:
    """The made-up run as a folder, which another process can read."""
    folder = tmp_path_factory.mktemp("stored")
    files = {}
    for name in TABLES:
        frame = getattr(run, name)
        whole = frame.reindex(columns=[*frame.columns, *(c for c in schema.TABLES[name].names if c not in frame)])
        files[f"{name}.parquet"] = runs.write_table(folder, name, whole)
    known = {"schema": runs.SCHEMA, "plan": preset("quick").as_dict(), "code": "", "provenance": {}, "seed": 1}
    runs.write_manifest(folder, {**run.manifest, **known, "state": "complete", "files": files})
    return runs.load(folder)


@pytest.fixture(scope="session")
def report(run: MadeUpRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of that run's report."""
    return phongbench_reports.build(run, tmp_path_factory.mktemp("report")).parent
