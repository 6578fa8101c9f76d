"""Shared studies: real sweeps of the real engine, small enough to be made once for a session."""

import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import mpmath
import pandas as pd
import pytest

from phongbench.accuracy import sweep, tables
from phongbench.formulas.exact import phong_of_angle, product
from phongbench.inputs.plan import Plan, preset
from phongbench.results import runs
from phongbench.results.schema import RAW, TIMING
from phongbench.scenes.scene import Scene
from phongbench.scenes.scene_files import read_scene


def _swept(plan: Plan, jobs: int = 2) -> pd.DataFrame:
    """The accuracy rows of a plan."""
    prepared = sweep.prepare(plan)
    sweep.compile_kernels(prepared)
    return tables.accuracy(prepared, [tables.part(list(sweep.run(prepared, jobs=jobs)))])


@pytest.fixture(scope="session")
def small_plan() -> Plan:
    """All strata, two precisions, few formulas, few pairs; the sweep alone."""
    return replace(
        preset("quick"),
        alphas=(10.0, 50.0),
        gammas=(4, 8),
        approximations=("phong", "lyon", "gaussian"),
        slopes=("taylor",),
        precisions=("float16", "float32"),
        samples=6000,
        timing=False,
        probes=(),
    ).validated()


@pytest.fixture(scope="session")
def small_rows(small_plan: Plan, once: Callable[..., pd.DataFrame]) -> pd.DataFrame:
    """The rows of `small_plan`."""
    return once("small_rows", lambda: _swept(small_plan))


@pytest.fixture(scope="session")
def law_rows(once: Callable[..., pd.DataFrame]) -> pd.DataFrame:
    """Lyon on unit and on wrongly scaled vectors in float64, over the quick preset's exponents.

    What the laws speak about.
    """
    plan = replace(
        preset("quick"),
        approximations=("phong", "lyon", "gaussian"),
        slopes=("taylor", "minimax"),
        precisions=("float64",),
        spaces=("reflect",),
        lambda_forms=("dot", "difference", "cross", "tan2"),
        strata=("highlight", "lengths"),
        samples=1 << 14,
        timing=False,
        raw=(),
    ).validated()
    return once("law_rows", lambda: _swept(plan))


@pytest.fixture(scope="session")
def swept() -> Callable[..., pd.DataFrame]:
    """The accuracy rows of a plan, by (plan, jobs=2)."""
    return _swept


class ColdStart(NamedTuple):
    """A kernel cache that was empty before the second process of a study compiled into it.

    plan         that it compiled for
    environment  of processes that use it
    names        of the functions that were compiled
    """

    plan: Plan
    environment: dict[str, str]
    names: set[str]


#: the processor that most of today's have in common, by LLVM's name
OLDER = "x86-64-v3"


@pytest.fixture(scope="session")
def cold_start(common_folder: Path, once: Callable[..., Any]) -> ColdStart:
    """Made once: it takes twenty seconds. On x86 it is for OLDER, so that a study for that one finds its drivers."""
    plan = replace(
        preset("quick"),
        approximations=("phong",),
        alphas=(10.0,),
        strata=("highlight",),
        probes=(),
        spaces=("reflect",),
        raw=("phong/each",),
        precisions=("float32",),
        samples=1000,
    ).validated()
    cache = common_folder / "cold-start"
    pinned = {"NUMBA_CPU_NAME": OLDER, "NUMBA_CPU_FEATURES": ""} if platform.machine() == "x86_64" else {}

    def compiled() -> set[str]:
        command, given = [sys.executable, "-m", "phongbench.study.precompile"], json.dumps(plan.as_dict()).encode()
        environment = {**os.environ, **pinned, "PHONGBENCH_CACHE": str(cache)}
        subprocess.run(command, input=given, env=environment, check=True, capture_output=True)
        return {path.name.split("-")[0] for path in cache.rglob("*.nbi")}

    return ColdStart(plan, {**os.environ, "PHONGBENCH_CACHE": str(cache)}, once("cold-start", compiled))


def timing_of(accuracy: pd.DataFrame, ratio: Callable[[Any], float]) -> pd.DataFrame:
    """Made-up timing rows for every kernel of some accuracy rows: one working set, intervals of 1 %."""
    kernel = ["approximation", "lambda_form", "space", "gamma", *RAW]
    rows = (
        accuracy[kernel]
        .drop_duplicates()
        .assign(
            beta_policy="none",
            precision="float32",
            working_set="l1",
            elements=1024,
            threads=1,
            verdict="unresolved",
            dot_ratio=1.0,
            bandwidth_fraction=0.5,
            rounds=24,
            contaminated=0,
            **RAW,
        )
    )
    rows["ratio"] = [ratio(row) for row in rows.itertuples()]
    twin = rows.iloc[:1].assign(approximation="aa-twin", ratio=1.0)
    rows = pd.concat([rows, twin], ignore_index=True)
    rows["ratio_low"], rows["ratio_high"] = 0.99 * rows["ratio"], 1.01 * rows["ratio"]
    rows["ns_min"] = rows["ns_median"] = 0.6 * rows["ratio"]
    return rows[TIMING.required]


