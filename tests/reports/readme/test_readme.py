"""`make docs` fills the marked parts of the pages from rows, touches nothing else, and writes all of it or nothing."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from click.testing import CliRunner
from made_up_bench import BENCH
from made_up_measurements import ALARMS, COMPARED, PICTURES, WALLS

from phongbench.benchmarks import study_bench
from phongbench.errors import InputError, MeasurementError
from phongbench.inputs.plan import preset
from phongbench.results.runs import load
from phongbench.study.run import run_study
from phongbench_reports.readme import __main__ as program
from phongbench_reports.readme import bench_parts, measurements, parts, pictures, roofline_part, tour
from phongbench_reports.readme.__main__ import main
from phongbench_reports.readme.fill import of_run, write

EMPTY = {
    page: "before\n" + "".join(f"<!-- generated: {n} -->\n<!-- /generated: {n} -->\nbetween\n" for n in names)
    for page, names in parts.PAGES.items()
}


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A folder with pages whose parts are empty."""
    for page, text in EMPTY.items():
        (tmp_path / page).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / page).write_text(text)
    return tmp_path


@pytest.fixture
def measured(checkout: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The checkout, where what takes long is made up: all but what a run gives."""
    monkeypatch.setattr("phongbench.benchmarks.kernel_bench.bench", lambda **_: COMPARED)
    monkeypatch.setattr("phongbench.benchmarks.false_alarms.count", lambda *_, **__: ALARMS)
    monkeypatch.setattr(program.roofline_part, "measured", lambda: BENCH)
    monkeypatch.setattr(measurements, "measured_scenes", lambda *_: PICTURES)
    monkeypatch.setattr(measurements, "service", lambda _: "of the service")
    monkeypatch.setattr(program.heads_part, "heads", lambda: "of heads")
    monkeypatch.setattr(program.scale_part, "predicted", lambda: "on paper")
    monkeypatch.setattr(pictures, "explorer", lambda _: b"a page")
    monkeypatch.setattr(pictures, "spheres", lambda: b"three spheres")
    monkeypatch.setattr(tour, "executed", lambda _: [[]] * len(tour.cells()))
    monkeypatch.setattr(measurements, "goal_in_clone", lambda name, *_: measurements.Goal(name, 60.0, ""))
    folder = checkout / "tests" / "api" / "load"
    folder.mkdir(parents=True)
    (folder / "__main__.py").touch()
    return checkout


@pytest.fixture
def made_is_found(made: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("phongbench.results.runs.find", lambda *_: made)


@pytest.mark.usefixtures("made_is_found")
def test_every_part_is_filled_and_the_rest_stays(measured: Path) -> None:
    write(measured, {"times": bench_parts.times(WALLS), **dict.fromkeys(parts.ATTACKED, "counted by make soak")})
    found = CliRunner().invoke(main, ["--run", "latest", "--root", str(measured)])
    assert found.exit_code == 0, found.output
    assert found.stderr.split() == list(program.STEPS)
    texts = parts.read(measured)
    assert all(parts.parts_of(texts).values())
    assert "float highlight(vec3 r, vec3 v)" in parts.parts_of(texts)["shader"]
    assert (measured / "reports" / "docs" / "tour.ipynb").is_file()
    assert (measured / "reports" / "pictures" / "spheres.png").read_bytes() == b"three spheres"
    for page, text in texts.items():
        assert re.sub(r"(?s)(<!-- generated: \w+ -->\n).*?(<!-- /)", r"\1\2", text) == EMPTY[page]


def test_a_step_writes_its_parts_alone_so_that_others_may_follow(measured: Path) -> None:
    found = CliRunner().invoke(main, ["--only", "peers,alarms", "--root", str(measured)])
    assert found.exit_code == 1  # the other parts are empty, which it says
    filled = {name for name, body in parts.parts_of(parts.read(measured)).items() if body}
    assert filled == {"peers", "throughput", "alarms"}


def test_what_a_failing_step_follows_is_kept(measured: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: Any, **__: Any) -> None:
        raise MeasurementError("something else runs", "alarms", "end it")

    monkeypatch.setattr("phongbench.benchmarks.false_alarms.count", fails)
    found = CliRunner().invoke(main, ["--only", "peers,alarms,scenes", "--root", str(measured)])
    assert found.exit_code == 1
    assert "something else runs" in found.stderr
    filled = {name for name, body in parts.parts_of(parts.read(measured)).items() if body}
    assert filled == {"peers", "throughput"}


def test_a_step_that_there_is_not_is_refused_with_those_there_are(checkout: Path) -> None:
    found = CliRunner().invoke(main, ["--only", "peers,alarm", "--root", str(checkout)])
    assert found.exit_code == 1
    assert "no step alarm" in found.stderr
    assert "alarms" in found.stderr


def test_a_run_without_timing_is_refused_and_changes_nothing(made: Any, measured: Path, monkeypatch: Any) -> None:
    silent = replace(made, timing=pd.DataFrame(columns=made.timing.columns))
    monkeypatch.setattr("phongbench.results.runs.find", lambda *_: silent)
    found = CliRunner().invoke(main, ["--run", "silent", "--root", str(measured)])
    assert found.exit_code == 1
    assert "no timing" in found.stderr
    assert parts.read(measured) == EMPTY


@pytest.mark.parametrize("damaged", ["", EMPTY[parts.README].replace("<!-- /generated: targets -->", ""), "twice"])
def test_lost_or_doubled_marks_are_refused(damaged: str) -> None:
    text = 2 * EMPTY[parts.README] if damaged == "twice" else damaged
    with pytest.raises(InputError, match="generated parts"):
        parts.filled({**EMPTY, parts.README: text}, dict.fromkeys(parts.NAMES, "new"))


def test_check_tells_what_is_empty_and_exits_with_1(checkout: Path) -> None:
    found = CliRunner().invoke(main, ["--check", "--root", str(checkout)])
    assert found.exit_code == 1
    assert found.stderr.count("is empty") == len(parts.NAMES)
    assert parts.read(checkout) == EMPTY


def test_check_misses_a_picture_that_is_shown(checkout: Path) -> None:
    for page, text in parts.filled(EMPTY, dict.fromkeys(parts.NAMES, '<img src="gone.svg">')).items():
        (checkout / page).write_text(text)
    assert set(parts.problems(checkout)) == {"gone.svg is shown but does not exist; `make docs` draws it"}


def test_a_folder_without_readme_is_refused_in_a_line(tmp_path: Path) -> None:
    found = CliRunner().invoke(main, ["--check", "--root", str(tmp_path)])
    assert found.exit_code == 1
    assert "run it in a checkout" in found.stderr


def test_a_stored_run_fills_its_parts(checkout: Path, tmp_path: Path) -> None:
    plan = replace(
        preset("quick"),
        alphas=(10.0,),
        gammas=(8,),
        approximations=("lyon",),
        precisions=("float32",),
        strata=("highlight",),
        samples=2000,
        timing_budget=2.0,
        probes=(),
    ).validated()
    folder = tmp_path / "run"
    run_study(plan, folder)
    found = CliRunner().invoke(main, ["--run", str(folder), "--only", "study", "--root", str(checkout)])
    assert found.exit_code == 1, found.output  # what only others fill is still empty
    filled = {name for name, body in parts.parts_of(parts.read(checkout)).items() if body}
    assert filled == {*of_run(load(folder))}
    assert "lyon" in parts.parts_of(parts.read(checkout))["verdict"]


def test_a_study_that_fails_is_told_with_its_exit_code(tmp_path: Path) -> None:
    with pytest.raises(MeasurementError, match="exit code 2"):
        study_bench.study_as_command("cold", tmp_path / "cold", tmp_path / "cache", ["--alpha", "-1"])


def test_the_load_program_is_looked_for_before_anything_is_measured(checkout: Path) -> None:
    found = CliRunner().invoke(main, ["--run", "latest", "--root", str(checkout)])
    assert found.exit_code == 1
    assert "the load program is not there" in found.stderr


def test_rooflines_tell_what_the_machine_gives_and_why_time_is_lost() -> None:
    slow = {**BENCH, "notes": ["shade: 1.8 times its roofline; waits", "8 rounds only"]}
    text = roofline_part.rooflines(slow)
    assert "| exact Phong | l2 | 0.360 ns | 0.200 ns | 1.80 | bytes |" in text
    assert text.count("640x360") == 2
    assert "- shade: 1.8 times its roofline; waits." in text
    assert "8 rounds" not in text
    assert "None takes 1.3 times its bound." in roofline_part.rooflines({**BENCH, "notes": []})
    assert "which this machine does not run" in roofline_part.rooflines({**BENCH, "bounds": []})


@pytest.fixture
def committed(tmp_path: Path) -> Path:
    """A checkout with a Makefile; what was changed since is not committed."""
    root = tmp_path / "checkout"
    root.mkdir()
    (root / "Makefile").write_text('run:\n\t@echo "in $$(pwd), by $(PYTHON), kernels in $$PHONGBENCH_CACHE"\n')
    for words in (["init", "--quiet"], ["add", "."], ["commit", "--quiet", "--message", "all"]):
        named = ["-c", "user.name=tests", "-c", "user.email=tests@localhost"]
        subprocess.run(["git", *named, *words], cwd=root, check=True)
    (root / "Makefile").write_text("run:\n\t@exit 3\n")
    return root


def test_a_goal_is_made_in_a_clone_of_what_is_committed(
    committed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MAKEFLAGS", "--just-print")  # of a make that this runs under
    made = measurements.goal_in_clone("run", committed, tmp_path / "clones")
    clone, kernels = tmp_path / "clones" / "run", tmp_path / "clones" / "run-kernels"
    assert made.output == f"in {clone}, by {sys.executable}, kernels in {kernels}\n"
    assert made.seconds > 0


def test_a_goal_that_fails_is_told_with_its_last_lines(committed: Path, tmp_path: Path) -> None:
    with pytest.raises(MeasurementError, match="make test: it ended with exit code 2"):
        measurements.goal_in_clone("test", committed, tmp_path)
    with pytest.raises(MeasurementError, match="exit code 128"):
        measurements.goal_in_clone("run", tmp_path / "no checkout", tmp_path)
