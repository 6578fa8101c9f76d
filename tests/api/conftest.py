"""One real run with made-up times and a drawn report, one warm application, and servers of their own process."""

import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import httpx2 as httpx
import numpy as np
import pandas as pd
import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient

from phongbench.accuracy import sweep, tables
from phongbench.inputs.plan import preset
from phongbench.results import runs as results
from phongbench.results.schema import RAW, TIMING
from phongbench_api.app import create_app
from phongbench_api.settings import Settings
from phongbench_reports import build

RUN, CORRUPT = "20260101-000000-0123abcd", "20251231-000000-0123abcd"


def _timing(accuracy: pd.DataFrame) -> pd.DataFrame:
    """Made-up times: a ratio for every kernel, intervals of 1 %."""
    kernel = ["approximation", "lambda_form", "space", "gamma", "recipe", "normalise"]
    told = (
        accuracy[kernel]
        .drop_duplicates()
        .reset_index(drop=True)
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
    told["ratio"] = np.where(told["approximation"] == "phong", 1.0, 0.2 + 0.01 * told.index)
    twin = told.iloc[:1].assign(approximation="aa-twin", ratio=1.0)
    told = pd.concat([told, twin], ignore_index=True)
    told["ratio_low"], told["ratio_high"] = 0.99 * told["ratio"], 1.01 * told["ratio"]
    told["ns_min"] = told["ns_median"] = 0.6 * told["ratio"]
    return told[TIMING.required]


def _store(folder: Path, tables: dict[str, pd.DataFrame], plan: dict[str, Any], **manifest: Any) -> None:
    folder.mkdir(parents=True)
    files = {f"{name}.parquet": results.write_table(folder, name, frame) for name, frame in tables.items()}
    basic = {"schema": results.SCHEMA, "run": folder.name, "state": "complete", "plan": plan, "seed": 1, "code": "0"}
    results.write_manifest(folder, {**basic, "provenance": {}, "files": files} | manifest)


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory, only_figures: Callable[..., AbstractContextManager[None]]) -> Path:
    """A folder with one good run, its report drawn, and one whose accuracy rows have a flipped byte."""
    root = tmp_path_factory.mktemp("service") / "phongbench-runs"
    plan = replace(
        preset("quick"),
        alphas=(10.0, 50.0),
        gammas=(4, 8),
        approximations=("phong", "lyon", "gaussian"),
        slopes=("taylor",),
        precisions=("float32",),
        samples=2000,
        timing=False,
        probes=(),
    ).validated()
    prepared = sweep.prepare(plan)
    sweep.compile_kernels(prepared)
    accuracy = tables.accuracy(prepared, [tables.part(list(sweep.run(prepared, jobs=2)))])
    stored = {"accuracy": accuracy, "timing": _timing(accuracy)}
    _store(root / RUN, stored, plan.as_dict())
    _store(root / CORRUPT, stored, plan.as_dict())
    with only_figures():
        build(results.load(root / RUN), root / RUN / "report")
    flipped = root / CORRUPT / "accuracy.parquet"
    data = bytearray(flipped.read_bytes())
    data[len(data) // 2] ^= 1
    flipped.write_bytes(data)
    return root


@pytest.fixture(scope="session")
def accuracy(runs: Path) -> pd.DataFrame:
    """The good run's rows, read by pandas: the oracle of the row endpoints."""
    return pd.read_parquet(runs / RUN / "accuracy.parquet")


def _warm(app: FastAPI) -> TestClient:
    client = TestClient(app, base_url="http://localhost")
    client.__enter__()
    for _ in range(600):
        if app.state.service.warm.wait(1):
            return client
        assert not client.task.done(), "the service ended before its kernels were warm"
    raise AssertionError("the kernels are not warm after ten minutes")


@pytest.fixture(scope="session")
def app(runs: Path) -> FastAPI:
    """The application over those runs."""
    return create_app(Settings(runs=runs))


@pytest.fixture(scope="session")
def client(app: FastAPI) -> Iterator[TestClient]:
    """A client of it, its kernels warm; what the application raises is a 500 to it, as it is to everyone."""
    client = _warm(app)
    client.app = app
    yield client
    client.__exit__(None, None, None)


@pytest.fixture(scope="session")
def client_of(client: TestClient, runs: Path) -> Callable[..., TestClient]:
    """A factory of clients of applications with other settings; they share the kernels that are warm already."""

    def make(**settings: Any) -> TestClient:
        app = create_app(replace(Settings(runs=runs), **settings))
        app.state.service.kernels = client.app.state.service.kernels  # type: ignore[attr-defined]
        app.state.service.admission.open = True
        return TestClient(app, base_url="http://localhost")

    return make


@dataclass
class Server:
    """A server in a process of its own."""

    process: "subprocess.Popen[str]"
    url: str

    def stop(self, number: int = signal.SIGTERM) -> int:
        """Send the signal; the exit code."""
        self.process.send_signal(number)
        return self.process.wait(600)


@contextmanager
def servers(runs: Path, folder: Path) -> Iterator[Callable[..., Server]]:
    """A factory of servers: options of `phongbench serve` and other settings; they are warm when it returns."""
    started: list[subprocess.Popen[str]] = []

    def start(*options: str, **settings: Any) -> Server:
        command = [sys.executable, "-m", "phongbench", "serve", "--port", "0", "--runs", str(runs), *options]
        if settings:  # what the command has no option for
            told = f"Settings(port=0, runs=Path({str(runs)!r}), **{settings!r})"
            code = f"from pathlib import Path; from phongbench_api.serve import Settings, serve; serve({told})"
            command = [sys.executable, "-c", code]
        process = subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True)
        started.append(process)
        assert process.stderr
        url = process.stderr.readline().split("serves ")[1].split(" ")[0].rstrip("/")
        while "ready" not in (line := process.stderr.readline()):
            assert line, "the server ended before it was ready"
        return Server(process, url)

    try:
        yield start
    finally:
        for process in started:
            process.kill()
            process.wait()
            if process.stderr:
                process.stderr.close()


@pytest.fixture
def serve(runs: Path, tmp_path: Path) -> Iterator[Callable[..., Server]]:
    """A factory of servers, as `servers`."""
    with servers(runs, tmp_path) as start:
        yield start


@pytest.fixture(scope="session")
def copied(runs: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[], Path]:
    """A factory of copies of the runs, to be spoiled."""
    return lambda: Path(shutil.copytree(runs, tmp_path_factory.mktemp("copy") / "runs"))


@pytest.fixture(scope="session")
def server(runs: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server in a process of its own, as it comes; nobody stops it."""
    with servers(runs, tmp_path_factory.mktemp("live")) as start:
        yield start()


@pytest.fixture(scope="session")
def live(server: Server) -> Iterator[httpx.Client]:
    """A client of that server."""
    with httpx.Client(base_url=server.url, timeout=600) as client:
        yield client
