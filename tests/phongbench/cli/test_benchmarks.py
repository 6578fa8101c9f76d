"""`phongbench bench` prints and keeps what it measured, and `compare` tells what moved between two ledgers."""

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from made_up_bench import BENCH

from phongbench.cli.main import main
from phongbench.results import ledgers

Call = Callable[..., Any]


@pytest.fixture
def call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Call:
    """Run a command in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    return lambda *words: CliRunner().invoke(main, list(words))


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """What the next `bench` measures."""
    answer = copy.deepcopy(BENCH)

    def measure(names: tuple[str, ...], *, studies: int, **_: Any) -> dict[str, Any]:
        return answer | {"names": names, "studies": studies}

    monkeypatch.setattr("phongbench.benchmarks.ledger.measure", measure)
    return answer


@pytest.mark.usefixtures("measured")
def test_bench_prints_tables_who_is_absent_and_where_its_ledger_is(call: Call) -> None:
    told = call("bench", "--peers", "numpy,torch", "--studies", "0")
    assert told.exit_code == 0, told.stderr
    for words in (
        "2.8 .. 3",
        "torch is absent: not installed",
        "0.50 billion",
        "50 times plain NumPy (49 .. 51)",
        "picture of many-lights",
        "the whole command",
        "note: 8 rounds only",
        "ledger: phongbench-runs/ledgers/",
    ):
        assert words in told.stdout
    file = Path(told.stdout.split("ledger: ")[1].strip())
    assert len(ledgers.read(file).entries) == len([*BENCH["ours"], *BENCH["calls"], *BENCH["stages"], "the sweep"])


@pytest.mark.usefixtures("measured")
def test_bench_answers_as_json_and_says_which_file_it_wrote(call: Call) -> None:
    told = json.loads(call("bench", "--peers", "numpy", "--json", "--out", "here.json").stdout)
    assert (told["names"], told["ledger"], told["studies"]) == (["numpy"], "here.json", 1)
    assert json.loads(Path("here.json").read_text())["ledger"] == ledgers.SCHEMA


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("bench", "--out", "table.csv"), "name it table.json"),
        (("bench", "--out", "."), "a ledger is a JSON file"),
        (("compare", "a.json", "latest"), "one is a ledger and the other a run"),
        (("compare", "a.json", "none.json"), "cannot read the ledger"),
        (("compare", "a.json", "a.json", "--metric", "rms"), "--metric and --tolerance are of runs"),
        (("compare", "a.json", "broken.json"), "not valid JSON"),
    ],
)
@pytest.mark.usefixtures("measured")
def test_what_cannot_be_is_refused_before_anything_is_measured(
    call: Call, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], told: str
) -> None:
    call("bench", "--out", "a.json")
    Path("broken.json").write_text("{")
    monkeypatch.setattr("phongbench.benchmarks.ledger.measure", lambda *_, **__: pytest.fail("it measures"))
    found = call(*words)
    assert found.exit_code == 2
    assert told in found.stderr


def test_compare_tells_what_moved_and_that_it_may_by_chance(call: Call, measured: dict[str, Any]) -> None:
    call("bench", "--out", "a.json")
    scene = measured["calls"][1]
    for name in ("ratio", "ratio_low", "ratio_high"):
        scene[name] *= 1.5
    call("bench", "--out", "b.json")
    told = call("compare", "a.json", "b.json")
    assert told.exit_code == 0, told.stderr
    assert "picture of many-lights" in told.stdout
    assert "1.4 .. 1.61" in told.stdout
    assert "98 % interval" in told.stdout
    assert "1 of 6 times moved by 2 % or more" in told.stdout
    assert "2 were measured too few times" in told.stdout
    found = json.loads(call("compare", "a.json", "b.json", "--json").stdout)
    assert [row["verdict"] for row in found["rows"]] == ["slower", *["unresolved"] * 5]
    assert "0 of 6 times moved" in call("compare", "a.json", "a.json").stdout


def test_a_changed_ledger_is_corrupt(call: Call, measured: dict[str, Any]) -> None:
    call("bench", "--out", "a.json")
    Path("a.json").write_text(Path("a.json").read_text().replace('"rounds": 24', '"rounds": 25'))
    found = call("compare", "a.json", "a.json")
    assert found.exit_code == 6
    assert "has changed" in found.stderr
