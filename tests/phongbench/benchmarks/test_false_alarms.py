"""False alarms on identical code are counted; how many there are is for `doctor --timing` to say, not for a test."""

import tempfile
from pathlib import Path

import pytest

from phongbench.benchmarks import false_alarms
from phongbench.compiler import jit
from phongbench.errors import UnknownNameError

compiled_only = pytest.mark.skipif(jit.DISABLED, reason="plain Python is not timed")


@pytest.fixture(autouse=True)
def own_lock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))


@compiled_only
def test_each_repeat_is_a_measurement_of_its_own() -> None:
    told: list[int] = []
    (found,) = false_alarms.count(5, rounds=8, progress=lambda done, total, text: told.append(done))
    assert told == [1, 2, 3, 4, 5]
    assert (found.working_set, found.repeats, found.rounds) == ("l1", 5, 8)
    assert 0 <= found.resolved <= found.outside <= 5


def test_the_bar_is_one_in_a_hundred() -> None:
    good, bad = (false_alarms.Alarms("l1", 200, 24, resolved, resolved, 0.01, 1.0).as_dict() for resolved in (2, 3))
    assert good["good"]
    assert not bad["good"]
    assert good["share"] == 0.01


def test_an_unknown_working_set_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="working set"):
        false_alarms.count(5, working_sets=("l9",))