def usual_ratio(row: Any) -> float:
    """Plausible times: squarings and crosses cost, exponentials cost more."""
    form = {"dot": 0.0, "difference": 0.05, "cross": 0.1, "none": 0.0}[row.lambda_form]
    name = {"phong": 1.0, "gaussian": 0.5}.get(row.approximation, 0.2)
    return name + form + (0.0 if pd.isna(row.gamma) else 0.02 * float(row.gamma) / 4)


@pytest.fixture
def stored(small_plan: Plan, small_rows: pd.DataFrame, tmp_path: Path) -> Callable[..., runs.Run]:
    """A factory of stored runs: (name, accuracy=.., ratio=.., timed=True) in tmp_path/phongbench-runs."""

    def store(
        name: str = "20260101-000000-0123abcd",
        *,
        accuracy: pd.DataFrame = small_rows,
        ratio: Callable[[Any], float] = usual_ratio,
        timed: bool = True,
        **manifest: Any,
    ) -> runs.Run:
        folder = tmp_path / "phongbench-runs" / name
        folder.mkdir(parents=True)
        tables = {"accuracy": accuracy} | ({"timing": timing_of(accuracy, ratio)} if timed else {})
        files = {f"{table}.parquet": runs.write_table(folder, table, frame) for table, frame in tables.items()}
        runs.write_manifest(
            folder,
            {
                "schema": runs.SCHEMA,
                "run": name,
                "state": "complete",
                "plan": small_plan.as_dict(),
                "seed": 1,
                "code": "0",
                "provenance": {},
                "files": files,
            }
            | manifest,
        )
        return runs.load(folder)

    return store


@pytest.fixture(scope="session")
def exact_angle() -> Callable[..., Any]:
    """Phong of the true angle between two vectors as they are in float64, at 50 digits: (a, b, alpha, half_space).

    NaN where an angle is undefined: a zero, infinite or NaN vector.
    """

    def exact(a: Any, b: Any, alpha: float, half_space: bool = False) -> Any:
        with mpmath.workdps(50):
            u, v = [mpmath.mpf(float(c)) for c in a], [mpmath.mpf(float(c)) for c in b]
            lengths = product(u, u), product(v, v)
            if not all(mpmath.isfinite(length) and length > 0 for length in lengths):
                return mpmath.nan
            return phong_of_angle(u, v, alpha, half_space)

    return exact


#: a scene that each test changes: what it says about `camera` and so on stands in tables of that name
SMALL = """
ambient_light = [0.2, 0.2, 0.2]
background = [0.1, 0.2, 0.3]

[picture]
size = [48, 32]
depth = 2

[camera]
position = [0.0, 1.0, 5.0]
target = [0.0, 0.5, 0.0]

[materials.white]
diffuse = [0.8, 0.8, 0.8]
specular = [0.5, 0.5, 0.5]
shininess = 20

[materials.mirror]
diffuse = [0.1, 0.1, 0.2]
specular = [0.9, 0.9, 0.9]
shininess = 100
reflectivity = 0.6

[materials.board]
chequerboard = ["white", "mirror"]
side = 0.5

[[lights]]
direction = [-1.0, 2.0, 1.0]

[[lights]]
position = [1.0, 2.0, 2.0]
colour = [1.0, 0.5, 0.2]
attenuation = [0.5, 0.2, 0.1]
reach = 20

[[objects]]
shape = "sphere"
centre = [0.0, 0.8, 0.0]
radius = 0.8
material = "mirror"

[[objects]]
shape = "plane"
material = "board"
"""


@pytest.fixture
def small() -> str:
    """The text of a scene with a mirror ball over a chequerboard."""
    return SMALL


@pytest.fixture
def written(tmp_path: Path) -> Callable[[str], Scene]:
    """Reads a scene from a text, by way of a file named scene.toml."""

    def read(text: str) -> Scene:
        path = tmp_path / "scene.toml"
        path.write_text(text)
        return read_scene(path)

    return read


@pytest.fixture
def own(tmp_path: Path) -> Callable[..., Path]:
    """A user's file with Lyon's formula under another name, by (name, and what of its text is replaced by what)."""
    ours = Path(sys.modules["phongbench.formulas.approximations.lyon"].__file__ or "").read_text()

    def write(name: str, old: str = "", new: str = "") -> Path:
        assert old in ours
        path = tmp_path / f"{name}.py"
        path.write_text(ours.replace('name="lyon"', f'name="{name}"').replace(old, new, 1 if old else 0))
        return path

    return write
