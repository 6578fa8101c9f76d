"""What leaving normalising out saves, and claims c, d, e and h with that in their verdict."""

from typing import Any

import numpy as np
import pytest
from claim_tables import CODE, Tables, accuracy, judged, meshes, table, timing

from phongbench.analysis.normalising_cost import FROM_N_L_V, FROM_PAIR, answer, races, timing_rows
from phongbench.analysis.rows import Rows
from phongbench.formulas.formula import Formula

RAW_PAIRS = (FROM_PAIR, FROM_N_L_V)


def times(ratios: dict[str, float], place: str = "l1", **more: Any) -> list[dict[str, Any]]:
    """A timing row for each spelling."""
    rows = []
    for spelling, ratio in ratios.items():
        f = Formula.parse(spelling)
        key = {"approximation": f.approximation, "lambda_form": f.lambda_form, "space": f.space, "gamma": f.gamma}
        raw = {"recipe": f.recipe, "normalise": f.normalise, "working_set": place, "ns_min": 2 * ratio}
        rows.append(key | raw | {"ratio": ratio} | more)
    return rows


def study(*rows: dict[str, Any], twin: str = "unresolved") -> Rows:
    twins = [{"approximation": "aa-twin", "working_set": "l1", "verdict": twin}]
    return Rows(Tables(timing=timing([*rows, *twins]), accuracy=accuracy([{}])))


def test_a_race_is_the_quotient_and_its_interval_all_that_both_allow() -> None:
    (race,) = races(study(*times({"lyon:cross:8": 0.4, "phong/once": 1.6})), [FROM_PAIR])
    assert (race.one, race.other, race.target, race.working_set) == (*FROM_PAIR, "cpu", "l1")
    assert race.ratio == pytest.approx(0.25)
    assert race.ratio_low == pytest.approx(0.25 * 0.99 / 1.01)
    assert race.ratio_high == pytest.approx(0.25 * 1.01 / 0.99)
    assert (race.ns, race.other_ns) == (0.8, 3.2)
    assert race.verdict == "faster"


def test_the_interval_encloses_every_quotient_of_values_in_both() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        (a, b), (c, d) = np.sort(rng.uniform(0.1, 3.0, (2, 2)), axis=1)
        ends = [{"ratio_low": a, "ratio_high": b}, {"ratio_low": c, "ratio_high": d}]
        rows = [
            row | end
            for row, end in zip(times({"lyon:cross:8": (a + b) / 2, "phong/once": (c + d) / 2}), ends, strict=True)
        ]
        (race,) = races(study(*rows), [FROM_PAIR])
        drawn = rng.uniform(a, b, 99) / rng.uniform(c, d, 99)
        assert race.ratio_low <= drawn.min()
        assert drawn.max() <= race.ratio_high


def test_the_baselines_ratio_is_1_whatever_its_row_tells() -> None:
    rows = times({"phong": 1.0, "phong/once": 1.5}, ratio_low=0.5, ratio_high=2.0)
    (race,) = races(study(*rows), [("phong", "phong/once")])
    assert (race.ratio_low, race.ratio_high) == (0.5, 2.0)


@pytest.mark.parametrize(("ratio", "verdict"), [(0.5, "faster"), (1.5, "slower"), (1.0, "unresolved")])
def test_each_working_set_has_its_own_verdict(ratio: float, verdict: str) -> None:
    both = {"lyon:cross:8": ratio, "phong/once": 1.0}
    (here, there) = races(study(*times(both), *times({"lyon:cross:8": 1.5, "phong/once": 1.0}, "memory")), [FROM_PAIR])
    assert (here.working_set, here.verdict) == ("l1", verdict)
    assert (there.working_set, there.verdict) == ("memory", "slower")


def test_nothing_is_settled_where_identical_code_differed() -> None:
    (race,) = races(study(*times({"lyon:cross:8": 0.1, "phong/once": 1.0}), twin="slower"), [FROM_PAIR])
    assert race.verdict == "unresolved"


