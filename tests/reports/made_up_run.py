"""A made-up run for the report's tests; its rows are in `made_up_errors` and `made_up_tables`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd
from made_up_errors import behaviour_rows, cells, rows_of, smoothness_rows, worst_rows
from made_up_tables import (
    cost_rows,
    cut_rows,
    incidence_rows,
    incidence_times,
    inverse_rows,
    mesh_rows,
    moment_rows,
    timing_rows,
)

from phongbench.results.records import Records
from phongbench.results.schema import MESHES, RAW, TABLES, UNSAID


@dataclass(frozen=True)
class MadeUpRun:
    """Same attributes as phongbench.results.runs.Run."""

    path: Path
    manifest: dict[str, Any]
    accuracy: pd.DataFrame
    timing: pd.DataFrame
    worst: pd.DataFrame
    meshes: pd.DataFrame = field(default_factory=MESHES.frame)
    behaviour: pd.DataFrame = field(default_factory=pd.DataFrame)
    smoothness: pd.DataFrame = field(default_factory=pd.DataFrame)
    moments: pd.DataFrame = field(default_factory=TABLES["moments"].frame)
    cuts: pd.DataFrame = field(default_factory=TABLES["cuts"].frame)
    incidence: pd.DataFrame = field(default_factory=TABLES["incidence"].frame)
    incidence_times: pd.DataFrame = field(default_factory=TABLES["incidence_times"].frame)
    inverse: pd.DataFrame = field(default_factory=TABLES["inverse"].frame)
    scenes: pd.DataFrame = field(default_factory=TABLES["scenes"].frame)
    skips: pd.DataFrame = field(default_factory=TABLES["skips"].frame)
    scene_times: pd.DataFrame = field(default_factory=TABLES["scene_times"].frame)
    far: pd.DataFrame = field(default_factory=TABLES["far"].frame)
    costs: pd.DataFrame = field(default_factory=lambda: cost_rows("gcn4", "rdna2"))

    @property
    def frames(self) -> tuple[pd.DataFrame, ...]:
        """All tables, in the order of the fields."""
        first = self.accuracy, self.timing, self.worst, self.meshes, self.behaviour, self.smoothness
        return *first, self.moments, self.cuts, self.incidence, self.incidence_times, self.inverse

    def records(self, name: str) -> Records:
        """As of a stored run."""
        return Records.of(getattr(self, name))


def categories(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows, their text as categories."""
    strings = [name for name in rows.columns if isinstance(rows[name].dtype, pd.StringDtype)]
    return rows.astype(dict.fromkeys(strings, "category"))


def make_run(
    path: Path,
    *,
    name: str = "20250101-120000-0123abcd",
    alphas: tuple[float, ...] = (10.0, 20.0, 50.0, 128.0, 200.0),
    gammas: tuple[int, ...] = (2, 4, 8, 16, 32, 64),
    precisions: tuple[str, ...] = ("float32", "float16"),
) -> MadeUpRun:
    rows = [row for cell in cells(alphas, gammas) for precision in precisions for row in rows_of(cell, precision)]
    accuracy = pd.DataFrame(rows).assign(**RAW, **UNSAID["accuracy"]).astype({"gamma": "Int64", "beta": "float64"})
    timing = timing_rows(accuracy).assign(**RAW).astype({"gamma": "Int64"})
    provenance = {
        "python": "3.11.7",
        "numpy": "2.4.6",
        "cpu": {"model": "Example CPU", "cores": 2},
        "command": "phongbench run",
    }
    manifest = {
        "schema": 1,
        "run": name,
        "state": "complete",
        "seed": 20250101,
        "code": "abc123",
        "provenance": provenance,
        "plan": {"alphas": list(alphas), "samples": 131072, "preset": "quick"},
        "files": {},
    }
    made = (worst_rows(accuracy), mesh_rows(accuracy), behaviour_rows(accuracy), smoothness_rows(accuracy))
    tables = (table.assign(**RAW) for table in made)
    lobes = (moment_rows(alphas, gammas), cut_rows(gammas))
    return MadeUpRun(
        path, manifest, accuracy, timing, *tables, *lobes, incidence_rows(), incidence_times(), inverse_rows(alphas)
    )
