"""An adapter in a study: used where it is a GPU or was asked for, and no harm to the rest where it fails."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from webgpu_here import adapter_here

from phongbench.accuracy import sweep
from phongbench.accuracy.sweep import Sweep
from phongbench.analysis.front import points
from phongbench.analysis.recommend import recommend
from phongbench.analysis.target_costs import own_prices, prices, table_of
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.inputs.plan import Plan, preset
from phongbench.results.records import Records
from phongbench.results.runs import Run
from phongbench.results.schema import DOT, TABLES, TWIN
from phongbench.study import gpu
from phongbench.study.run import run_study
from phongbench.support.progress import Progress
from phongbench.targets.code_shapes import Code, code
from phongbench.targets.webgpu import measure
from phongbench.targets.webgpu.measure import GpuTimes, Measured
from phongbench.targets.webgpu.programs import CONTEXTS
from phongbench.targets.webgpu.session import Adapter, Session
from phongbench.timing.statistics import Interval

FORMULAS = ("phong", "lyon:dot:8", "lyon:dot:8:minimax", "lyon:cross:8")
SOFTWARE = Adapter("lavapipe", "Mesa 1", "Vulkan", True, ("timestamp-query",), "0.32")


def plan(*targets: str, timing: bool = False) -> Plan:
    return replace(
        preset("quick"), alphas=(50.0,), gammas=(8,), approximations=("phong", "lyon"), lambda_forms=("dot", "cross"),
        spaces=("reflect",), precisions=("float32",), samples=500, probes=(), raw=(), strata=("highlight",),
        timing=timing, targets=targets,
    ).validated()  # fmt: skip


class Notes(Progress):
    def __init__(self) -> None:
        self.notes: list[str] = []

    def note(self, text: str) -> None:
        self.notes.append(text)


def codes() -> dict[tuple[Formula, float], Code]:
    formulas = [Formula.parse(name) for name in FORMULAS]
    return {(formula, 50.0): code(formula, 50.0, gpu.LANGUAGE) for formula in formulas}


@pytest.fixture
def worker(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Another process instead of the one that holds the device."""

    def instead(body: str) -> None:
        text = f"import sys\nfrom phongbench.targets.webgpu.messages import receive, send\n{body}"
        monkeypatch.setattr(gpu, "Session", lambda: Session((sys.executable, "-c", text), (60.0, 60.0)))

    return instead


def measured(*targets: str) -> tuple[object, list[str]]:
    progress = Notes()
    prepared: Sweep = sweep.prepare(plan(*targets))
    return gpu.measure(prepared, codes(), progress), progress.notes


def adapter_told(adapter: str) -> str:
    return f"receive(sys.stdin.buffer); send(sys.stdout.buffer, (True, {adapter}))\n"


def test_software_is_measured_where_it_is_asked_for_alone(worker: Callable[[str], None]) -> None:
    facts = {name: getattr(SOFTWARE, name) for name in SOFTWARE.__slots__}
    worker(adapter_told(str(facts)))
    assert measured() == (None, [])
    found, notes = measured("gpu")
    assert found is None  # the made-up device is gone by then
    assert notes[0] == "gpu: lavapipe, a software adapter on the processor, no GPU"
    assert "process ended" in notes[1]


def test_no_adapter_is_worth_a_word_where_one_is_asked_for_alone(worker: Callable[[str], None]) -> None:
    worker(adapter_told("None"))
    assert measured() == (None, [])
    assert measured("gpu") == (None, ["the GPU was not measured: there is no adapter"])


def test_a_driver_that_crashes_is_a_note(worker: Callable[[str], None]) -> None:
    worker("sys.exit('panicked: device lost')")
    for targets in ((), ("gpu",)):
        found, notes = measured(*targets)
        assert found is None
        assert len(notes) == 1
        assert "device lost" in notes[0]


def test_it_is_looked_for_where_times_are_measured_or_where_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gpu, "why_not", lambda: None)
    assert gpu.wanted(plan("gpu"))
    assert gpu.wanted(plan(timing=True))
    assert not gpu.wanted(plan())
    assert not gpu.wanted(plan("cpu", timing=True))
    monkeypatch.setattr(gpu, "why_not", lambda: "no binding")
    assert not gpu.wanted(plan(timing=True))
    assert gpu.wanted(plan("gpu"))


