"""The made-up run and its report, for all tests of reports."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import pytest
from made_up_run import MadeUpRun, make_run

import phongbench_reports
from phongbench.analysis.rows import Rows
from phongbench.inputs.plan import preset
from phongbench.results import runs, schema
from phongbench_reports import drawing, plots
from phongbench_reports.figures import FIGURES
from phongbench_reports.plots import ink
from phongbench_reports.second_process import Drawn, drawn

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
def drawings(run: MadeUpRun) -> dict[str, Drawn]:
    """Every figure of that run, drawn once."""
    with ink():
        return {part.name: drawn(Rows(run), part) for part in FIGURES}


@pytest.fixture(scope="session")
def as_drawn(drawings: dict[str, Drawn]) -> Callable[[], AbstractContextManager[None]]:
    """Reports of that run that are built meanwhile take its figures from there."""

    @contextmanager
    def taken() -> Iterator[None]:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(drawing, "drawn", lambda study, part: drawings.get(part.name) or drawn(study, part))
            yield

    return taken


@pytest.fixture
def blank_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports say what they say about their figures, and draw none: half of the work, where nobody looks at them."""
    monkeypatch.setattr(plots, "svg_pair", lambda *_: (b"<svg/>", b"<svg/>"))


@pytest.fixture(scope="session")
def report(
    run: MadeUpRun, as_drawn: Callable[[], AbstractContextManager[None]], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """The folder of that run's report."""
    with as_drawn():
        return phongbench_reports.build(run, tmp_path_factory.mktemp("report")).parent
