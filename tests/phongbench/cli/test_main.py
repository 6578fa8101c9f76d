"""The command line as a user meets it: exit codes, two-line errors, data on stdout, talk on stderr."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from phongbench.cli.main import EXIT_CODES, main

QUICKLY = [
    "--alpha",
    "10",
    "--gamma",
    "8",
    "--only",
    "lyon",
    "--precision",
    "float32",
    "--samples",
    "2000",
    "--no-timing",
]
#: where only the folder and the rows of the sweep matter
BARELY = [*QUICKLY, "--no-report", "--probe", "none"]
#: of a formula that is compiled for one test: the other forms take its kernel as they take ours, and
#: test_face.py has its own compiled for every target
ONE_WAY = ["--lambda", "dot", "--target", "cpu,rdna2"]


@pytest.fixture
def call(tmp_path, monkeypatch):
    """Run a command in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return lambda *words: CliRunner().invoke(main, list(words))


def test_help_opens_with_examples(call):
    assert "Examples:" in call("--help").stdout
    assert "Examples:" in call("run", "--help").stdout


def test_a_run_is_made_listed_shown_verified_and_reported(call, tmp_path, only_figures):
    with only_figures():
        made = call("run", *QUICKLY, "--json")
    assert made.exit_code == 0, made.stderr
    told = json.loads(made.stdout)
    keys = "run path cells evaluations seconds peak_mib failed_cells violations report"
    assert set(told) == set(keys.split())
    assert told["failed_cells"] == 0
    assert (tmp_path / told["report"]).is_file()
    assert [r["run"] for r in json.loads(call("list", "--json").stdout)] == [told["run"]]
    assert told["run"] in call("list").stdout
    assert json.loads(call("show", "latest", "--json").stdout)["facts"]["state"] == "complete"
    assert "accuracy rows" in call("show", told["run"]).stdout
    assert call("verify", "latest").exit_code == 0
    with only_figures():
        report = call("report", "latest", "--out", "elsewhere", "--single-file")
    assert report.exit_code == 0, report.stderr
    again = call("compare", "latest", told["run"])
    assert again.exit_code == 0
    assert "0" in again.stdout


def test_a_run_ends_with_what_to_ship_where_the_time_went_and_what_to_do_next(call):
    said = call("run", *BARELY, "--out", "mine").stdout
    assert said.startswith("Least sampled error, float32, unit vectors; nothing was timed")
    for words in ("10     lyon:", "s went: ", "accuracy ", "run  mine", "code    phongbench shader lyon:"):
        assert words in said
    shown = call("show", "mine").stdout
    assert said.splitlines()[0] in shown
    (line,) = [line for line in shown.splitlines() if line.startswith("code    ")]
    assert call(*line.split()[2:]).exit_code == 0


def test_a_run_is_resumed_by_its_folder_alone_and_one_that_is_finished_says_so(call, tmp_path):
    assert call("run", *BARELY, "--out", "phongbench-runs/mine-00001").exit_code == 0
    manifest = tmp_path / "phongbench-runs/mine-00001/manifest.json"
    finished = manifest.read_text()
    again = call("run", "--resume", "--out", "phongbench-runs/mine-00001", "--no-report")
    assert again.exit_code == 0, again.stderr
    assert "was finished before" in again.stdout
    manifest.write_text(finished.replace('"complete"', '"partial"'))
    assert call("show", "latest").exit_code == 2
    assert "mine-00001" in call("show", "latest").stderr
    assert call("show", "mine-00001").exit_code == 0
    resumed = call("run", "--resume", "--no-report", "--json")  # the newest interrupted one
    assert resumed.exit_code == 0, resumed.stderr
    assert json.loads(resumed.stdout)["run"] == "mine-00001"
    assert json.loads(manifest.read_text())["state"] == "complete"
    found = call("run", "--resume")
    assert (found.exit_code, found.stdout) == (2, "")
    assert "nothing to resume" in found.stderr


def test_runs_are_listed_with_what_they_hold(call):
    assert call("run", *BARELY, "--out", "phongbench-runs/mine-00001").exit_code == 0
    (one,) = json.loads(call("list", "--json").stdout)
    assert (one["study"], one["alphas"], one["precisions"], one["timed"]) == ("custom", [10.0], ["float32"], False)
    head, row = call("list").stdout.splitlines()
    assert head.split() == ["run", "study", "exponents", "precisions", "timed", "size", "state"]
    assert row.split()[:5] == ["mine-00001", "custom", "10", "float32", "no"]


def test_compare_tells_what_changed(call):
    for seed in ("1", "2"):
        assert call("run", *BARELY, "--seed", seed, "--out", f"run-{seed}").exit_code == 0
    found = call("compare", "run-1", "run-2", "--json")
    assert found.exit_code == 1
    told = json.loads(found.stdout)
    assert told["changed"] > 0
    assert told["only_a"] == told["only_b"] == 0
    assert abs(told["rows"][0]["change"]) == max(abs(r["change"]) for r in told["rows"])
    everything = "1e39"  # powers of raw vectors are errors of any size
    assert call("compare", "run-1", "run-2", "--tolerance", everything).exit_code == 0
    assert call("compare", "run-1", "run-2", "--metric", "maxabs").exit_code == 2


