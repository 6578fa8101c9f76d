"""The sweep on a cluster: real schedulers and workers on loopback, killed, slow, starved and foreign; the rows stay."""

import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from distributed import Client
from soaking.dask_processes import Process, Processes, kill, processes, wait_until

import phongbench
from phongbench.accuracy import sweep, tables
from phongbench.analysis.summary import summarise
from phongbench.cli.main import EXIT_CODES, main
from phongbench.errors import InputError, MeasurementError
from phongbench.formulas.formula import Formula
from phongbench.formulas.user_files import registry_with
from phongbench.inputs.plan import Plan
from phongbench.results import runs
from phongbench.scenes.render import Rendered, render
from phongbench.scenes.scene import Scene
from phongbench.study import run as study
from phongbench.study.cluster import pictures, work
from phongbench.study.cluster.connection import connected
from phongbench.study.cluster.engine import Cluster
from phongbench.study.cluster.pictures import PictureCluster
from phongbench.study.cluster.worker import Tally
from phongbench.support.progress import Progress

#: a program that measures the plan in a file, and writes down at once what it has
CLIENT = """
import pickle, sys
from pathlib import Path
from phongbench.study import run, sweep_parts
from phongbench.study.cluster.connection import connected
from phongbench.study.cluster.engine import Cluster
sweep_parts.CHECKPOINT_SECONDS = 0.0
run.run_study(pickle.loads(Path("plan").read_bytes()), Path("run"), engine=Cluster(sys.argv[1]))
"""


@pytest.fixture(scope="module")
def plan(tiny: Callable[..., Plan]) -> Plan:
    """Batches of two slabs each, so that shards share some."""
    return tiny(samples=300_000)


