"""Answers as tables: what is measured and what is counted have other heads, and numbers stand under them."""

from typing import Any

import pytest

from phongbench.cli.answer_tables import claims_table, material_table, recommendation

TIMED = {"name": "lyon:dot:8", "beta": 6.25, "bound": 0.01, "coverage": "certified", "ratio": 0.25, "why": "it fits"}
TIMED |= {"cost_kind": "measured", "ratio_low": 0.24, "ratio_high": 0.26}
COUNTED = TIMED | {"cost_kind": "compiled", "cost": 4.0, "unit": "cycles"}
ANSWER: dict[str, Any] = {"max_error": 0.02, "alpha": "50", "precision": "float64", "verdict": "ship it", "run": None}
ANSWER |= {"nearest_miss": None, "notes": [], "material": "gold", "target": "cpu"}


@pytest.mark.parametrize(
    ("choice", "head", "cost"),
    [(TIMED, "time / exact Phong", "0.24 .. 0.26"), (COUNTED, "cost / exact Phong", "4 cycles")],
)
def test_the_columns_of_a_recommendation_are_those_of_a_time_or_of_a_cost(
    capsys: pytest.CaptureFixture[str], choice: dict[str, Any], head: str, cost: str
) -> None:
    recommendation(ANSWER | {"choices": [choice], "target": "cpu" if choice is TIMED else "rdna2"})
    title, heads, *rows = capsys.readouterr().out.splitlines()
    assert title.endswith("float64" if choice is TIMED else "float64, rdna2")
    (row,) = [row for row in rows if row.startswith("best ")]
    assert head in heads
    assert row.index(" 0.25 ") + len(" 0.25") == heads.index(head) + len(head)  # under the end of its head
    assert row.endswith(cost)


@pytest.mark.parametrize("others", [(), ("rdna2",)])
def test_materials_name_their_target_where_there_are_several(
    capsys: pytest.CaptureFixture[str], others: tuple[str, ...]
) -> None:
    answers = [ANSWER | {"target": target, "choices": [TIMED]} for target in ("cpu", *others)]
    material_table({"materials": answers})
    _, heads, first, *_ = capsys.readouterr().out.splitlines()
    assert heads.split()[:2] == ["material", "target" if others else "alpha"]
    assert first.split()[:2] == ["gold", "cpu" if others else "50"]


@pytest.mark.parametrize("verbose", [False, True])
def test_claims_tell_whole_reasons_or_how_to_see_them(capsys: pytest.CaptureFixture[str], verbose: bool) -> None:
    claim = {"key": "a", "verdict": "holds", "claim": "It is so", "because": "All of it", "brief": "In short"}
    claims_table({"run": "mine", "claims": [claim | {"lacking": None}]}, verbose=verbose)
    told = capsys.readouterr()
    assert ("All of it" in told.out, "In short" in told.out) == (verbose, not verbose)
    assert ("--verbose" in told.err) == (not verbose)
    assert "1 holds" in told.err