def test_a_tolerance_is_a_finite_number_of_at_least_0(call):
    assert call("run", *BARELY, "--out", "run-1").exit_code == 0
    for tolerance in ("-1", "-1e-300", "nan", "inf", "-inf", "a little"):
        found = call("compare", "run-1", "run-1", "--tolerance", tolerance)
        assert found.exit_code == 2, tolerance
        assert "at least 0" in found.stderr or "not a valid float" in found.stderr
        assert found.stdout == ""


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["run", "--alpha", "0"], 2, "alpha = 0"),
        (["run", "--alpha", "nan"], 2, "alpha = nan"),
        (["run", "--alpha", "ten"], 2, "'ten' is not a list of numbers"),
        (["run", "--alpha", ","], 2, "alphas is empty"),
        (["run", "--alpha", "80..20"], 2, "80..20 is no range of exponents"),
        (["run", "--alpha", "20..x"], 2, "'20..x' is not a range"),
        (["run", "--alpha", "nan..20"], 2, "no range of exponents"),
        (["run", "--resume"], 2, "nothing to resume"),
        (["recommend", "--max-error", "1/255"], 2, "Missing option '--alpha'"),
        (["recommend", "--alpha", "5", "--materials", "a.mtl", "--max-error", "1"], 2, "--alpha or --materials"),
        (["recommend", "--alpha", "50", "--max-error", "1", "--inputs", "sine"], 2, "known: vectors, cosine"),
        (["recommend", "--alpha", "50", "--max-error", "1", "--inputs", "cosine", "--raw"], 2, "recipes start from"),
        (["recommend", "--alpha", "20..80", "--max-error", "1", "--code", "c"], 2, "list some"),
        (["run", "--alpha", ""], 2, "what follows --alpha is empty"),
        (["run", "--alpha="], 2, "what follows --alpha is empty"),
        (["show", ""], 2, "what follows show is empty"),
        (["shader", "lyon:dot:8", "--alpha", "50", "--language", ""], 2, "what follows --language is empty"),
        (["run", "--gamma", "6"], 2, "power of two"),
        (["run", "--gamma", "4.5"], 2, "whole numbers"),
        (["run", "--only", "lion"], 2, "did you mean 'lyon'"),
        (["run", "--lambda", "krone"], 2, "known: dot"),
        (["run", "--precision", "half"], 2, "known: float16"),
        (["run", "--preset", "huge"], 2, "known: quick"),
        (["run", "--materials", "none.mtl"], 2, "none.mtl"),
        (["run", "none.toml"], 2, "none.toml"),
        (["run", "--with", "none.py"], 2, "none.py"),
        (["run", "--jobs", "0"], 2, "--jobs"),
        (["run", "--resume", "--out", "empty"], 2, "nothing to resume"),
        (["run", "--no-timing", "--no-report", "--out", "/proc/nothing"], 5, "cannot write"),
        (["show", "nothing"], 2, "no run 'nothing'"),
        (["show", "."], 2, "is not a run"),
        (["report", "latest"], 2, "no run yet"),
        (["verify", "latest"], 2, "phongbench run"),
        (["nonsense"], 2, "nonsense"),
    ],
)
def test_bad_input_gets_an_exit_code_and_a_short_message(call, words, code, said):
    found = call(*words)
    assert found.exit_code == code, found.output
    assert said in found.stderr
    assert "Traceback" not in found.stderr
    assert found.stdout == ""


def test_bad_input_leaves_nothing_behind(call, tmp_path):
    call("run", "--alpha", "0", "--out", "here")
    assert list(tmp_path.iterdir()) == []


def test_a_flipped_byte_is_found(call, tmp_path):
    assert call("run", *BARELY, "--out", "mine").exit_code == 0
    path = tmp_path / "mine" / "accuracy.parquet"
    data = bytearray(path.read_bytes())
    data[100] ^= 4
    path.write_bytes(data)
    found = call("verify", "mine")
    assert found.exit_code == 1
    assert "bytes have changed" in found.stdout


def test_a_run_in_the_same_folder_is_refused(call):
    assert call("run", *BARELY, "--out", "mine").exit_code == 0
    found = call("run", *BARELY, "--out", "mine")
    assert found.exit_code == 2
    assert "--resume" in found.stderr


def test_dry_run_tells_and_does_nothing(call, tmp_path):
    found = call("run", *QUICKLY, "--dry-run", "--json")
    assert set(json.loads(found.stdout)) == {"cells", "rows", "evaluations", "bytes", "seconds", "limited_by"}
    assert "evaluations" in call("run", *QUICKLY, "--dry-run").stdout
    assert list(tmp_path.iterdir()) == []


