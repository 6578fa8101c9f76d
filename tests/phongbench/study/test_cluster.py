"""The sweep on a cluster: real schedulers and workers on loopback, killed and foreign ones; the rows stay."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from phongbench.analysis.summary import summarise
from phongbench.errors import InputError
from phongbench.inputs.plan import Plan, preset
from phongbench.results import runs
from phongbench.study import run as study
from phongbench.study.cluster.engine import Cluster
from phongbench.support.progress import Progress


@pytest.fixture(scope="module")
def plan() -> Plan:
    """Batches of two slabs each, so that shards share some."""
    return replace(
        preset("quick"),
        alphas=(10.0,),
        gammas=(8,),
        approximations=("phong", "lyon"),
        slopes=("taylor",),
        spaces=("reflect",),
        lambda_forms=("dot",),
        probes=(),
        precisions=("float32",),
        samples=300_000,
        timing=False,
    ).validated()


@pytest.fixture(scope="module")
def whole(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> runs.Run:
    """The run of one machine."""
    return study.run_study(plan, tmp_path_factory.mktemp("whole") / "run").run


def _process(*words: str, **more: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-m", "distributed.cli.dask_" + words[0], *words[1:], "--no-dashboard"],
        env={**os.environ, **more},
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE if words[0] == "scheduler" else subprocess.DEVNULL,
        text=True,
    )


def _kill(process: "subprocess.Popen[str]") -> None:
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


@contextmanager
def cluster(folder: Path, workers: int, **more: str) -> Iterator[tuple[str, list["subprocess.Popen[str]"]]]:
    """A scheduler and workers; its address and the processes, the scheduler first."""
    processes = [_process("scheduler", "--host", "127.0.0.1", "--port", "0")]
    try:
        said = processes[0].stderr
        assert said
        address = next(words[0] for line in said if (words := re.findall(r"tcp://127\.0\.0\.1:[0-9]+", line)))
        words = (address, "--nthreads", "1", "--no-nanny", "--local-directory")
        processes += [_process("worker", *words, str(folder / f"w{n}"), **more) for n in range(workers)]
        yield address, processes
    finally:
        for process in processes:
            _kill(process)
            if process.stderr:
                process.stderr.close()


class Kill(Progress):
    """Kills a process when the sweep has gone so far."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self.process, self.steps = process, 0.0

    def advance(self, steps: float = 1) -> None:
        self.steps += steps if steps > 1 else 0
        if self.steps:
            _kill(self.process)


def _same(found: runs.Run, whole: runs.Run) -> None:
    for table in ("accuracy", "worst"):
        pd.testing.assert_frame_equal(getattr(found, table), getattr(whole, table), check_exact=True)


def test_two_workers_one_killed_give_the_rows_of_one_machine(plan: Plan, whole: runs.Run, tmp_path: Path) -> None:
    with cluster(tmp_path, 2) as (address, processes):
        found = study.run_study(plan, tmp_path / "run", engine=Cluster(address), progress=Kill(processes[2])).run
    _same(found, whole)
    assert found.manifest["cluster"]["shards"] > 1


def test_a_worker_with_other_arithmetic_is_refused_by_name(plan: Plan, tmp_path: Path) -> None:
    with cluster(tmp_path, 1, NUMBA_CPU_NAME="x86-64", NUMBA_CPU_FEATURES="") as (address, _):
        refused = pytest.raises(InputError, match=r"tcp://.*would not give this machine's bits: cpu x86-64 instead of")
        with refused:
            study.run_study(plan, tmp_path / "run", engine=Cluster(address))


def test_two_processes_here_are_compared_with_each_other(plan: Plan, whole: runs.Run, tmp_path: Path) -> None:
    found = study.run_study(plan, tmp_path / "run", engine=Cluster("local:2")).run
    _same(found, whole)
    assert found.manifest["cluster"]["workers"] == 2
    assert found.manifest["cluster"]["compared"] >= 1
    told = summarise(found)["facts"]["swept"]
    assert re.fullmatch(r"in \d+ shards by 2 workers; [1-9]\d* measured again by another, the same bits", told)


@pytest.mark.parametrize("address", ["", "local:0", "local:x", "no such file", "http://x:1", "local:-1"])
def test_what_is_no_cluster_is_refused(address: str) -> None:
    with pytest.raises(InputError, match="is no cluster"):
        Cluster(address)
