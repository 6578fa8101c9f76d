"""`make docs` fills the marked parts of the pages from rows, touches nothing else, and writes all of it or nothing."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from click.testing import CliRunner

from phongbench.analysis.rows import Rows
from phongbench.benchmarks.false_alarms import Alarms
from phongbench.errors import InputError, MeasurementError
from phongbench.formulas.formula import Formula
from phongbench.inputs.plan import preset
from phongbench.results import provenance
from phongbench.results.runs import load
from phongbench.study.run import run_study
from phongbench_reports.readme import __main__ as program
from phongbench_reports.readme import bench_parts, measurements, parts, pictures, raw_part, run_parts, tour
from phongbench_reports.readme.__main__ import main
from phongbench_reports.readme.fill import of_run, write
from phongbench_reports.readme.measurements import Wall

RATES = {"evaluations_per_second": 5.1e8, "numpy_evaluations_per_second": 1.05e7, "ratio": 48.57}


def timed(by: str, work: str, ratio: float, verdict: str) -> dict[str, Any]:
    return {
        "by": by,
        "version": "1.2",
        "work": work,
        "working_set": "l2",
        "ns": 0.35,
        "ratio": ratio,
        "ratio_low": ratio - 0.1,
        "ratio_high": ratio + 0.1,
        "verdict": verdict,
        "rounds": 24,
    }


def drawn(tracer: str, seconds: float, **what: Any) -> dict[str, Any]:
    return {
        "tracer": tracer,
        "version": "1.2",
        "draws": "depth 3, shadows",
        "size": "64x36",
        "seconds": seconds,
        "mpixels_per_second": 0.002304 / seconds,
        "mrays_per_second": None,
        "pixels_off": 0.0,
        "surfaces_agree": None,
        "note": f"what {tracer} does",
        **what,
    }


COMPARED = {
    "alpha": 50.0,
    "gamma": 8,
    "absent": {"jax": "not installed"},
    "sweep": RATES,
    "rows": [timed("phongbench", "exact Phong", 1.0, "baseline"), timed("numpy", "exact Phong", 4.8, "slower")],
}
ALARMS = [Alarms("l1", 200, 24, 1, 3, 0.0138, 12.0)]
PICTURES = {
    "skips": {
        "many-lights": [
            {"variant": v, "seconds": 0.1, "ratio": r, "same_bits": v != "all", "largest_change": c}
            for v, r, c in (("all", 1.0, 0.02), ("exact", 2.0, 0.0), ("none", 5.0, 0.0))
        ]
    },
    "tracers": [
        drawn("phongbench", 0.01, mrays_per_second=20.0, ratio=1.0),
        drawn("plain NumPy", 0.25, mrays_per_second=0.8, ratio=25.0, pixels_off=0.001),
        drawn("mitsuba", 0.02, ratio=2.0, pixels_off=0.002, surfaces_agree=0.99999),
    ],
    "absent": [{"tracer": "pyvista", "why": "not installed; pip install pyvista brings it"}],
}
DOCUMENT = {"cells": 5000, "evaluations": 23_456_000_000, "seconds": {"accuracy": 30.04, "timing": 8, "report": 2.5}}
EMPTY = {
    page: "before\n" + "".join(f"<!-- generated: {n} -->\n<!-- /generated: {n} -->\nbetween\n" for n in names)
    for page, names in parts.PAGES.items()
}


@pytest.fixture(scope="module")
def made(run: Any) -> Any:
    """The made-up run, of this machine and of a changed quick preset."""
    plan = replace(preset("quick"), alphas=(10.0, 20.0, 50.0, 128.0, 200.0), samples=131072).validated()
    manifest = {**run.manifest, "plan": plan.as_dict(), "provenance": provenance.collect(1, ()).as_dict()}
    found = replace(run, manifest=manifest)
    object.__setattr__(found, "plan", plan)
    return found


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A folder with pages whose parts are empty."""
    for page, text in EMPTY.items():
        (tmp_path / page).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / page).write_text(text)
    return tmp_path


def lines_of(part: str) -> list[list[str]]:
    """The cells of a Markdown table, headings and rule first."""
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in part.splitlines() if line[:1] == "|"]