MINE = """
from phongbench.compiler import elementary
from phongbench.formulas.citations import Source
from phongbench.formulas.spec import Approximation, Cost

def tent(cosine_deficit: float, beta: float) -> float:
    return elementary.positive_part(1.0 - beta * cosine_deficit)

SPEC = Approximation(
    name="tent", title="Tent", kind="alternative", formula="max(0, 1 - alpha lambda)", source=Source("MINE", "Own work",
    2026), kernel=tent, coefficients=lambda s: {BODY}, domain="a joke", cost=Cost("one multiply-add"),
)
"""


def test_the_users_own_approximation_is_measured_like_ours(call, tmp_path, only_figures):
    (tmp_path / "tent.py").write_text(MINE.replace("{BODY}", '{"beta": s.alpha}'))
    words = ["--with", "tent.py", *QUICKLY[:4], "--only", "tent", *QUICKLY[6:], *ONE_WAY, "--out", "mine", "--json"]
    with only_figures():
        found = call("run", *words)
    assert found.exit_code == 0, found.stderr
    listed = json.loads(call("approximations", "--with", "tent.py", "--json").stdout)
    assert listed[-1]["name"] == "tent"
    best = json.loads(call("show", "mine", "--json").stdout)["best"]
    assert best[0]["approximation"] == "tent"


def test_cells_that_fail_are_told_and_counted(call, tmp_path):
    (tmp_path / "tent.py").write_text(MINE.replace("{BODY}", '{"beta": 1 / (s.alpha - 20)}'))
    words = ["--with", "tent.py", "--alpha", "10,20", "--only", "tent", *BARELY[6:], *ONE_WAY, "--out", "mine"]
    found = call("run", *words, "--json")
    assert found.exit_code == 3
    assert "ZeroDivisionError" in found.stderr
    assert json.loads(found.stdout)["failed_cells"] > 0


def test_approximations_are_listed(call):
    assert "max(0, 1 - beta lambda)^gamma" in call("approximations").stdout
    names = [a["name"] for a in json.loads(call("approximations", "--json").stdout)]
    assert names[:2] == ["phong", "lyon"]


def test_doctor_finds_this_installation_fit(call):
    found = call("doctor", "--json")
    assert found.exit_code == 0
    assert {c["state"] for c in json.loads(found.stdout)} <= {"good", "poor"}


def test_a_full_disk_behind_stdout_is_a_fault_of_the_disk(call):
    if not (full := Path("/dev/full")).exists():
        pytest.skip("there is no /dev/full")
    words = [sys.executable, "-m", "phongbench", "approximations"]
    buffered = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    with full.open("wb") as stdout:
        found = subprocess.run(words, env=buffered, stdout=stdout, stderr=subprocess.PIPE, check=False)
    assert found.returncode == 5
    assert b"No space left" in found.stderr
    assert b"Traceback" not in found.stderr


def test_a_locale_without_greek_and_a_closed_stdin_are_no_reason_for_a_traceback(tmp_path):
    words = [sys.executable, "-m", "phongbench"]
    plain = os.environ | {"LC_ALL": "C", "PYTHONIOENCODING": "ascii", "COLUMNS": "20"}
    listed = subprocess.run([*words, "approximations"], cwd=tmp_path, env=plain, capture_output=True, check=False)
    assert (listed.returncode, listed.stderr) == (0, b"")
    assert listed.stdout.isascii()
    code = "import sys; sys.stdin = None; from phongbench.cli.main import main; main(['shade', '-'])"
    closed = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, check=False)
    assert closed.returncode == 2
    assert b"there is no stdin" in closed.stderr


def test_every_error_has_an_exit_code():
    assert [code for _, code in EXIT_CODES] == [4, 5, 6, 2, 3, 130, 1]


def test_colours_are_left_out_when_asked(tmp_path):
    found = subprocess.run(
        [sys.executable, "-m", "phongbench", "approximations"],
        cwd=tmp_path,
        env=os.environ | {"NO_COLOR": "1"},
        capture_output=True,
        check=True,
    )
    assert b"\x1b[3" not in found.stdout


#: undoes an inherited refusal of SIGINT, as a job that a script started in the background has
HEEDING = """import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from phongbench.cli.main import main
main(prog_name="phongbench")
"""


def test_an_interrupted_run_leaves_with_130_and_says_how_to_go_on(tmp_path):
    process = subprocess.Popen(
        [
            sys.executable,
            "-c",
            HEEDING,
            "run",
            *BARELY,
            "--samples",
            "4000000000",  # hours: it cannot end before it is told to
            "--out",
            "mine",
        ],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
    )
    assert process.stderr is not None
    for line in process.stderr:
        if b"accuracy" in line:
            break
    process.send_signal(signal.SIGINT)
    said = process.stderr.read().decode()
    process.stderr.close()
    assert process.wait() == 130
    assert "--out mine --resume" in said
    assert "Traceback" not in said