def test_what_was_not_timed_or_has_no_interval_is_left_out() -> None:
    assert races(study(*times({"lyon:cross:8": 0.4})), RAW_PAIRS) == []
    endless = times({"lyon:cross:8": 0.4, "phong/once": 1.0}, ratio_high=np.inf)
    assert races(study(*endless), RAW_PAIRS) == []
    assert races(Rows(Tables(accuracy=accuracy([{}]))), RAW_PAIRS) == []
    threads = times({"lyon:cross:8": 0.4, "phong/once": 1.0}, threads=2)
    assert races(study(*threads), RAW_PAIRS) == []


def test_other_precisions_do_not_mix() -> None:
    rows = [*times({"lyon:cross:8": 0.4}), *times({"phong/once": 1.0}, precision="float64")]
    assert races(study(*rows), [FROM_PAIR]) == []
    both = [*times({"lyon:cross:8": 0.4, "phong/once": 1.0}), *times({"lyon:cross:8": 0.9}, precision="float64")]
    assert races(study(*both), [FROM_PAIR])[0].ratio == pytest.approx(0.4)


def test_a_table_of_a_run_made_before_recipes_has_pairs_only() -> None:
    old = timing(times({"lyon:cross:8": 0.4, "phong": 1.0})).drop(columns=["recipe", "normalise"])
    rows = Rows(Tables(timing=old, accuracy=accuracy([{}])))
    (race,) = races(rows, [("lyon:cross:8", "phong"), FROM_PAIR])
    assert race.ratio == pytest.approx(0.4)


def test_the_rows_behind_a_race_are_found_again() -> None:
    rows = study(*times({"lyon:cross:8": 0.4, "phong/once": 1.6, "phong/each": 2.0, "lyon:dot:8": 0.3}))
    assert sorted(timing_rows(rows, races(rows, [FROM_PAIR]))["ratio"]) == [0.4, 1.6]


def test_the_answer_says_where_cross_is_faster_and_where_not() -> None:
    l1 = times({"lyon:cross:8": 0.4, "phong/once": 1.6, "lyon:cross:8@lengthwise": 1.0, "phong@lengthwise/once": 1.0})
    said = answer(study(*l1, *times({"lyon:cross:8": 1.5, "phong/once": 1.0}, "memory")))
    assert "given R and V, yes in l1, no in memory: lyon:cross:8 takes 0.25 (0.245 .. 0.255)" in said["sentence"]
    assert "from N, L and V, not settled in l1" in said["sentence"]
    assert [(one["way"], one["working_set"]) for one in said["races"]] == [
        ("given R and V", "l1"),
        ("given R and V", "memory"),
        ("from N, L and V", "l1"),
    ]
    assert (said["precision"], said["target"]) == ("float32", "cpu")
    assert answer(Rows(Tables(accuracy=accuracy([{}]))))["sentence"] == "This was not timed."


# in the verdicts

LESS = [
    {
        "alpha": 10.0,
        "length_error": 0.01,
        "perturbation": "a",
        "stratum": "lengths",
        "lambda_form": form,
        "length_max": v,
    }
    for form, v in {"dot": 0.1, "cross": 0.02, "difference": 0.03}.items()
]
FINE = [
    {"alpha": 10.0, "edge_degrees": edge, "length_max": most}
    for edge, most in ((1.0, 0.0), (12.0, 0.9 * CODE), (20.0, 5 * CODE))
]
ROOTS = [LESS[1] | {"perturbation": "rsqrt-12", "length_error": 0.0, "length_max": 0.0}]
#: claim -> tables by which it holds, and what is timed: what follows the advice, and what it should save time against
PRICED = {
    "c": ({"accuracy": accuracy(LESS)}, [FROM_PAIR]),
    "d": ({"accuracy": accuracy([{}]), "meshes": meshes(FINE)}, RAW_PAIRS),
    "e": ({"accuracy": accuracy(ROOTS)}, [("lyon:cross:8/fast", "lyon:cross:8/each"), ("phong/fast", "phong/each")]),
}


def timed(pairs: Any, ratio: float, place: str = "l1") -> list[dict[str, Any]]:
    return [row for one, other in pairs for row in times({one: ratio, other: 1.0}, place)]


