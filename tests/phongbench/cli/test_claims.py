"""`phongbench claims` as a user meets it."""

import json
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


def test_claims_are_told_with_verdict_reason_and_what_would_measure_them(call: Call, stored: Any) -> None:
    stored(RUN)
    found = call("claims", "latest")
    assert found.exit_code == 0, found.stderr
    for word in ("holds under conditions", "not measured", "2 exponents are too few", "faster", "phongbench run"):
        assert word in found.stdout
    assert "at most 1/255" in call("claims", "latest", "--verbose").stdout
    assert RUN in found.stderr


def test_claims_as_json_hold_rule_conditions_and_evidence(call: Call, stored: Any) -> None:
    stored(RUN)
    told = json.loads(call("claims", RUN, "--json").stdout)
    assert told["run"] == RUN
    first = told["claims"][0]
    assert (first["verdict"], first["lacking"] is None) == ("not measured", False)  # by two exponents
    assert first["conditions"]
    assert first["evidence"][0]["table"] == "accuracy"
    assert first["rule"].startswith("Lyon's formula")


def test_a_run_without_the_rows_says_which_flags_give_them(
    call: Call, stored: Callable[..., Run], small_rows: Any
) -> None:
    stored(RUN, accuracy=small_rows[small_rows["approximation"] == "phong"], timed=False)
    found = call("claims", RUN)
    assert found.exit_code == 2
    assert "phongbench run" in found.stderr
    assert found.stdout == ""


@pytest.mark.parametrize(("words", "said"), [(["claims"], "RUN"), (["claims", "none"], "no run 'none'")])
def test_bad_input_gets_a_short_message(call: Call, stored: Callable[..., Run], words: list[str], said: str) -> None:
    stored(RUN)
    found = call(*words)
    assert found.exit_code == 2
    assert said in found.stderr
    assert "Traceback" not in found.stderr
