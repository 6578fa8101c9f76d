"""front, recommend and bench as a user meets them."""

import json
import shlex
from collections.abc import Callable
from typing import Any

import pytest
from click.testing import CliRunner, Result

from phongbench.cli.main import main
from phongbench.results.runs import Run

RUN = "20260101-000000-0123abcd"
Call = Callable[..., Result]


@pytest.fixture
def call(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> Call:
    """Run a command in the folder that holds phongbench-runs."""
    monkeypatch.chdir(tmp_path)
    return lambda *words: CliRunner().invoke(main, list(words))


def test_a_front_is_told_with_states_codes_and_intervals(call: Call, stored: Callable[..., Run]) -> None:
    stored(RUN)
    found = call("front", RUN, "--alpha", "50")
    assert found.exit_code == 0, found.stderr
    for word in ("lyon:dot:8", "on", "8-bit codes", "0.238 .. 0.242"):
        assert word in found.stdout
    assert "--all shows them" in found.stderr
    assert "off" in call("front", "latest", "--alpha", "50", "--all").stdout.split()


def test_a_front_as_json_holds_every_point(call: Call, stored: Callable[..., Run]) -> None:
    run = stored(RUN)
    told = json.loads(call("front", "latest", "--alpha", "10..50", "--metric", "rms", "--json").stdout)
    assert told["alphas"] == [10.0, 50.0]
    assert {p["state"] for p in told["points"]} <= {"on", "off", "unresolved"}
    rows = run.accuracy
    gaussian = next(p for p in told["points"] if p["approximation"] == "gaussian" and p["lambda_form"] == "dot")
    mine = rows[(rows["approximation"] == "gaussian") & (rows["lambda_form"] == "dot") & rows["gated"]]
    mine = mine[(mine["stratum"] == "highlight") & (mine["precision"] == "float32") & (mine["space"] == "reflect")]
    assert gaussian["error"] == mine["rms"].max()
    assert gaussian["gamma"] is None


def test_an_error_of_zero_is_kept_and_shown(call: Call, stored: Callable[..., Run], small_rows: Any) -> None:
    rows = small_rows.copy()
    rows.loc[rows["approximation"] == "phong", "max_abs"] = 0.0
    stored(RUN, accuracy=rows)
    told = json.loads(call("front", "latest", "--alpha", "50", "--json").stdout)
    phong = next(p for p in told["points"] if p["approximation"] == "phong")
    assert (phong["error"], phong["state"]) == (0.0, "on")
    line = next(line for line in call("front", "latest", "--alpha", "50").stdout.splitlines() if "phong" in line)
    assert line.split()[1:3] == ["0", "0"]


def test_float16_has_the_times_of_float32_and_says_so(call: Call, stored: Callable[..., Run]) -> None:
    stored(RUN)
    found = call("front", "latest", "--alpha", "50", "--precision", "float16")
    assert found.exit_code == 0
    assert "times are those of float32" in found.stderr


def test_recommend_names_a_formula_and_why(call: Call, stored: Callable[..., Run]) -> None:
    stored(RUN)
    found = call("recommend", "--alpha", "50", "--max-error", "0.05")
    assert found.exit_code == 0, found.stderr
    assert "lyon:dot:8" in found.stdout
    assert "at alpha 50, proven" in found.stdout
    assert f"from {RUN}" in found.stdout
    told = json.loads(call("recommend", "--alpha", "50", "--max-error", "1/20", "--run", RUN, "--json").stdout)
    assert told["max_error"] == 0.05
    assert told["choices"][0]["gamma"] == 8


def test_the_command_that_recommend_gives_writes_its_choice_as_code(call: Call) -> None:
    ask = ["recommend", "--alpha", "33.3", "--max-error", "0.02"]
    best = json.loads(call(*ask, "--json").stdout)["choices"][0]
    [line] = [one for one in call(*ask).stdout.splitlines() if one.startswith("as code: ")]
    written = json.loads(call(*shlex.split(line)[3:], "--json").stdout)
    assert written["formula"] == best["approximation"]
    assert written["max_error"] <= 0.02
    assert "as code" not in call("recommend", "--alpha", "20..50", "--max-error", "0.02").stdout


def test_recommend_exits_with_1_and_the_nearest_miss_where_nothing_fits(call: Call, stored: Callable[..., Run]) -> None:
    stored(RUN)
    found = call("recommend", "--alpha", "50", "--max-error", "1e-12")
    assert found.exit_code == 1
    assert "nothing meets the budget" in found.stdout
    assert "nearest miss" in found.stdout
    told = json.loads(call("recommend", "--alpha", "50", "--max-error", "1e-12", "--json").stdout)
    assert told["choices"] == []


def test_recommend_without_a_run_answers_from_the_laws_and_says_so(call: Call) -> None:
    found = call("recommend", "--alpha", "50", "--max-error", "1/255")
    assert found.exit_code == 0, found.stderr
    assert "from the laws alone" in found.stdout
    assert "phongbench run --alpha 50" in found.stdout


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["front", "latest", "--alpha", "51"], 2, "known: 10, 50"),
        (["front", "latest", "--alpha", "60..70"], 2, "known: 10, 50"),
        (["front", "latest", "--alpha", "ten"], 2, "10..200"),
        (["front", "latest"], 2, "--alpha"),
        (["front", "none", "--alpha", "50"], 2, "no run 'none'"),
        (["front", "latest", "--alpha", "50", "--metric", "maxabs"], 2, "did you mean 'max_abs'"),
        (["front", "latest", "--alpha", "50", "--stratum", "high"], 2, "highlight"),
        (["front", "latest", "--alpha", "50", "--precision", "half"], 2, "known: float16"),
        (["front", "latest", "--alpha", "50", "--working-set", "l3"], 2, "known: l1"),
        (["front", "latest", "--alpha", "50", "--space", "x"], 2, "reflect"),
        (["recommend", "--alpha", "50", "--max-error", "0"], 2, "above 0"),
        (["recommend", "--alpha", "50", "--max-error", "1/0"], 2, "1/255"),
        (["recommend", "--alpha", "200", "--max-error", "0.1"], 2, "phongbench run --alpha 200"),
        (["recommend", "--alpha", "50", "--max-error", "0.1", "--run", "none"], 2, "no run 'none'"),
        (
            ["recommend", "--alpha", "50", "--max-error", "0.1", "--length-error", "1"],
            2,
            "measured are 0.1, as at a mesh angle of 51.7 degrees, not 1",
        ),
        (["bench", "--peers", "nunpy"], 2, "did you mean 'numpy'"),
        (["bench", "--budget", "0"], 2, "is no time"),
    ],
)
def test_bad_input_gets_an_exit_code_and_a_short_message(
    call: Call, stored: Callable[..., Run], words: list[str], code: int, said: str
) -> None:
    stored(RUN)
    found = call(*words)
    assert found.exit_code == code, found.output
    assert said in found.stderr
    assert "Traceback" not in found.stderr
    assert found.stdout == ""


def test_a_run_without_times_says_which_flags_give_them(call: Call, stored: Callable[..., Run]) -> None:
    stored(RUN, timed=False)
    found = call("front", "latest", "--alpha", "50")
    assert found.exit_code == 2
    assert "--no-timing" in found.stderr
    assert "--timing-budget" in found.stderr


def test_a_changed_byte_is_refused(call: Call, stored: Callable[..., Run]) -> None:
    path = stored(RUN).path / "accuracy.parquet"
    data = bytearray(path.read_bytes())
    data[100] ^= 4
    path.write_bytes(data)
    for words in (["front", RUN, "--alpha", "50"], ["recommend", "--alpha", "50", "--max-error", "0.1"]):
        found = call(*words)
        assert found.exit_code == 6
        assert "bytes have changed" in found.stderr
