"""Claim o: the cut highlight."""

import math
from typing import Any

import pytest
from claim_tables import CODE, judged, table

from phongbench.analysis.claims.cut_highlight import reach


def rows(name: str, steps: dict[float, float], cut: float | None = 90.0, **more: Any) -> list[dict[str, Any]]:
    space = "half" if name == "blinn" else "reflect"
    key = {"approximation": name, "lambda_form": "none", "space": space, "beta_policy": "none", "gamma": None}
    found = {"cut_degrees": cut, "at_90": 0.5}
    return [key | found | {"alpha": a, "step": s, "codes": 255 * s} | more for a, s in steps.items()]


BLINN = rows("blinn", {0.1: math.nan, 1.0: math.nan}, cut=None)


@pytest.mark.parametrize(
    ("steps", "verdict"),
    [
        ({0.0: 1.0, 0.1: 0.6, 1.0: 2 * CODE, 5.0: 0.0}, "holds"),
        ({0.1: 0.6, 1.0: 0.5 * CODE}, "holds under conditions"),
        ({0.1: 0.5 * CODE, 1.0: 0.5 * CODE}, "fails"),
        ({0.0: 1.0, 5.0: 0.0}, "not measured"),
    ],
)
def test_phong_is_cut_where_a_degree_before_its_end_it_is_still_visible(
    steps: dict[float, float], verdict: str
) -> None:
    assert judged("o", cuts=table("cuts", rows("phong", steps) + BLINN))["verdict"] == verdict


def test_it_fails_where_the_half_vector_is_cut_too() -> None:
    cuts = rows("phong", {1.0: 2 * CODE}) + rows("blinn", {1.0: 2 * CODE}, cut=120.0)
    assert judged("o", cuts=table("cuts", cuts))["verdict"] == "fails"


def test_without_the_half_vector_or_the_probe_it_is_not_measured() -> None:
    for cuts in (rows("phong", {1.0: 2 * CODE}), []):
        found = judged("o", cuts=table("cuts", cuts))
        assert found["verdict"] == "not measured"
        assert "--probe lobes" in found["lacking"]


def test_the_sentence_says_where_how_large_up_to_where_and_who_is_cut_harder() -> None:
    cuts = rows("phong", {0.1: 0.667, 1.0: 4.45 * CODE}) + BLINN
    cuts += rows("lyon", {1.0: 0.35, 3.0: 6.5 * CODE, 5.0: 0.1 * CODE}, gamma=8)
    found = judged("o", cuts=table("cuts", cuts))
    assert "90 degrees" in found["because"]
    assert "170 codes at alpha 0.1" in found["because"]
    assert "up to alpha 1.37" in found["because"]
    assert "lyon with gamma 8 by 6.5 codes at alpha 3" in found["because"]
    assert {row["alpha"] for row in found["evidence"]} == {0.1, 1.0}


def test_the_last_visible_exponent_is_that_of_one_code_a_degree_before() -> None:
    assert math.sin(math.radians(1)) ** reach() == pytest.approx(CODE)
