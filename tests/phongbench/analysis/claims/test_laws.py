"""Claims j, m and n, which follow from formulas alone, and claim k, from the reflectance of two materials."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from claim_tables import accuracy, judged, table

from phongbench.analysis.claims.mirror import energy_within, exponent_of, half_width


def test_half_of_a_lobe_is_at_its_half_width_and_exponents_follow_from_it() -> None:
    for n in (1.0, 200.0, 1e5):
        assert np.cos(np.radians(half_width(n))) ** n == pytest.approx(0.5)
        assert exponent_of(half_width(n)) == pytest.approx(n)
    t = np.radians(np.linspace(0.0, half_width(200.0), 20001))
    inside = np.trapezoid(np.cos(t) ** 200 * np.sin(t), t) * 201
    assert energy_within(200.0, half_width(200.0)) == pytest.approx(inside, rel=1e-6)


def test_the_law_claim_is_judged_without_rows_and_says_that_it_follows_from_a_law() -> None:
    found = judged("j")
    assert found["coverage"] == "law"
    assert found["verdict"] != "not measured"


def test_two_normals_are_left_wherever_both_are_seen() -> None:
    found = judged("m")
    assert (found["verdict"], found["coverage"]) == ("holds", "law")
    shares = {one["light_degrees"]: one["open_share"] for one in found["conditions"]}
    assert list(shares) == [0, 20, 45, 70]
    assert "lights 0, 20, 45 and 70 degrees from the viewer" in found["rule"]
    # the second solution is the light's angle plus acos(i): it is seen up to 90 degrees
    for degrees, share in shares.items():
        assert share == pytest.approx(1 - np.cos(np.radians(90 - degrees)), abs=2e-3), degrees


def test_normals_turn_around_the_light_and_not_around_the_view() -> None:
    found = judged("n")
    assert (found["verdict"], found["coverage"]) == ("holds under conditions", "law")
    assert "cone around the light" in found["because"]
    for one in found["conditions"]:
        assert one["change_around_light"] < 1e-12
        # turned by half, a normal 30 degrees from the viewer is that far on his other side; below 0 it is dark
        slant = one["light_degrees"]
        opposite = max(np.cos(np.radians(slant + 30)), 0) - np.cos(np.radians(slant - 30))
        assert one["change_around_view"] == pytest.approx(abs(opposite), abs=1e-12)


def reflectances(**within: float) -> pd.DataFrame:
    """Rows of the constant, within a code up to so many degrees, and of Schlick's formula."""

    def rows(material: str, channel: str, degrees: float) -> list[dict[str, Any]]:
        common = {"material": material, "precision": "float32", "channel": channel, "samples": 9}
        errors = {"max_abs": 0.5, "error_60": 0.1, "error_85": 0.4, "within_degrees": degrees}
        return [
            common | {"reflectance": "constant"} | errors,
            common | {"reflectance": "schlick"} | errors | {"max_abs": 0.04},
        ]

    found = [
        row for m, d in within.items() for c, more in (("red", 5.0), ("blue", 0.0)) for row in rows(m, c, d + more)
    ]
    return table("incidence", found)


@pytest.mark.parametrize(
    ("within", "verdict"),
    [
        ({"glass": 37.0, "copper": 51.0}, "holds"),
        ({"glass": 37.0, "copper": 85.0}, "holds under conditions"),
        ({"glass": 90.0, "copper": 85.0}, "fails"),
    ],
)
def test_a_constant_ks_is_judged_by_the_channel_that_errs_most(within: dict[str, float], verdict: str) -> None:
    found = judged("k", incidence=reflectances(**within), accuracy=accuracy([{}]))
    assert found["verdict"] == verdict
    assert {one["material"]: one["within_degrees"] for one in found["conditions"]} == within
    assert {one["max_error_of_schlick"] for one in found["conditions"]} == {0.04}
    assert len(found["evidence"]) == 4
    assert {row["column"] for row in found["evidence"]} == {"error_85"}


def test_without_its_probe_the_claim_says_what_would_measure_it() -> None:
    found = judged("k")
    assert found["verdict"] == "not measured"
    assert "--probe incidence" in found["lacking"]