@pytest.mark.parametrize("key", PRICED)
def test_advice_that_saves_no_time_holds_under_conditions(key: str) -> None:
    tables, pairs = PRICED[key]
    assert judged(key, **tables)["verdict"] == "holds", "without times its errors decide"
    quick = judged(key, **tables, timing=timing(timed(pairs, 0.5)))
    assert quick["verdict"] == "holds"
    assert "On the cpu" in quick["because"]
    assert [one["target"] for one in quick["conditions"] if "target" in one] == ["cpu"] * len(pairs)
    assert sum(row["table"] == "timing" for row in quick["evidence"]) == 2 * len(pairs)
    for slow in (timed(pairs, 1.0), timed(pairs, 0.5) + timed(pairs[:1], 1.1, "memory")):
        assert judged(key, **tables, timing=timing(slow))["verdict"] == "holds under conditions"


@pytest.mark.parametrize("key", PRICED)
def test_a_twin_told_apart_leaves_the_verdict_to_the_errors(key: str) -> None:
    tables, pairs = PRICED[key]
    twin = {"approximation": "aa-twin", "verdict": "faster"}
    found = judged(key, **tables, timing=timing([*timed(pairs, 1.5), twin]))
    assert found["verdict"] == "holds"
    assert "cpu" not in found["because"]


def test_no_time_rescues_a_claim_that_fails() -> None:
    rows = accuracy([row | {"length_max": 0.5} for row in LESS])
    assert judged("c", accuracy=rows, timing=timing(timed([FROM_PAIR], 0.1)))["verdict"] == "fails"


def test_a_power_is_replaced_where_lengths_are_removed_too() -> None:
    plain = times({"lyon:dot:8": 0.3, "lyon:cross:8": 0.3, "phong": 1.0})
    assert judged("h", accuracy=accuracy([{}]), timing=timing(plain))["verdict"] == "holds"
    for ratio, verdict in ((0.5, "holds"), (0.975, "holds under conditions")):
        raw = times({"lyon:cross:8/once": ratio, "phong/once": 1.0, "lyon:cross:8/each": 0.6, "phong/each": 1.0})
        found = judged("h", accuracy=accuracy([{}]), timing=timing(plain + raw))
        assert found["verdict"] == verdict
        assert f"surely faster in {1 + (ratio < 0.9)} of 2 cases" in found["because"]


# f: Blinn at infinity, from a raw normal


def far(blinn: float, phong: float, **more: Any) -> list[dict[str, Any]]:
    """Times of kernels with one L and V for all: of Blinn's power, and of Phong's in both ways."""
    ratios = {"blinn@halfway/once": blinn, "phong@reflect": phong, "phong@lengthwise/once": phong + 0.2}
    return [row | {"approximation": f"far-{row['approximation']}"} for row in times(ratios, **more)]


@pytest.mark.parametrize(
    ("blinn", "phong", "verdict"),
    [
        (1.0, 1.5, "holds"),
        (1.0, 0.9, "holds under conditions"),
        (1.0, 0.7, "fails"),
        (1.0, 1.01, "holds under conditions"),
    ],
)
def test_blinn_from_a_raw_normal_is_judged_against_each_way_to_phong(blinn: float, phong: float, verdict: str) -> None:
    near = times({"blinn@halfway/once": 3.0, "phong@reflect": 2.0, "phong": 1.0})
    found = judged("f", timing=timing([*far(blinn, phong), *near]), accuracy=accuracy([{}]))
    assert found["verdict"] == verdict
    assert f"far-blinn@halfway/once takes {blinn / phong:.3g}" in found["because"]
    assert "blinn@halfway/once takes 1.5" in found["because"]  # near, from raw N, L and V
    assert {row["approximation"] for row in found["evidence"]} == {"far-blinn", "far-phong", "blinn", "phong"}


def test_normalising_limits_what_shading_at_infinity_says() -> None:
    from test_speed import shaded

    for phong, verdict in ((1.5, "holds"), (0.8, "holds under conditions")):
        rows = timing(far(1.0, phong))
        found = judged("f", timing=rows, scene_times=table("scene_times", shaded(0.9, 1.1)), accuracy=accuracy([{}]))
        assert found["verdict"] == verdict
