"""The comparison with other tools: the same values, honest absences, and a table whatever is installed."""

import itertools
import shutil
from importlib.util import find_spec
from typing import Any

import numpy as np
import pytest

from phongbench.benchmarks import kernel_bench as bench_module
from phongbench.benchmarks import kernel_peers
from phongbench.benchmarks.kernel_bench import OURS, TOLERANCE, TWIN, Entrant, bench
from phongbench.benchmarks.kernel_peers import (
    ALL_WORKS,
    ALPHA,
    BETA,
    CROSS,
    GAMMA,
    GAUSSIAN,
    LYON,
    PEERS,
    PHONG,
    WORKS,
    Peer,
)
from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32
from phongbench.errors import InputError, UnknownNameError
from phongbench.inputs import pairs
from phongbench.inputs.strata import STRATA
from phongbench.timing.statistics import MIN_ROUNDS

compiled_only = pytest.mark.skipif(jit.DISABLED, reason="plain Python is not timed")
SWEEP = {"evaluations_per_second": 1e9, "numpy_evaluations_per_second": 1e7, "ratio": 100.0}


@pytest.fixture
def vectors() -> tuple[Any, Any, Any]:
    highlight = next(s for s in STRATA if s.name == "highlight")
    a, b = pairs.pairs(highlight, FLOAT32, seed=1, start=0, count=4096, scale=1 / ALPHA)
    b[:, :7] = -a[:, :7]  # behind: the term is exactly 0
    return a, b, np.empty(a.shape[1], np.float32)


@pytest.fixture
def quiet_lock(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A lock of this test's own: another timing on this machine must not fail it."""
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))


@pytest.mark.filterwarnings("ignore")  # other projects' warnings are theirs
@pytest.mark.parametrize("name", PEERS)
def test_a_peer_computes_the_same_values(name: str, vectors: tuple[Any, Any, Any]) -> None:
    if name != "c" and find_spec(name) is None:
        pytest.skip(f"{name} is not installed")
    peer = kernel_peers.prepared(name, *vectors)
    if isinstance(peer, str):
        pytest.skip(peer)
    a, b, _ = vectors
    x = (a.astype(np.float64) * b).sum(axis=0)
    across = np.cross(a.astype(np.float64), b, axis=0)
    exact = {
        PHONG: np.maximum(x, 0) ** ALPHA,
        LYON: np.maximum(1 - BETA * (1 - x), 0) ** GAMMA,
        GAUSSIAN: np.where(x > 0, np.exp(-ALPHA * (1 - x)), 0),
        CROSS: np.where(x > 0, np.maximum(1 - BETA * (across**2).sum(axis=0) / 2, 0) ** GAMMA, 0),
    }
    assert set(WORKS) <= set(peer.passes)
    for work in peer.passes:
        for _ in range(2):  # a pass leaves nothing behind that changes the next
            values = np.asarray(peer.passes[work]())
            assert values.dtype == np.float32
            assert np.abs(values - exact[work]).max() <= TOLERANCE
            assert not values[:7].any()


