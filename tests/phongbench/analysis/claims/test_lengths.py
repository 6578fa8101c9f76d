"""Claims c, d and e: vectors that are not normalised, or cheaply."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from claim_tables import CODE, Tables, accuracy, judged, meshes

from phongbench.analysis.claims import CLAIMS
from phongbench.analysis.rows import Rows
from phongbench.formulas import error_laws

# c: the cross form


def wrong(alpha: float, e: float, way: str = "a", **change: float) -> list[dict[str, Any]]:
    key = {"alpha": alpha, "length_error": e, "perturbation": way, "stratum": "lengths"}
    return [key | {"lambda_form": form, "length_max": value} for form, value in change.items()]


def test_cross_is_much_less_sensitive_where_it_changes_a_quarter_of_what_dot_does() -> None:
    good = wrong(10.0, 0.01, dot=0.1, cross=0.025, difference=0.03)
    bad = wrong(50.0, 0.01, dot=0.1, cross=0.026, difference=0.03)
    assert judged("c", accuracy=accuracy(good))["verdict"] == "holds"
    assert judged("c", accuracy=accuracy(good + bad))["verdict"] == "holds under conditions"
    assert judged("c", accuracy=accuracy(bad))["verdict"] == "fails"


def test_cross_does_not_hold_everywhere_if_difference_changes_less() -> None:
    rows = wrong(10.0, 0.01, dot=0.1, cross=0.02, difference=0.01) + wrong(
        10.0, 0.1, dot=0.9, cross=0.2, difference=0.3
    )
    found = judged("c", accuracy=accuracy(rows))
    assert found["verdict"] == "holds under conditions"
    assert found["conditions"][0]["alphas"] == [10.0]
    one = found["conditions"][1]
    assert (one["difference_to_alpha_times_error"], one["cross_from_alpha_times_error"]) == (0.1, 1.0)


def test_without_an_order_between_difference_and_cross_none_is_claimed() -> None:
    rows = wrong(10.0, 0.1, dot=0.9, cross=0.02, difference=0.01) + wrong(
        10.0, 0.01, dot=0.9, cross=0.1, difference=0.2
    )
    found = judged("c", accuracy=accuracy(rows))
    assert found["conditions"][1]["difference_to_alpha_times_error"] is None
    assert "now one, now the other" in found["because"]


def test_changes_that_cannot_be_seen_do_not_count() -> None:
    hidden = wrong(10.0, 1e-4, dot=0.9 * CODE, cross=0.8 * CODE, difference=0.7 * CODE)
    assert judged("c", accuracy=accuracy(hidden))["verdict"] == "not measured"
    unseen = wrong(10.0, 1e-4, dot=0.9 * CODE, cross=0.8 * CODE, difference=0.7 * CODE)
    seen = wrong(10.0, 0.01, dot=0.1, cross=0.01, difference=0.02)
    assert judged("c", accuracy=accuracy(unseen + seen))["verdict"] == "holds"


def test_the_measured_crossover_brackets_its_law(law_rows: pd.DataFrame) -> None:
    found = judged("c", accuracy=law_rows)
    one = next(c for c in found["conditions"] if c.get("perturbation") == "a")
    low, high = one["difference_to_alpha_times_error"], one["cross_from_alpha_times_error"]
    assert low <= error_laws.length_crossover(1.0) <= high <= 2.0 * low
    assert next(c for c in found["conditions"] if c.get("perturbation") == "both")["difference_never_worse"]
    assert next(c for c in found["conditions"] if c.get("perturbation") == "opposite")["cross_never_worse"]


# d: coarse meshes


def mesh(alpha: float, change: dict[float, float], **more: Any) -> list[dict[str, Any]]:
    return [{"alpha": alpha, "edge_degrees": edge, "length_max": most} | more for edge, most in change.items()]


@pytest.mark.parametrize(
    ("rows", "verdict"),
    [
        (mesh(10.0, {1.0: 0.0, 9.8: 0.4 * CODE, 20.0: 5 * CODE}), "holds"),
        (mesh(10.0, {9.8: 0.9 * CODE}) + mesh(50.0, {1.0: 0.0, 9.8: 2 * CODE}), "holds under conditions"),
        (mesh(10.0, {1.0: 2 * CODE}) + mesh(10.0, {1.0: 0.0}, pair="lengthwise"), "fails mostly"),
        (mesh(10.0, {1.0: 2 * CODE, 10.0: 0.0}), "fails"),
        (mesh(10.0, {1.0: float("nan")}), "fails"),
        (mesh(10.0, {1.0: 0.0, 9.8: 0.9 * CODE}), "holds under conditions"),
        (mesh(10.0, {1.0: 0.0}, truth="surface"), "not measured"),
        (mesh(10.0, {1.0: 0.0}, normals="renormalised"), "not measured"),
    ],
)
def test_raw_normals_are_good_enough_up_to_an_edge_angle(rows: Any, verdict: str) -> None:
    assert judged("d", meshes=meshes(rows), accuracy=accuracy([{}]))["verdict"] == verdict


def test_an_edge_angle_counts_on_the_worst_mesh_only() -> None:
    rows = mesh(10.0, {1.0: 0.0, 5.0: 0.1 * CODE, 10.0: 0.9 * CODE}) + mesh(
        10.0, {2.0: 0.0, 7.0: CODE * 10}, mesh="torus"
    )
    found = judged("d", meshes=meshes(rows), accuracy=accuracy([{}]))
    (record,) = found["conditions"]
    assert record["edge_degrees_to"] == pytest.approx(np.sqrt(5.0 * 7.0))
    assert record["edge_degrees_to"] < record["edge_degrees_to_two_codes"] < 7.0
    assert [(row["mesh"], row["edge_degrees"]) for row in found["evidence"]] == [("torus", 7.0)]


def test_the_reach_beyond_the_coarsest_mesh_is_not_invented() -> None:
    found = judged("d", meshes=meshes(mesh(10.0, {1.0: 0.0, 5.0: 0.1 * CODE})), accuracy=accuracy([{}]))
    assert found["verdict"] == "holds under conditions"
    assert found["conditions"][0]["beyond_measured"]
    assert "more than 5 degrees" in found["because"]


# e: cheap roots


def rooted(root: str, alpha: float, **change: float) -> list[dict[str, Any]]:
    return wrong(alpha, 0.0, root, **change)


@pytest.mark.parametrize(
    ("rows", "verdict"),
    [
        (rooted("rsqrt-12", 10.0, cross=CODE, dot=0.5) + rooted("rsqrt-bits-0", 10.0, difference=0.0), "holds"),
        (rooted("rsqrt-12", 10.0, cross=CODE) + rooted("rsqrt-bits-0", 10.0, cross=0.1), "holds under conditions"),
        (rooted("rsqrt-12", 10.0, cross=CODE) + rooted("rsqrt-12", 50.0, cross=0.1), "holds under conditions"),
        (rooted("rsqrt-12", 10.0, cross=0.1, difference=0.1, dot=0.0), "fails"),
        (wrong(10.0, 0.01, cross=0.0), "not measured"),
    ],
)
def test_a_cheap_root_is_enough_where_it_changes_at_most_one_code(rows: Any, verdict: str) -> None:
    assert judged("e", accuracy=accuracy(rows))["verdict"] == verdict


def test_roots_come_in_the_order_of_their_accuracy_and_alike_ones_share_a_sentence() -> None:
    rows = rooted("rsqrt-bits-0", 10.0, cross=0.1) + rooted("rsqrt-12", 10.0, cross=CODE)
    rows = [row | {"length_error": 0.03 if row["perturbation"] == "rsqrt-bits-0" else 3e-4} for row in rows]
    found = judged("e", accuracy=accuracy(rows))
    assert [one["root"] for one in found["conditions"]] == ["rsqrt-12", "rsqrt-bits-0"]
    assert "is enough at no measured exponent" in found["because"]


def test_the_worst_change_is_told_in_codes_of_an_8_bit_display() -> None:
    (record,) = judged("e", accuracy=accuracy(rooted("rsqrt-12", 10.0, cross=0.1)))["conditions"]
    assert (record["worst_change"], record["worst_alpha"]) == (0.1, 10.0)
    assert record["worst_codes"] == pytest.approx(25.5)


@pytest.mark.parametrize(("alphas", "verdict"), [((10.0, 50.0), "not measured"), ((10.0, 50.0, 200.0), "holds")])
def test_three_exponents_are_enough_to_judge_by(alphas: tuple[float, ...], verdict: str) -> None:
    rows = Rows(Tables(accuracy=accuracy([row for alpha in alphas for row in rooted("rsqrt-12", alpha, cross=0.0)])))
    claim = next(one for one in CLAIMS if one.key == "e")
    assert claim.judge(rows).over_enough(rows).verdict == verdict
