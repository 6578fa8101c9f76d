"""Claims i and l: far lights, and reflections that are stopped."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from claim_tables import CODE, accuracy, judged, table
from hypothesis import given
from hypothesis import strategies as st

from phongbench.analysis.claims.claim import VISIBLE
from phongbench.analysis.claims.far_lights import far_enough

# i: far lights


def held(alpha: float | None, times_distance: float, held: str = "both") -> list[dict[str, Any]]:
    """A term whose error is so much over the distance."""
    term = "diffuse" if alpha is None else "specular"
    return [
        {
            "held": held,
            "term": term,
            "alpha": np.nan if alpha is None else alpha,
            "distance": d,
            "max_abs": times_distance / d,
        }
        for d in (1.0, 16.0, 256.0)
    ]


@pytest.mark.parametrize(
    ("rows", "verdict"),
    [
        (held(None, 50 * CODE, "light") + held(10.0, 99 * CODE), "holds"),
        (held(None, 50 * CODE, "light") + held(10.0, 150 * CODE), "holds under conditions"),
        (held(None, 50 * CODE, "light") + held(10.0, 999 * CODE), "holds under conditions"),
        (held(10.0, 999 * CODE), "fails"),
        (held(10.0, 999 * CODE) + held(10.0, 9 * CODE, "light"), "fails"),
    ],
)
def test_far_is_where_both_may_be_held_within_one_code(rows: Any, verdict: str) -> None:
    assert judged("i", far=table("far", rows), accuracy=accuracy([{}]))["verdict"] == verdict


@given(st.floats(1.5, 200.0))
def test_the_distance_that_is_far_enough_is_found_between_measured_ones(sides: float) -> None:
    rows = pd.DataFrame(held(50.0, sides * CODE))
    assert far_enough(rows["distance"], rows["max_abs"]) == pytest.approx(sides)


@pytest.mark.parametrize("sides", [1.5, 16.0, 40.0, 200.0])
def test_the_claim_tells_that_distance_and_its_law(sides: float) -> None:
    found = judged("i", far=table("far", held(50.0, sides * CODE)), accuracy=accuracy([{}]))
    (record,) = found["conditions"]
    assert record["sides_from"] == pytest.approx(sides)
    assert record["error_times_sides"] == pytest.approx(sides * CODE)


def test_an_error_of_just_one_code_is_near_enough() -> None:
    distances = pd.Series([1.0, 2.0, 4.0])
    assert far_enough(distances, pd.Series([VISIBLE, VISIBLE, VISIBLE])) == 1.0
    assert far_enough(distances, pd.Series([2 * VISIBLE, VISIBLE, 0.0])) == 2.0
    assert far_enough(distances, pd.Series([2 * VISIBLE, 0.0, 0.0])) == 2.0
    assert far_enough(distances, pd.Series([0.0, 0.0, 2 * VISIBLE])) is None


# l: stopping reflections


def cut(scene: str, saved: dict[float, tuple[float, float]]) -> list[dict[str, Any]]:
    """contribution -> (share of rays saved, largest change)."""
    return [
        {
            "scene": scene,
            "depth": 5,
            "width": 9,
            "height": 9,
            "name": "cutoff",
            "setting": c,
            "of": 1000,
            "skipped": round(1000 * share),
            "bound": c,
            "largest_change": change,
        }
        for c, (share, change) in saved.items()
    ]


@pytest.mark.parametrize(
    ("rows", "verdict"),
    [
        (cut("a", {0.01: (0.05, CODE)}) + cut("b", {0.01: (0.2, 0.0)}), "holds"),
        (cut("a", {0.01: (0.05, CODE)}) + cut("b", {0.01: (0.01, 0.0)}), "holds under conditions"),
        (cut("a", {0.01: (0.04, CODE), 0.1: (0.2, 9 * CODE)}), "holds under conditions"),
        (cut("a", {0.01: (0.0, 0.0), 0.1: (0.04, 9 * CODE)}), "fails"),
        ([row | {"name": "objects"} for row in cut("a", {0.01: (0.5, 0.0)})], "not measured"),
    ],
)
def test_stopping_saves_work_where_enough_rays_are_spared(rows: Any, verdict: str) -> None:
    assert judged("l", skips=table("skips", rows), accuracy=accuracy([{}]))["verdict"] == verdict