def test_a_peer_that_is_missing_is_said_to_be_absent(
    vectors: tuple[Any, Any, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    problems = iter(
        [
            ModuleNotFoundError("No module named 'jax'", name="jax"),
            ModuleNotFoundError("No module named 'jaxlib'", name="jaxlib"),
            RuntimeError("no processor\nat all"),
        ]
    )

    def missing(name: str) -> Any:
        raise next(problems)

    monkeypatch.setattr(kernel_peers, "import_module", missing)
    told = [kernel_peers.prepared("jax", *vectors) for _ in range(3)]
    assert told[0] == "not installed; pip install jax brings it"
    assert "jaxlib" in str(told[1])
    assert told[2] == "cannot be used here: no processor"


def test_unknown_peers_list_the_known_ones() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'numpy'"):
        kernel_peers.chosen(("nunpy",))
    assert kernel_peers.chosen(None) == tuple(PEERS)
    assert kernel_peers.chosen(("jax", "numpy", "jax")) == ("jax", "numpy")


@compiled_only
@pytest.mark.usefixtures("quiet_lock")
def test_everybody_gets_a_row_for_each_kind_of_work(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench_module, "EPOCH_NS", 20_000)
    found = bench(("numpy",), budget_seconds=20, working_sets=("l1",), sweep=lambda: SWEEP)
    rows = found["rows"]
    assert [(r["work"], r["by"]) for r in rows] == [(w, by) for w in WORKS for by in (OURS, TWIN, "numpy")]
    assert found["sweep"] == SWEEP
    assert found["absent"] == {}
    for row in rows:
        assert row["ns"] > 0
        assert row["ratio_low"] <= row["ratio"] <= row["ratio_high"]
        assert row["error"] <= TOLERANCE
        assert row["rounds"] >= MIN_ROUNDS
    assert [r["ratio"] for r in rows if r["by"] == OURS] == [1.0, 1.0]


@compiled_only
@pytest.mark.usefixtures("quiet_lock")
def test_c_meets_our_kernels_in_every_kind_of_work(monkeypatch: pytest.MonkeyPatch) -> None:
    if shutil.which("cc") is None:
        pytest.skip("no cc here")
    monkeypatch.setattr(bench_module, "EPOCH_NS", 20_000)
    found = bench(("c",), budget_seconds=30, working_sets=("l1",), sweep=lambda: SWEEP)
    assert [(r["work"], r["by"]) for r in found["rows"]] == [(w, by) for w in ALL_WORKS for by in (OURS, TWIN, "c")]
    assert all(row["error"] <= TOLERANCE for row in found["rows"])


def test_without_a_compiler_c_is_absent_and_says_why(
    vectors: tuple[Any, Any, Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Any
) -> None:
    monkeypatch.setenv("CC", str(tmp_path / "none"))
    assert "there is no C compiler" in str(kernel_peers.prepared("c", *vectors))
    refuses = tmp_path / "refuses"
    refuses.write_text("#!/bin/sh\necho 'no such processor' >&2; exit 1\n")
    refuses.chmod(0o755)
    monkeypatch.setenv("CC", str(refuses))
    assert kernel_peers.prepared("c", *vectors) == "cannot be used here: refuses refuses: no such processor"


@compiled_only
@pytest.mark.usefixtures("quiet_lock")
def test_wrong_values_get_no_row_and_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(a: Any, b: Any, out: Any) -> Peer:
        return Peer("1", {PHONG: lambda: np.zeros_like(out), LYON: lambda: np.zeros(3, np.float32)})

    monkeypatch.setattr(bench_module, "EPOCH_NS", 20_000)
    monkeypatch.setattr(kernel_peers, "PEERS", {"numpy": wrong})
    found = bench(("numpy",), budget_seconds=20, working_sets=("l1",), sweep=lambda: SWEEP)
    assert {r["by"] for r in found["rows"]} == {OURS, TWIN}
    assert sum("left out" in note for note in found["notes"]) == 2


@compiled_only
@pytest.mark.usefixtures("quiet_lock")
def test_a_budget_that_is_too_short_says_what_it_takes() -> None:
    with pytest.raises(InputError, match=r"it takes \d+ s"):
        bench(("numpy",), budget_seconds=1e-4, working_sets=("l1",), sweep=lambda: SWEEP)


@pytest.mark.parametrize("budget", [0.0, -1.0, float("nan"), float("inf")])
def test_a_budget_that_is_no_time_is_refused(budget: float) -> None:
    with pytest.raises(InputError, match="is no time"):
        bench(("numpy",), budget_seconds=budget, sweep=lambda: SWEEP)


def test_an_entrant_knows_how_many_cores_it_used(monkeypatch: pytest.MonkeyPatch) -> None:
    cpu, wall = itertools.count(0, 2000), itertools.count(0, 1000)
    monkeypatch.setattr("time.process_time_ns", lambda: next(cpu))
    monkeypatch.setattr("time.perf_counter_ns", lambda: next(wall))
    entrant = Entrant(PHONG, "threaded", "1", lambda: None)
    for _ in range(3):
        entrant.epoch(1)
    assert entrant.cpu / entrant.wall == 2