WALLS = [Wall("cold", DOCUMENT, 45.04), Wall("warm", DOCUMENT, 25.0)]


@pytest.fixture
def measured(checkout: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The checkout, where what takes long is made up: all but what a run gives."""
    monkeypatch.setattr("phongbench.benchmarks.kernel_bench.bench", lambda **_: COMPARED)
    monkeypatch.setattr("phongbench.benchmarks.false_alarms.count", lambda *_, **__: ALARMS)
    monkeypatch.setattr(measurements, "measured_scenes", lambda *_: PICTURES)
    monkeypatch.setattr(measurements, "service", lambda _: "of the service")
    monkeypatch.setattr(program.heads_part, "heads", lambda: "of heads")
    monkeypatch.setattr(pictures, "explorer", lambda _: b"a page")
    monkeypatch.setattr(pictures, "spheres", lambda: b"three spheres")
    monkeypatch.setattr(tour, "executed", lambda _: [[]] * len(tour.cells()))
    folder = checkout / "tests" / "api" / "load"
    folder.mkdir(parents=True)
    (folder / "__main__.py").touch()
    return checkout


@pytest.fixture
def made_is_found(made: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("phongbench.results.runs.find", lambda *_: made)


@pytest.mark.usefixtures("made_is_found")
def test_every_part_is_filled_and_the_rest_stays(measured: Path) -> None:
    write(measured, {"times": bench_parts.times(WALLS), **dict.fromkeys(parts.SOAKED, "counted by make soak")})
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


def test_the_same_rows_give_the_same_parts(made: Any) -> None:
    assert of_run(made) == of_run(made)


def test_the_words_of_the_glossary_hold_names_of_formulas_and_chips(made: Any) -> None:
    rows = dict(lines_of(run_parts.glossary(Rows(made)).replace("\\|", "/"))[2:])
    assert "`lyon` Lyon" in rows["names"]
    assert "`gcn4` AMD GCN 4" in rows["chips"]
    assert "1/255" in rows["error, code"]


def test_spheres_are_a_small_picture_of_what_their_text_says() -> None:
    content = pictures.spheres()
    assert content[:4] == b"\x89PNG"
    assert len(content) <= parts.LARGEST_PICTURE
    assert f"{pictures.PICTURES}/{pictures.SPHERES}" in pictures.part()


def test_the_verdict_is_the_reports_at_a_few_exponents(made: Any) -> None:
    part = run_parts.verdict(Rows(made))
    headings, _, *rows = lines_of(part)
    assert headings[:2] == ["α", "formula"]
    assert [row[0] for row in rows] == ["10", "20", "50", "128", "200"]
    assert "within 1/255" in part.lower()


def test_the_answer_by_target_names_formulas_as_they_are_typed(made: Any) -> None:
    headings, _, *rows = lines_of(run_parts.by_target(Rows(made)))
    assert headings[0] == "α"
    assert {"cpu", "gcn4", "rdna2"} <= set(headings)
    assert [row[0] for row in rows] == ["10", "20", "50", "128", "200"]
    assert rows[0][1].startswith("`lyon:")
    assert "|" not in run_parts.by_target(Rows(replace(made, costs=made.costs.head(0))))


def test_speed_shows_a_formula_once_and_the_twin(made: Any) -> None:
    part = run_parts.speed(Rows(made))
    names = [row[0] for row in lines_of(part)[2:]]
    assert len(set(names)) == len(names)
    assert {"phong", "schlick", "lyon:cross:8"} <= set(names)
    assert not {"copy", "triad", "dot", "aa-twin"} & set(names)
    assert "A/A twin" in part


RAW_TIMES = {"lyon:cross:8": 0.4, "phong/once": 1.6, "lyon:cross:8@lengthwise": 0.9, "phong@lengthwise/once": 1.0}


def test_raw_vectors_are_answered_for_with_intervals(made: Any) -> None:
    one = made.timing[(made.timing["approximation"] == "schlick") & (made.timing["precision"] == "float32")]
    rows = [
        one.assign(**{n: getattr(f, n) for n in ("approximation", "lambda_form", "gamma", "recipe", "normalise")})
        .assign(ratio=ratio, ratio_low=0.99 * ratio, ratio_high=1.01 * ratio, ns_min=ratio)
        .astype({"gamma": "Int64"})
        for f, ratio in ((Formula.parse(spelling), ratio) for spelling, ratio in RAW_TIMES.items())
    ]
    usual = made.timing.assign(recipe="pair", normalise="none")
    rows_with = Rows(replace(made, timing=pd.concat([usual, *rows], ignore_index=True)))
    part = raw_part.raw_vectors(rows_with)
    headings, _, given, whole = lines_of(part)
    assert headings[3:] == ["ns in L1", "in L1", "in L2", "beyond cache"]
    assert given[:3] == ["given R and V", "`lyon:cross:8`", "`phong/once`"]
    assert given[4] == "0.250 (0.245 to 0.255), faster"
    assert whole[0] == "from N, L and V"
    assert "Is the cross form without normalising faster" in part


def test_raw_vectors_that_were_not_timed_are_said_to_be_so(made: Any) -> None:
    assert "did not time it" in raw_part.raw_vectors(Rows(made))


def test_throughput_and_wall_times_are_told_apart() -> None:
    assert ["phongbench", "510 million", "48.6"] in lines_of(bench_parts.throughput(RATES))
    assert ["cold", "30.0 s", "8.0 s", "2.5 s", "45.0 s"] in lines_of(bench_parts.times(WALLS))


def test_the_machine_is_named_and_no_path_or_host(made: Any) -> None:
    part = run_parts.machine(made)
    assert "changed by options" in part
    assert "numba" in part
    assert str(Path.home()) not in part


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
        measurements.study_as_command("cold", tmp_path / "cold", tmp_path / "cache", ["--alpha", "-1"])


def test_the_load_program_is_looked_for_before_anything_is_measured(checkout: Path) -> None:
    found = CliRunner().invoke(main, ["--run", "latest", "--root", str(checkout)])
    assert found.exit_code == 1
    assert "the load program is not there" in found.stderr


def test_peers_are_told_as_ratios_and_the_absent_by_name() -> None:
    part = bench_parts.peers(COMPARED)
    assert lines_of(part)[2:] == [["phongbench 1.2", "0.350 ns"], ["numpy 1.2", "4.80 (4.70 to 4.90)"]]
    assert "Absent: jax" in part


def test_false_alarms_are_told_with_what_is_allowed() -> None:
    part = bench_parts.alarms(ALARMS)
    assert lines_of(part)[2] == ["l1", "200", "24", "1", "0.5 %", "0.0138"]
    assert part.endswith("Allowed is 1 %: met.")
    assert bench_parts.alarms([replace(ALARMS[0], resolved=3)]).endswith("not met.")


def test_scenes_are_told_by_what_leaving_out_saves() -> None:
    part = bench_parts.scenes(PICTURES)
    assert lines_of(part)[2] == ["many-lights", "2", "100 ms", "5.00 ×", "2.50 ×", "yes", "0.0200"]


def test_tracers_are_told_with_what_is_compared() -> None:
    part = bench_parts.scenes(PICTURES)
    assert lines_of(part)[-3:] == [
        ["phongbench", "depth 3, shadows", "10 ms", "0.230", "20", "1", "–", "–"],
        ["plain NumPy", "depth 3, shadows", "250 ms", "0.00922", "0.800", "25", "0.1 %", "–"],
        ["mitsuba", "depth 3, shadows", "20 ms", "0.115", "–", "2", "0.2 %", "99.9990 %"],
    ]
    assert "chequerboard at 64x36" in part
    assert "- mitsuba 1.2: what mitsuba does." in part
    assert "- pyvista is absent: not installed; pip install pyvista brings it." in part


def test_claims_are_told_with_verdict_and_reason(made: Any) -> None:
    headings, _, *rows = lines_of(run_parts.claims(made))
    assert headings == ["claim", "verdict", "result"]
    assert rows[0][0].startswith("a) ")
    assert "not measured" not in [row[1] for row in rows]
