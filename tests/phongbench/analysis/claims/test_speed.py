"""Claims f and h: what is faster."""

from typing import Any

import numpy as np
import pytest
from claim_tables import accuracy, judged, table, timing

# f and h: speed


def timed(**ratio: float) -> list[dict[str, Any]]:
    """Times of the four formulas in one working set; lyon in three forms."""
    place = {"working_set": "l1"}
    named = {"libm": "phong-libm", "whole": "integer-power"}
    exact = [{"approximation": "phong"}] + [
        {"approximation": named[n], "ratio": r} for n, r in ratio.items() if n in named
    ]
    forms = [
        {"approximation": "lyon", "lambda_form": form, "gamma": 8, "ratio": ratio["lyon"]}
        for form in ("dot", "difference", "cross")
    ]
    return [place | row for row in [*exact, *forms, {"approximation": "aa-twin"}]]


@pytest.mark.parametrize(
    ("ratio", "verdict"),
    [
        ({"lyon": 0.3, "libm": 5.0, "whole": 0.5}, "holds"),
        ({"lyon": 0.3, "libm": 5.0, "whole": 0.3}, "holds under conditions"),
        ({"lyon": 0.975, "libm": 0.5, "whole": 0.5}, "fails"),
        ({"lyon": 1.5}, "fails"),
    ],
)
def test_speed_is_claimed_by_the_far_end_of_the_interval(ratio: dict[str, float], verdict: str) -> None:
    assert judged("h", timing=timing(timed(**ratio)), accuracy=accuracy([{}]))["verdict"] == verdict


def test_the_interval_against_another_engine_spans_both_intervals() -> None:
    found = judged("h", timing=timing(timed(lyon=0.3, libm=6.0)), accuracy=accuracy([{}]))
    one = next(c for c in found["conditions"] if c["engine"] == "phong-libm")
    assert one["times_faster"] == pytest.approx(20.0)
    assert one["times_faster_low"] == pytest.approx(20.0 * 0.99 / 1.01)
    assert one["times_faster_high"] == pytest.approx(20.0 * 1.01 / 0.99)


def test_a_twin_told_apart_withholds_every_claim_of_speed() -> None:
    rows = timing([*timed(lyon=0.3, libm=5.0), {"approximation": "aa-twin", "working_set": "l2", "verdict": "slower"}])
    for key in "fh":
        found = judged(key, timing=rows, accuracy=accuracy([{}]))
        assert found["verdict"] == "not measured"
        assert "Identical code differed in time in l2" in found["because"]


def test_without_times_the_claims_of_speed_name_the_flag() -> None:
    for key in "fh":
        assert "--no-timing" in judged(key, accuracy=accuracy([{}]))["lacking"]


def test_blinns_power_is_compared_but_its_vectors_are_not_timed() -> None:
    rows = timing([*timed(lyon=0.3), {"approximation": "blinn", "space": "half", "ratio": 1.1}])
    found = judged("f", timing=rows, accuracy=accuracy([{}]))
    assert found["verdict"] == "not measured"
    assert "1.1 in l1" in found["because"]
    assert found["conditions"][0]["ratio_to_phong"] == pytest.approx(1.1)


def test_times_without_an_interval_are_not_judged() -> None:
    rows = [row | {"ratio_low": 0.0, "ratio_high": np.inf} for row in timed(lyon=0.3, libm=5.0)]
    assert judged("h", timing=timing(rows), accuracy=accuracy([{}]))["verdict"] == "not measured"


# f: Blinn at infinity


def shaded(infinity: float, near: float, again: float = 1.0, **more: Any) -> list[dict[str, Any]]:
    """Times of shading at one exponent: Blinn-Phong over Phong in both places, and Phong over itself."""
    usual = {"kind": "shading", "formula": "phong", "setting": 50.0, "against": "phong", "elements": 1000, "depth": 0}
    ratios = [("infinity", "blinn-phong", infinity), ("near", "blinn-phong", near), ("near", "phong again", again)]
    return [
        {**usual, "scene": place, "name": name, "ratio": r, "ratio_low": 0.99 * r, "ratio_high": 1.01 * r, **more}
        for place, name, r in ratios
    ]


@pytest.mark.parametrize(
    ("rows", "verdict"),
    [
        (shaded(0.9, 1.1) + shaded(0.8, 1.0, formula="lyon:dot:8"), "holds"),
        (shaded(0.9, 1.1) + shaded(1.0, 1.0, setting=200.0), "holds under conditions"),
        (shaded(0.975, 1.1, ratio_low=0.9, ratio_high=1.05), "fails"),
        (shaded(0.99, 0.5), "fails"),
        (shaded(0.9, 1.1, again=1.1), "not measured"),
    ],
)
def test_blinn_is_faster_at_infinity_where_the_whole_interval_says_so(rows: Any, verdict: str) -> None:
    found = judged("f", scene_times=table("scene_times", rows), accuracy=accuracy([{}]))
    assert found["verdict"] == verdict
    if verdict == "not measured":
        assert "Identical shading differed in time" in found["because"]
    else:
        assert len(found["evidence"]) == len(found["conditions"]) == 2 * len(rows) // 3
