"""Claims f and h on the targets that are compiled for: which formula costs less where, by counts."""

from typing import Any

import pandas as pd
import pytest
from claim_tables import judged, timing

from phongbench.formulas.formula import Formula
from phongbench.results.schema import RAW, TABLES

#: the cost over exact Phong's on two targets
COSTS = {
    "phong": (1.0, 1.0), "lyon:dot:8": (0.6, 1.1), "phong/once": (2.0, 2.0), "lyon:dot:8/once": (1.5, 1.99),
    "phong@reflect": (3.0, 3.0), "blinn": (1.0, 1.2), "blinn@halfway/once": (4.0, 2.0),
}  # fmt: skip


def costs(ratios: dict[str, tuple[float, ...]], targets: tuple[str, ...] = ("gcn4", "rdna2")) -> pd.DataFrame:
    rows: list[dict[str, Any]] = []
    for spelling, each in ratios.items():
        f = Formula.parse(spelling)
        named = {"approximation": f.approximation, "lambda_form": f.lambda_form, "space": f.space, "gamma": f.gamma}
        named |= RAW | {"recipe": f.recipe, "normalise": f.normalise, "beta_policy": f.slope, "precision": "float32"}
        for target, ratio in zip(targets, each, strict=True):
            usual = {
                "target": target,
                "cost_kind": "compiled",
                "alpha": 50.0,
                "context": 0,
                "reads": 0,
                "unit": "cycles",
            }
            rows += [usual | named | {"ratio": ratio}, usual | named | {"ratio": 1.0, "context": 128}]
    return TABLES["costs"].frame(rows)


def times(lyon: float) -> pd.DataFrame:
    return timing([{"ratio": 1.0}, {"approximation": "lyon", "lambda_form": "dot", "gamma": 8, "ratio": lyon}])


def test_h_says_on_which_targets_a_power_is_replaced() -> None:
    found = judged("h", timing=times(0.3), costs=costs(COSTS))
    assert found["verdict"] == "holds under conditions"
    assert (
        "lyon:dot:8 costs at least 2 % less than phong on gcn4 (0.6 of it), not on rdna2 (1.1 of it)"
        in found["because"]
    )
    assert "than phong/once on gcn4 (0.75 of it), not on rdna2 (0.995 of it)" in found["because"]
    cheaper = {(c["target"], c["formula"]): c["cheaper"] for c in found["conditions"] if "target" in c}
    assert cheaper["gcn4", "lyon:dot:8"] is True
    assert cheaper["rdna2", "lyon:dot:8"] is False
    assert found["coverage"] == "timed, counted"
    assert {row["target"] for row in found["evidence"] if row["table"] == "costs"} == {"gcn4", "rdna2"}
    assert "Besides, on every compiled target" in found["rule"]


@pytest.mark.parametrize(
    ("lyon", "counted", "verdict"),
    [
        (0.3, 0.5, "holds"),
        (0.3, 1.5, "holds under conditions"),
        (1.5, 0.5, "holds under conditions"),
        (1.5, 1.5, "fails"),
        (0.3, 0.98, "holds"),
        (0.3, 0.981, "holds under conditions"),
    ],
)
def test_times_and_counts_decide_together(lyon: float, counted: float, verdict: str) -> None:
    both = {"phong": (1.0, 1.0), "lyon:dot:8": (counted, counted)}
    assert judged("h", timing=times(lyon), costs=costs(both))["verdict"] == verdict


def test_without_times_the_counts_decide_alone() -> None:
    found = judged("h", costs=costs({name: (1.0, 0.5) if "lyon" in name else (1.0, 1.0) for name in COSTS}))
    assert found["verdict"] == "holds under conditions"
    assert found["lacking"] is None
    assert found["coverage"] == "counted"
    assert judged("h")["verdict"] == "not measured"
    assert judged("h", timing=times(0.3))["verdict"] == "holds"


def test_f_is_graded_at_infinity_and_tells_what_h_costs_near() -> None:
    found = judged("f", costs=costs(COSTS))
    assert found["verdict"] == "holds"
    assert "blinn costs at least 2 % less than phong@reflect on gcn4 and rdna2 (0.333 .. 0.4 of it)" in found["because"]
    assert "phong@reflect on rdna2 (0.667 of it), not on gcn4 (1.33 of it)" in found["because"]
    dear = judged("f", costs=costs(COSTS | {"blinn@halfway/once": (4.0, 4.0)}))["because"]
    assert "on none of gcn4 and rdna2 (1.33 of it)" in dear
    alone = {name: COSTS[name] for name in ("phong", "phong@reflect", "blinn@halfway/once")}
    assert judged("f", costs=costs(alone))["verdict"] == "not measured"


def test_a_target_that_lacks_one_of_a_pair_says_nothing_of_it() -> None:
    some = pd.concat([costs({"phong": (1.0,)}, ("gcn4",)), costs({"lyon:dot:8": (0.5,)}, ("rdna2",))])
    assert judged("h", timing=times(0.3), costs=some)["verdict"] == "holds"
    assert "Counted" not in judged("h", timing=times(0.3), costs=some)["because"]