@pytest.fixture(scope="module")
def whole(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> runs.Run:
    """The run of one machine."""
    return study.run_study(plan, tmp_path_factory.mktemp("whole") / "run").run


@pytest.fixture(scope="module")
def standing(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Processes]:
    """A cluster with a worker that nobody harms."""
    with processes(tmp_path_factory.mktemp("cluster")) as found:
        yield found


@pytest.fixture
def second(standing: Processes) -> Iterator[Process]:
    """Another worker of it."""
    process = standing.worker()
    yield process
    kill(process)


class Listener(Progress):
    """Acts when the first shard is there and when nothing more comes, and remembers what it is told."""

    def __init__(self, first: Callable[[], object] = int, idle: Callable[[], object] = int) -> None:
        self.first, self.idle, self.waits = first, idle, 0
        self.notes: list[str] = []
        self.told: list[str] = []
        self.held: set[object] = set()

    def advance(self, steps: float = 1) -> None:
        self.waits += steps == 0
        if steps > 1:
            first, self.first, self.waits = self.first, int, 0
            first()
        if self.waits == 4:  # each a second in which no shard came
            self.idle()

    def status(self, text: str) -> None:
        self.told.append(text)

    def note(self, text: str) -> None:
        self.notes.append(text)


def _same(found: runs.Run, whole: runs.Run) -> None:
    for table in ("accuracy", "worst"):
        pd.testing.assert_frame_equal(getattr(found, table), getattr(whole, table), check_exact=True)


def test_a_killed_worker_is_told_and_others_do_its_work(
    plan: Plan, whole: runs.Run, standing: Processes, second: Process, tmp_path: Path
) -> None:
    progress = Listener(first=lambda: kill(second))
    found = study.run_study(plan, tmp_path / "run", engine=Cluster(standing.address), progress=progress).run
    _same(found, whole)
    shards = found.manifest["cluster"]["shards"]
    assert shards > 1
    assert [re.match(r"(\d+) of (\d+) shards, \d workers?", text)[0] for text in progress.told] == progress.told  # type: ignore[index]
    assert progress.told[-1].startswith(f"{shards} of {shards} shards, ")
    assert re.fullmatch(r"cluster: 2 workers, 2 threads; dashboard http://127\.0\.0\.1:\d+/status", progress.notes[0])
    assert re.fullmatch(rf"cluster: {shards} shards by \d workers?, [0-9.]+ billion evaluations/s", progress.notes[-1])


def test_answers_that_die_with_their_worker_are_measured_again(
    plan: Plan, whole: runs.Run, standing: Processes, second: Process, tmp_path: Path
) -> None:
    address, other, end = standing.addresses()[-1], standing.workers[0], time.monotonic() + 120.0

    class Late(Listener):
        """Kills a worker when its answers are there and not gathered yet; until then the other does nothing."""

        def advance(self, steps: float = 1) -> None:
            if steps:
                return
            if second.poll() is not None or time.monotonic() > end:
                os.killpg(other.pid, signal.SIGCONT)
            elif self.held & {*client.has_what()[address]}:
                removed = standing.log.read_text().count("Remove worker")
                kill(second)
                wait_until(lambda: standing.log.read_text().count("Remove worker") > removed, standing.scheduler)
                time.sleep(0.5)  # until the client knows that they are lost
            else:
                soon = time.monotonic() + 2.0
                while len(client.has_what()[address]) < 2 and time.monotonic() < soon:
                    time.sleep(0.1)
                time.sleep(0.5)  # until the client knows that they are there
                self.held = {*client.has_what()[address]}

    os.killpg(other.pid, signal.SIGSTOP)
    try:
        with Client(standing.address, set_as_default=False) as client:  # type: ignore[no-untyped-call]
            found = study.run_study(plan, tmp_path / "run", engine=Cluster(standing.address), progress=Late()).run
    finally:
        os.killpg(other.pid, signal.SIGCONT)
    _same(found, whole)
    assert "already computed task(s), which will be recomputed" in standing.said()


def test_a_slow_worker_is_waited_for_while_others_go_on(
    plan: Plan, whole: runs.Run, standing: Processes, second: Process, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop() -> None:
        time.sleep(1.0)  # it holds answers by then
        os.killpg(second.pid, signal.SIGSTOP)

    monkeypatch.setattr(work, "PATIENCE", 0.5)
    progress = Listener(first=stop, idle=lambda: os.killpg(second.pid, signal.SIGCONT))
    found = study.run_study(plan, tmp_path / "run", engine=Cluster(standing.address), progress=progress).run
    _same(found, whole)


def test_a_piece_that_says_it_ran_out_of_time_has_failed(standing: Processes) -> None:
    def late(_job: object, _piece: object) -> Tally:
        raise TimeoutError("late")

    with connected(standing.address, 1, fix="mend it", progress=Progress()) as connection:
        tried = work.Work(connection, late, None, [0], seed=1, progress=Progress())
        assert list(tried.answers()) == []
        with pytest.raises(
            MeasurementError, match="1 of 1 shards failed as often as they may; shard 1: TimeoutError: late"
        ):
            tried.raise_failures()


def test_a_worker_that_runs_out_of_memory_is_replaced_and_others_do_its_work(
    plan: Plan, whole: runs.Run, standing: Processes, tmp_path: Path
) -> None:
    starved = standing.worker("--memory-limit", "200MiB")
    try:
        found = study.run_study(plan, tmp_path / "run", engine=Cluster(standing.address)).run
        wait_until(lambda: "exceeded 95% memory budget" in standing.said(), starved)
    finally:
        kill(starved)
    _same(found, whole)


@pytest.mark.parametrize("foreign", ["code", "processor"])
def test_a_late_worker_whose_rows_could_differ_is_refused_by_name(
    plan: Plan, whole: runs.Run, standing: Processes, tmp_path: Path, foreign: str
) -> None:
    environment = {"NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": ""}
    if foreign == "code":
        package = shutil.copytree(Path(phongbench.__file__).parent, tmp_path / "other" / "phongbench")
        with (package / "errors.py").open("a") as file:
            file.write("# another edition\n")
        environment = {"PYTHONPATH": f"{package.parent}:{os.environ.get('PYTHONPATH', '')}"}
    late: list[Process] = []
    progress = Listener(first=lambda: late.append(standing.worker("--no-nanny", **environment)))
    differs = "cpu x86-64 instead of" if foreign == "processor" else "code [0-9a-f]+ instead of"
    try:
        with pytest.raises(InputError, match=f"tcp://.*would not give this machine's bits: {differs}"):
            study.run_study(plan, tmp_path / "run", engine=Cluster(standing.address), progress=progress)
    finally:
        for process in late:
            kill(process)
    _same(study.run_study(plan, tmp_path / "run", resume=True).run, whole)


def test_a_killed_client_goes_on(plan: Plan, whole: runs.Run, standing: Processes, tmp_path: Path) -> None:
    (tmp_path / "plan").write_bytes(pickle.dumps(plan))
    with (tmp_path / "log").open("wb") as log:
        command = [sys.executable, "-c", CLIENT, standing.address]
        client = subprocess.Popen(command, cwd=tmp_path, start_new_session=True, stdout=log, stderr=log)
    parts = tmp_path / "run" / "parts"
    wait_until(lambda: len(list(parts.glob("0*.parquet"))) > 0, client)
    kill(client)
    assert not runs.load(tmp_path / "run").complete, (tmp_path / "log").read_text()
    _same(study.run_study(plan, tmp_path / "run", resume=True, engine=Cluster(standing.address)).run, whole)


def test_a_lost_scheduler_is_told_and_the_run_goes_on(plan: Plan, whole: runs.Run, tmp_path: Path) -> None:
    with processes(tmp_path / "cluster") as lost:
        progress = Listener(first=lambda: kill(lost.scheduler))
        with pytest.raises(MeasurementError, match=r"the cluster is lost: its scheduler is gone\n.*--resume") as caught:
            study.run_study(plan, tmp_path / "run", engine=Cluster(lost.address), progress=progress)
    assert next(code for kind, code in EXIT_CODES if isinstance(caught.value, kind)) == 3
    kept = runs.load(tmp_path / "run")
    assert not kept.complete
    assert list((kept.path / "parts").glob("0*.parquet"))
    _same(study.run_study(plan, tmp_path / "run", resume=True).run, whole)


def test_a_process_that_has_not_met_dask_yet_hears_nothing_of_it_either() -> None:
    """Dask sets its levels when it is imported: a lost scheduler was told with Dask's traceback before our message."""
    program = "from logging import getLogger; from phongbench.study.cluster.connection import quieten; quieten();"
    program += "print([getLogger(name).level for name in ('distributed', 'distributed.client')])"
    told = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert told.stdout.split() == ["[50,", "50]"]


def test_a_worker_that_computes_otherwise_ends_the_run(
    plan: Plan, standing: Processes, second: Process, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Tally, "same", lambda *_: False)
    with pytest.raises(MeasurementError, match=r"tcp://\S+: shard \d+ of \d+ has other bits on tcp://"):
        study.run_study(plan, tmp_path / "run", engine=Cluster(standing.address))


def test_results_are_the_same_only_to_the_last_bit(plan: Plan) -> None:
    prepared = sweep.prepare(replace(plan, samples=1000))
    sweep.compile_kernels(prepared)
    (start, block), *_ = sweep.blocks(prepared, [(prepared.batches[0], 0)])
    part = tables.part([block])
    one = Tally("a", part, ((start, block),))
    assert one.same(Tally("b", part.copy(), ((start, deepcopy(block)),)))
    errors = deepcopy(block.errors)
    errors.sums[0, 0] = np.nextafter(errors.sums[0, 0], 1.0)
    changed = part.assign(rms=np.nextafter(part["rms"], 1.0))
    others = [(part, ((start, replace(block, errors=errors)),)), (part, ((start + 1, block),)), (part, ())]
    others += [(changed, one.blocks), (None, one.blocks)]
    assert [one.same(Tally("b", *other)) for other in others] == [False] * 5


def test_two_processes_here_are_compared_with_each_other(plan: Plan, whole: runs.Run, tmp_path: Path) -> None:
    found = study.run_study(plan, tmp_path / "run", engine=Cluster("local:2")).run
    _same(found, whole)
    assert found.manifest["cluster"]["workers"] == 2
    assert found.manifest["cluster"]["compared"] >= 1
    told = summarise(found)["facts"]["swept"]
    assert re.fullmatch(r"in \d+ shards by 2 workers; [1-9]\d* measured again by another, the same bits", told)


# pictures


def _drawn_alike(one: Rendered, other: Rendered) -> None:
    np.testing.assert_array_equal(one.picture.view(np.uint32), other.picture.view(np.uint32))
    assert (one.ledger, one.rays) == (other.ledger, other.rays)


def test_a_picture_of_a_cluster_has_the_bits_and_the_ledger_of_one_machine(
    standing: Processes, second: Process, own: Callable[..., Path], written: Callable[[str], Scene], small: str
) -> None:
    """Mirrors, by a formula of the user's; a worker dies meanwhile."""
    files = [own("mine")]
    registry = registry_with(files)
    given: dict[str, Any] = {"specular": Formula.parse("mine:dot:8", registry), "registry": registry, "tile": 24}
    scene = written(small)
    alone = render(scene, size=(160, 90), supersampling=2, **given)
    progress = Listener(first=lambda: kill(second))
    engine = PictureCluster(standing.address, files)
    drawn = render(scene, size=(160, 90), supersampling=2, engine=engine, progress=progress, **given)
    _drawn_alike(drawn, alone)
    assert progress.told[-1].startswith("32 of 32 parts, ")


def test_the_command_draws_on_a_cluster_and_refuses_to_time_there(
    standing: Processes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ["render", "torus", "--size", "160x90", "--out"]
    for name, more in (("alone", []), ("cluster", ["--cluster", standing.address])):
        found = CliRunner().invoke(main, [*words, str(tmp_path / f"{name}.npy"), *more])
        assert found.exit_code == 0, found.output
    np.testing.assert_array_equal(np.load(tmp_path / "cluster.npy"), np.load(tmp_path / "alone.npy"))
    found = CliRunner().invoke(main, ["render", "chequerboard", "--bench", "--cluster", standing.address])
    assert (found.exit_code, "leave --cluster away" in found.stderr) == (2, True)
    monkeypatch.setattr(pictures, "arithmetic", lambda: {"numba": "0.1"})
    found = CliRunner().invoke(main, [*words, str(tmp_path / "no.npy"), "--cluster", standing.address])
    assert (found.exit_code, "instead of 0.1" in found.stderr) == (2, True)


@pytest.mark.parametrize("address", ["", "local:0", "local:x", "no such file", "http://x:1", "local:-1"])
def test_what_is_no_cluster_is_refused(address: str) -> None:
    with pytest.raises(InputError, match="is no cluster"):
        Cluster(address)
