"""A real browser on real servers: one without runs, one with a run whose times are made up."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from visits import Visit, Window

from phongbench.accuracy import sweep, tables
from phongbench.inputs.plan import preset
from phongbench.results import runs as results
from phongbench.results.provenance import fingerprint_machine
from phongbench.results.schema import RAW, TIMING

RUN = "20260101-000000-0123abcd"
#: older runs beside it: its kernels slower by a quarter, and another machine's
SLOWER, ELSEWHERE = "20251231-000000-0123abcd", "20251230-000000-0123abcd"
#: what chromium is called on today's systems
NAMES = ("chromium", "chromium-browser", "google-chrome")
#: what the browser itself notes where the service is busy: the page asks again, so on a slow machine it is no error
BUSY = "status of 503"
#: windows that are kept for the visits of other tests
KEPT = 3


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """A headless Chromium of the system; without one these tests are skipped, but not where CI is set."""
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        what = f"no browser here ({', '.join(NAMES)}): the explorer page is not tested"
        if os.environ.get("CI"):
            pytest.fail(f"{what}; CI must install one", pytrace=False)
        pytest.skip(what)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        # A container's root cannot set up Chromium's own sandbox, and its /dev/shm is small; the only page is ours.
        # Shaders are run by the browser's own software: no machine of ours has a graphics card.
        software = ["--enable-unsafe-swiftshader", "--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"]
        opened = playwright.chromium.launch(
            executable_path=found, args=["--no-sandbox", "--disable-dev-shm-usage", *software]
        )
        yield opened
        opened.close()


def _server(runs: Path, log: Path) -> tuple["subprocess.Popen[str]", str]:
    """A server of its own process, warm, and its address."""
    command = [sys.executable, "-m", "phongbench", "serve", "--port", "0", "--runs", str(runs)]
    with log.open("w") as stderr:
        process = subprocess.Popen([*command], stderr=subprocess.PIPE, text=True)
        assert process.stderr
        for line in process.stderr:
            stderr.write(line)
            if "serves " in line:
                url = line.split("serves ")[1].split(" ")[0].rstrip("/")
            if "ready" in line:
                return process, url
    raise AssertionError(f"the server ended before it was ready: {log.read_text()}")


def _stop(process: "subprocess.Popen[str]") -> None:
    process.terminate()
    process.wait(600)
    if process.stderr:
        process.stderr.close()


@pytest.fixture(scope="session")
def empty_server(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a server without runs."""
    folder = tmp_path_factory.mktemp("empty")
    process, url = _server(folder / "phongbench-runs", folder / "log")
    yield url
    _stop(process)


@pytest.fixture(scope="session")
def server(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a server with a run, and two older ones of the same errors."""
    folder = tmp_path_factory.mktemp("served")
    _runs(folder / "phongbench-runs")
    process, url = _server(folder / "phongbench-runs", folder / "log")
    yield url
    _stop(process)


def _runs(root: Path) -> None:
    """Real errors, made-up times: more squarings and the cross form cost, and wide intervals leave some unresolved."""
    plan = replace(
        preset("quick"),
        alphas=(10.0, 50.0),
        gammas=(4, 8, 16),
        approximations=("phong", "lyon", "gaussian"),
        slopes=("taylor", "minimax"),
        spaces=("reflect",),
        precisions=("float16", "float32"),
        samples=2000,
        timing=False,
        probes=(),
    ).validated()
    prepared = sweep.prepare(plan)
    sweep.compile_kernels(prepared)
    accuracy = tables.accuracy(prepared, [tables.part(list(sweep.run(prepared, jobs=2)))])
    kernel = ["approximation", "lambda_form", "space", "gamma"]
    timing = (
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
    form = timing["lambda_form"].map({"dot": 0.0, "difference": 0.03, "cross": 0.1, "none": 0.7})
    timing["ratio"] = 0.3 + form + 0.02 * np.log2(timing["gamma"].astype("Float64").fillna(32.0)).astype(float)
    twin = timing.iloc[:1].assign(approximation="aa-twin", ratio=1.0)
    timing = pd.concat([timing, twin], ignore_index=True)
    half = np.where(timing["lambda_form"] == "difference", 0.12, 0.005)
    timing["ratio_low"], timing["ratio_high"] = timing["ratio"] * (1 - half), timing["ratio"] * (1 + half)
    timing["ns_min"] = timing["ns_median"] = 0.6 * timing["ratio"]
    here = fingerprint_machine()
    for name, factor, machine in ((RUN, 1.0, here), (SLOWER, 1.25, here), (ELSEWHERE, 1.25, "0" * 16)):
        folder = root / name
        folder.mkdir(parents=True)
        times = timing[TIMING.required].copy()
        times.loc[times["approximation"] != "phong", ["ratio", "ratio_low", "ratio_high"]] *= factor
        stored = {"accuracy": accuracy, "timing": times}
        files = {f"{table}.parquet": results.write_table(folder, table, frame) for table, frame in stored.items()}
        told = {"schema": results.SCHEMA, "run": name, "state": "complete", "plan": plan.as_dict(), "seed": 1}
        provenance = {"machine_fingerprint": machine}
        results.write_manifest(folder, {**told, "code": "0", "provenance": provenance, "files": files})


@pytest.fixture(scope="session")
def windows() -> list[Window]:
    """Those that nobody uses: there a page takes half of what it takes in a new one, which is a process that starts."""
    return []


@pytest.fixture
def visit(browser: Any, windows: list[Window]) -> Iterator[Callable[..., Visit]]:
    """A factory of visits: (address, context options ...). At the end nothing may have gone wrong on any of them.

    Give options to a visit that changes what the next one in its window would see, such as emulated media: it then has
    a window of its own.
    """
    used: list[Window] = []
    alone: list[Window] = []

    def make(address: str, *, wait: bool = True, **options: Any) -> Visit:
        window = windows.pop() if windows and not options else Window.opened(browser, options)
        (alone if options else used).append(window)
        made = window.load(address)
        if wait:
            made.idle()
        return made

    yield make
    try:
        for one in [window.seen for window in (*used, *alone) if window.seen]:
            assert one.reports() == []
            assert one.foreign == []
            assert [error for error in one.errors if BUSY not in error] == []
        windows += [window.leave() for window in used[: KEPT - len(windows)]]
    finally:
        for window in (*used, *alone):
            if window not in windows:
                window.page.context.close()
