"""Two ledgers beside one another, as people read them."""

from typing import Any

import pytest

from phongbench.cli.bench_tables import ledger_tables

ENTRY: dict[str, Any] = {"name": "lyon:dot:8", "place": "l1", "over": "phong", "before": 0.5, "after": 0.25}
ENTRY |= {"ratio": 0.5, "ratio_low": 0.49, "ratio_high": 0.51}
ANSWER = {"level": 0.98, "machine": "a machine", "only_a": [], "only_b": []}


@pytest.mark.parametrize(("verdict", "moved"), [("faster", 1), ("unresolved", 0)])
def test_only_times_that_moved_make_a_table(capsys: pytest.CaptureFixture[str], verdict: str, moved: int) -> None:
    ledger_tables(ANSWER | {"rows": [ENTRY | {"verdict": verdict}]})
    said = capsys.readouterr().out
    assert ("What moved, a machine" in said) == ("0.49 .. 0.51" in said) == bool(moved)
    assert f"{moved} of 1 times moved" in said
    assert "only" not in said


@pytest.mark.parametrize("side", ["a", "b"])
def test_what_one_ledger_alone_has_is_told_with_its_side(capsys: pytest.CaptureFixture[str], side: str) -> None:
    ledger_tables(ANSWER | {"rows": [], f"only_{side}": [ENTRY, ENTRY | {"name": "phong"}]})
    assert capsys.readouterr().out.splitlines()[1:] == [f"only {side.upper()} has lyon:dot:8 l1, phong l1"]