def test_rows_are_of_every_formula_whose_code_was_timed_and_of_what_stands_beside() -> None:
    even = Measured(0.4, Interval(1.0, 0.9, 1.1), "unresolved", 4.0)
    half = Measured(0.2, Interval(0.5, 0.4, 0.6), "faster", 2.0)
    timed = {("phong", CONTEXTS[0]): even, (TWIN, CONTEXTS[0]): even, (DOT, CONTEXTS[0]): half}
    timed |= {("lyon:dot:8 50", context): half for context in CONTEXTS}
    found = TABLES["costs"].frame(gpu.rows(codes(), GpuTimes(SOFTWARE, "timestamps", 24, timed, {})))
    assert not found.duplicated(TABLES["costs"].key).any()
    lyon = found[found["approximation"] == "lyon"]
    assert set(lyon["beta_policy"]) == {"taylor", "minimax"}  # one code
    assert set(lyon["lambda_form"]) == {"dot"}  # the other was not timed
    assert len(lyon) == 2 * len(CONTEXTS)
    assert set(zip(lyon["context"], lyon["reads"], strict=True)) == {(c.multiply_adds, c.reads) for c in CONTEXTS}
    assert set(found["approximation"]) == {"phong", "lyon", TWIN, DOT}
    assert set(found["cost_kind"]) == {"measured"}
    assert found["tool"].str.contains("no GPU; timestamps").all()


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A study with what is here, quickly."""
    adapter_here()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gpu, "SECONDS_ASKED", 0.0)
        patch.setattr(gpu, "AROUND", ())
        patch.setattr(measure, "COPIED", 1 << 20)
        return run_study(plan("gpu"), tmp_path_factory.mktemp("runs") / "gpu-measured").run


def test_a_study_keeps_costs_and_errors_apart_from_this_machines(run: Run) -> None:
    assert set(run.costs["target"]) == {"gpu"}
    assert {"phong", "lyon"} <= set(run.costs["approximation"])
    assert set(run.accuracy["device"]) == {"cpu"}
    assert set(run.device_accuracy["device"]) == {"gpu"}
    assert set(run.device_accuracy["coverage"]) == {"sampled", "searched"}
    assert run.manifest["gpu"]["adapter"] == adapter_here().title
    without = run_study(replace(run.plan, targets=("cpu",)), run.path.with_name("without-gpu"))
    assert without.run.accuracy.equals(run.accuracy)
    assert "gpu" not in without.run.manifest


class With:
    """A run with other costs."""

    def __init__(self, run: Run, rows: list[dict[str, object]]) -> None:
        self.run, self.costs = run, TABLES["costs"].frame(rows)

    def __getattr__(self, name: str) -> object:
        return getattr(self.run, name)

    def records(self, name: str) -> Records:
        """As of a stored run."""
        return Records.of(self.costs) if name == "costs" else self.run.records(name)


def test_a_run_answers_for_it_and_says_what_it_was(run: Run, tmp_path: Path) -> None:
    timed = {(name, CONTEXTS[0]): at(ratio) for name, ratio in (("phong", 1.0), ("lyon:dot:8 50", 0.5), (DOT, 0.25))}
    made = With(run, list(gpu.rows(codes(), GpuTimes(SOFTWARE, "timestamps", 24, timed, {}))))
    answer = points(made, alpha=50, target="gpu", root=tmp_path)
    assert (answer["unit"], answer["cost_kind"]) == ("ns", "measured")
    assert {point["name"]: point["ratio"] for point in answer["points"] if point["state"] == "on"} == {
        "phong": 1.0,
        "lyon:dot:8:minimax": 0.5,
    }
    advice = recommend(made, alpha=50, max_error=0.1, target="gpu", root=tmp_path)
    assert (advice["choices"][0]["name"], advice["choices"][0]["unit"]) == ("lyon:dot:8:minimax", "ns")
    for notes in (answer["notes"], advice["notes"]):
        assert "gpu: WebGPU on lavapipe, a software adapter on the processor, no GPU; timestamps" in notes
    few = With(run, [{**row, "ratio_low": None} for row in gpu.rows(codes(), GpuTimes(SOFTWARE, "", 3, timed, {}))])
    with pytest.raises(InputError, match="too few for intervals"):
        points(few, alpha=50, target="gpu", root=tmp_path)


def test_a_time_is_that_of_its_code_and_of_no_other_exponents(run: Run) -> None:
    """Lyon's code with a slope of exactly 1 needs no product: its time is not known where that was not timed."""
    timed = {("phong", CONTEXTS[0]): at(1.0), ("lyon:dot:8 50", CONTEXTS[0]): at(0.5)}
    costs = TABLES["costs"].frame(gpu.rows(codes(), GpuTimes(SOFTWARE, "timestamps", 24, timed, {})))
    own, table = own_prices(Records.of(costs), "gpu", None), table_of("gpu")
    formula = Formula.parse("lyon:dot:8")
    for alpha, known in ((50.0, True), (77.0, True), (8.0, False)):
        same = code(formula, alpha, gpu.LANGUAGE).shape == code(formula, 50.0, gpu.LANGUAGE).shape
        assert same == known
        (price,) = prices([formula], (alpha,), table, None, own)
        assert (price is not None) == known


def test_a_run_without_one_says_how_to_measure_it(run: Run, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--target gpu"):
        points(With(run, []), alpha=50, target="gpu", root=tmp_path)
    with pytest.raises(InputError, match="--target gpu"):
        recommend(None, alpha=50, max_error=0.1, target="gpu", root=tmp_path)


def at(ratio: float) -> Measured:
    return Measured(0.4 * ratio, Interval(ratio, 0.95 * ratio, 1.05 * ratio), "unresolved", 4 * ratio)
