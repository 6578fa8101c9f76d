"""What moved between two ledgers: nothing of one against itself, a planted factor, and never between machines."""

from dataclasses import replace

import pytest

from phongbench.analysis.compare_ledgers import compare_ledgers
from phongbench.errors import InputError
from phongbench.results.ledgers import Entry, Ledger

HERE = {"machine_fingerprint": "m", "code": "c", "machine": {"cpu": "a processor"}}
ENTRIES = tuple(
    Entry("kernel", name, "l2", 0.4 * ratio, "ns", "adding", ratio, 0.99 * ratio, 1.01 * ratio, 24)
    for name, ratio in (("exact Phong", 2.5), ("Gaussian", 1.5), ("Lyon", 1.2))
)
LEDGER = Ledger("20261130-101500", HERE, ENTRIES)


def slower(ledger: Ledger, name: str, factor: float) -> Ledger:
    """The ledger in which this one takes so many times as long."""
    changed = tuple(
        replace(e, ratio=factor * e.ratio, ratio_low=factor * e.ratio_low, ratio_high=factor * e.ratio_high)
        if e.name == name and e.ratio_low is not None and e.ratio_high is not None
        else e
        for e in ledger.entries
    )
    return replace(ledger, entries=changed)


def test_a_ledger_against_itself_moved_nothing() -> None:
    found = compare_ledgers(LEDGER, LEDGER)
    assert [(row["ratio"], row["verdict"]) for row in found["rows"]] == [(1.0, "unresolved")] * len(ENTRIES)
    assert (found["only_a"], found["only_b"]) == ([], [])


def test_a_faster_machine_moves_nothing_since_only_ratios_count() -> None:
    quick = replace(LEDGER, entries=tuple(replace(e, value=e.value / 3) for e in ENTRIES))
    assert {row["verdict"] for row in compare_ledgers(LEDGER, quick)["rows"]} == {"unresolved"}


@pytest.mark.parametrize(("factor", "told"), [(1.5, "slower"), (0.5, "faster"), (1.015, "unresolved")])
def test_a_planted_factor_is_found_where_it_is_planted(factor: float, told: str) -> None:
    first, *others = compare_ledgers(LEDGER, slower(LEDGER, "Gaussian", factor))["rows"]
    assert {row["verdict"] for row in others} == {"unresolved"}
    if told != "unresolved":
        assert (first["name"], first["verdict"]) == ("Gaussian", told)
        assert first["ratio"] == pytest.approx(factor)
        assert first["ratio_low"] == pytest.approx(factor * 0.99 / 1.01)
        assert first["ratio_high"] == pytest.approx(factor * 1.01 / 0.99)
    else:
        assert first["verdict"] == told


def test_there_and_back_is_one() -> None:
    changed = slower(slower(LEDGER, "Gaussian", 1.7), "Lyon", 0.6)
    there, back = ({r["name"]: r for r in compare_ledgers(*p)["rows"]} for p in ((LEDGER, changed), (changed, LEDGER)))
    for name, row in there.items():
        assert row["ratio"] * back[name]["ratio"] == pytest.approx(1)
        assert row["ratio_low"] * back[name]["ratio_high"] == pytest.approx(1)


@pytest.mark.parametrize("small", [0, 1], ids=["before", "after"])
def test_what_has_no_interval_is_compared_and_decides_nothing(small: int) -> None:
    few = replace(LEDGER, entries=tuple(replace(e, ratio_low=None, ratio_high=None, rounds=3) for e in ENTRIES))
    many = slower(LEDGER, "Gaussian", 9.0)
    found = compare_ledgers(*((few, many) if small == 0 else (many, few)))["rows"]
    assert {row["verdict"] for row in found} == {"unresolved"}
    assert {(row["ratio_low"], row["ratio_high"]) for row in found} == {(None, None)}
    assert sorted(row["ratio"] for row in found)[-1 if small == 0 else 0] == pytest.approx(9.0 if small == 0 else 1 / 9)


def test_what_only_one_has_is_named() -> None:
    found = compare_ledgers(replace(LEDGER, entries=ENTRIES[:2]), replace(LEDGER, entries=ENTRIES[1:]))
    assert [row["name"] for row in found["rows"]] == ["Gaussian"]
    assert [key["name"] for key in found["only_a"]] == ["exact Phong"]
    assert [key["name"] for key in found["only_b"]] == ["Lyon"]


def test_another_yardstick_is_another_entry() -> None:
    other = replace(LEDGER, entries=tuple(replace(e, over="multiplying") for e in ENTRIES))
    assert compare_ledgers(LEDGER, other)["rows"] == []


@pytest.mark.parametrize(
    ("there", "told"),
    [({"machine": {"cpu": "another"}}, "a processor and another"), ({}, "of other cores, caches or vectors")],
)
def test_ledgers_of_other_machines_are_refused(there: dict[str, object], told: str) -> None:
    elsewhere = replace(LEDGER, provenance={**HERE, **there, "machine_fingerprint": "n"})
    with pytest.raises(InputError, match="different machines") as found:
        compare_ledgers(LEDGER, elsewhere, second="after.json")
    assert told in found.value.what
    assert found.value.where == "after.json"
    assert "bench --out" in str(found.value.fix)
