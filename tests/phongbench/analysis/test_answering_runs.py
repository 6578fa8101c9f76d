"""Which stored run answers a budget, and what of it may be said."""

from collections.abc import Callable
from typing import Any

import pytest

from phongbench.analysis.front import points
from phongbench.analysis.recommend import recommend
from phongbench.errors import CorruptRunError, InputError
from phongbench.results.answering import run_for
from phongbench.results.records import Records
from phongbench.results.runs import Run

Stored = Callable[..., Run]


def test_a_run_that_told_its_twin_apart_makes_no_claim(stored: Stored, monkeypatch: pytest.MonkeyPatch) -> None:
    run = stored()
    timing = run.timing.copy()
    timing.loc[timing["approximation"] == "aa-twin", "verdict"] = "slower"
    monkeypatch.setitem(run._records, "timing", Records.of(timing))
    assert any("identical code" in n for n in recommend(run, alpha=50, max_error=0.05)["notes"])


def test_a_run_of_another_machine_answers_in_ratios_only(stored: Stored) -> None:
    run = stored(provenance={"machine_fingerprint": "another"})
    found = recommend(run, alpha=50, max_error=0.05)
    assert found["choices"][0]["ns"] is None
    assert found["choices"][0]["ratio"] == pytest.approx(0.24)
    assert any("another kind of machine" in note for note in found["notes"])
    told = points(run, alpha=50)
    assert not told["same_machine"]
    assert {p["ns"] for p in told["points"]} == {None}


def test_the_newest_whole_run_with_times_answers(stored: Stored, tmp_path: Any) -> None:
    root = tmp_path / "phongbench-runs"
    assert run_for(None, root) is None
    stored("20260101-000000-0123abcd")
    stored("20260102-000000-0123abcd")
    stored("20260103-000000-0123abcd", timed=False)
    stored("20260104-000000-0123abcd", state="partial")
    found = run_for(None, root)
    assert found is not None
    assert found.id == "20260102-000000-0123abcd"
    assert run_for("20260103-000000-0123abcd", root) is not None


def test_untimed_partial_and_changed_runs_are_refused(stored: Stored) -> None:
    with pytest.raises(InputError, match="without --no-timing"):
        recommend(stored("20260101-000000-0123abcd", timed=False), alpha=50, max_error=0.05)
    with pytest.raises(InputError, match="--resume"):
        recommend(stored("20260102-000000-0123abcd", state="partial"), alpha=50, max_error=0.05)
    run = stored("20260103-000000-0123abcd")
    path = run.path / "timing.parquet"
    path.write_bytes(path.read_bytes()[:-1] + b"?")
    with pytest.raises(CorruptRunError, match="bytes have changed"):
        points(run, alpha=50)
