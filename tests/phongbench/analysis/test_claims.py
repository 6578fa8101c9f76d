"""The textbook claims: each rule on rows made by hand for each verdict, all rules on rows of the real engine."""

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from phongbench.analysis import claims
from phongbench.analysis.claims import CLAIMS, VERDICTS, answer, judge
from phongbench.analysis.claims.blinn_exponent import equal_exponent_error, off_plane
from phongbench.analysis.claims.claim import LackingRowsError, plain
from phongbench.analysis.claims.incidence import rise
from phongbench.analysis.claims.mirror import energy_within, exponent_of, half_width
from phongbench.analysis.claims.words import codes, exponents, listed, rounded, times
from phongbench.analysis.rows import Rows
from phongbench.errors import CorruptRunError, InputError
from phongbench.formulas import error_laws
from phongbench.formulas.lambda_forms import LAMBDA_FORMS
from phongbench.formulas.minimax_fits import half_angle_ratio
from phongbench.inputs.plan import preset
from phongbench.results.runs import Run
from phongbench.results.schema import ACCURACY, MESHES, TABLES, TIMING

CODE = 1 / 255


@dataclass(frozen=True)
class Tables:
    """What judge reads of a run."""

    accuracy: pd.DataFrame = field(default_factory=ACCURACY.frame)
    timing: pd.DataFrame = field(default_factory=TIMING.frame)
    meshes: pd.DataFrame = field(default_factory=MESHES.frame)
    skips: pd.DataFrame = field(default_factory=TABLES["skips"].frame)
    scene_times: pd.DataFrame = field(default_factory=TABLES["scene_times"].frame)
    far: pd.DataFrame = field(default_factory=TABLES["far"].frame)
    manifest: dict[str, Any] = field(default_factory=lambda: {"run": "by-hand", "state": "complete"})


def accuracy(rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    usual = {
        "approximation": "lyon",
        "lambda_form": "dot",
        "space": "reflect",
        "beta_policy": "taylor",
        "alpha": 50.0,
        "gamma": 8,
        "beta": 1.0,
        "precision": "float32",
        "gated": True,
        "stratum": "highlight",
        "perturbation": "none",
        "length_error": 0.0,
        "truth": "angle",
        "samples": 1000,
        "max_abs": 0.0,
        "length_max": 0.0,
        "coverage": "sampled",
    }
    frame = pd.DataFrame([usual | row for row in rows]).reindex(columns=ACCURACY.names)
    return frame.astype({"gamma": "Int64"})


def timing(rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    usual = {
        "approximation": "phong",
        "lambda_form": "none",
        "space": "reflect",
        "beta_policy": "none",
        "gamma": None,
        "precision": "float32",
        "working_set": "l1",
        "threads": 1,
        "ratio": 1.0,
        "verdict": "unresolved",
    }
    told = [usual | row for row in rows]
    told = [{"ratio_low": 0.99 * row["ratio"], "ratio_high": 1.01 * row["ratio"]} | row for row in told]
    return pd.DataFrame(told).reindex(columns=TIMING.names).astype({"gamma": "Int64"})


def meshes(rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    usual = {
        "mesh": "icosphere",
        "normals": "raw",
        "pair": "classic",
        "approximation": "lyon",
        "lambda_form": "cross",
        "space": "reflect",
        "beta_policy": "taylor",
        "alpha": 50.0,
        "gamma": 8,
        "precision": "float32",
        "gated": True,
        "truth": "interpolated",
    }
    columns = list(dict.fromkeys([*MESHES.names, "length_max"]))
    return pd.DataFrame([usual | row for row in rows]).reindex(columns=columns).astype({"gamma": "Int64"})


def table(name: str, rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    """Any other table, made of the columns that a rule reads."""
    return pd.DataFrame(list(rows)).reindex(columns=TABLES[name].names)


def judged(key: str, **tables: pd.DataFrame) -> dict[str, Any]:
    claim = next(one for one in CLAIMS if one.key == key)
    return claim.judge(Rows(Tables(**tables))).as_dict()


# a: gamma 4 or 8


def lyon(errors: dict[float, float], **more: Any) -> list[dict[str, Any]]:
    return [{"alpha": alpha, "max_abs": error} | more for alpha, error in errors.items()]


@pytest.mark.parametrize(
    ("rows", "verdict"),
    [
        (lyon({10.0: 0.5 * CODE, 50.0: CODE}), "holds"),
        (lyon({10.0: 0.5 * CODE, 50.0: 2 * CODE}), "holds under conditions"),
        (lyon({10.0: 2 * CODE}) + lyon({10.0: 0.5 * CODE}, beta_policy="minimax"), "holds under conditions"),
        (lyon({10.0: 2 * CODE}) + lyon({10.0: 0.5 * CODE}, gamma=4), "holds under conditions"),
        (lyon({10.0: 2 * CODE, 50.0: 3 * CODE}), "fails"),
        (lyon({10.0: 0.5 * CODE}, gamma=16), "not measured"),
        (lyon({10.0: 0.5 * CODE}, stratum="peak"), "not measured"),
        (lyon({10.0: 0.5 * CODE}, gated=False), "not measured"),
    ],
)
def test_gamma_4_or_8_is_enough_where_its_largest_error_is_within_one_code(rows: Any, verdict: str) -> None:
    assert judged("a", accuracy=accuracy(rows))["verdict"] == verdict


def test_the_conditions_of_gamma_name_exponents_and_the_worst_of_them() -> None:
    found = judged("a", accuracy=accuracy(lyon({10.0: 0.5 * CODE, 20.0: CODE / 8, 50.0: 9 * CODE})))
    (record,) = found["conditions"]
    assert (record["gamma"], record["alphas"], record["alphas_10bit"]) == (8, [10.0, 20.0], [20.0])
    assert (record["alpha_from"], record["alpha_to"], record["worst_alpha"]) == (10.0, 20.0, 50.0)
    assert record["worst_codes"] == pytest.approx(9.0)
    assert "9 codes" in found["because"]
    assert {row["alpha"]: row["value"] for row in found["evidence"]} == {20.0: CODE / 8, 50.0: 9 * CODE}


def test_the_largest_error_counts_where_inputs_were_covered_in_several_ways() -> None:
    sampled = lyon({10.0: 0.9 * CODE})
    exhaustive = lyon({10.0: 1.1 * CODE}, coverage="exhaustive", stratum="cosines")
    found = judged("a", accuracy=accuracy(exhaustive + sampled))
    assert (found["verdict"], found["coverage"]) == ("fails", "exhaustive")
    assert found["evidence"][0]["stratum"] == "cosines"


def test_a_certified_bound_of_another_precision_does_not_stand_for_a_measured_error() -> None:
    bound = lyon({10.0: 1.1 * CODE}, coverage="certified", stratum="cosines", precision="exact")
    found = judged("a", accuracy=accuracy(lyon({10.0: 0.9 * CODE}) + bound))
    assert (found["verdict"], found["coverage"]) == ("holds", "sampled")


# b: sufficiently large gamma


def limit(errors: dict[float, float]) -> list[dict[str, Any]]:
    return lyon(errors, approximation="gaussian", gamma=None)


@pytest.mark.parametrize(
    ("errors", "verdict"),
    [
        ({10.0: CODE, 50.0: 0.1 * CODE}, "holds"),
        ({10.0: 2 * CODE, 50.0: 0.1 * CODE}, "holds under conditions"),
        ({10.0: 2 * CODE, 50.0: 1.5 * CODE}, "fails"),
    ],
)
def test_a_large_gamma_suffices_where_its_limit_does(errors: dict[float, float], verdict: str) -> None:
    rows = lyon(dict.fromkeys(errors, 0.0)) + limit(errors)
    assert judged("b", accuracy=accuracy(rows))["verdict"] == verdict


def test_a_gamma_within_in_passing_is_told_from_one_that_stays_within() -> None:
    rows = limit({10.0: 7 * CODE, 32.0: 2 * CODE, 200.0: 0.3 * CODE})
    for gamma, errors in {8: (2, 5, 9), 32: (3, 0, 2), 64: (5, 1.1, 0.9)}.items():
        rows += lyon(dict(zip((10.0, 32.0, 200.0), (CODE * e for e in errors), strict=True)), gamma=gamma)
    told = {one["alpha"]: one for one in judged("b", accuracy=accuracy(rows))["conditions"]}
    assert {alpha: one["within"] for alpha, one in told.items()} == {
        10.0: "never",
        32.0: "in passing",
        200.0: "from some gamma on",
    }
    assert (told[32.0]["gammas_within"], told[32.0]["gamma_from"]) == ([32], None)
    assert (told[200.0]["gamma_from"], told[200.0]["gamma_measured_to"]) == (64, 64)


def test_without_the_limit_the_claim_says_which_formula_to_run() -> None:
    found = judged("b", accuracy=accuracy(lyon({10.0: 0.0})))
    assert found["verdict"] == "not measured"
    assert "gaussian" in found["lacking"]


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
        (mesh(10.0, {1.0: 2 * CODE}) + mesh(10.0, {1.0: 0.0}, pair="lengthwise"), "holds under conditions"),
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
        assert "identical code apart in l2" in found["because"]


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


# g: Blinn's exponent


def blinn(alpha: float, **errors: float) -> list[dict[str, Any]]:
    key = {"approximation": "blinn", "space": "half", "lambda_form": "none", "gamma": None, "alpha": alpha}
    return [key | {"beta_policy": policy, "max_abs": error} for policy, error in errors.items()]


def test_alpha_prime_is_larger_where_a_larger_one_errs_less_than_an_equal_one() -> None:
    found = judged("g", accuracy=accuracy(blinn(10.0, taylor=0.02, minimax=0.01)))
    assert found["verdict"] == "holds under conditions"
    first = found["conditions"][0]
    assert (first["best_policy"], first["ratio"]) == ("minimax", half_angle_ratio(10.0))
    assert judged("g", accuracy=accuracy(blinn(10.0, taylor=0.6)))["verdict"] == "fails"
    assert judged("g", accuracy=accuracy([{}]))["verdict"] == "not measured"


@pytest.mark.parametrize("alpha", [1.0, 8.0, 50.0, 1000.0])
def test_equal_exponents_err_by_what_a_dense_grid_of_angles_finds(alpha: float) -> None:
    t = np.linspace(0.0, np.pi / 2, 400001)
    dense = float(np.abs(np.cos(t) ** alpha - np.cos(t / 2) ** alpha).max())
    assert equal_exponent_error(alpha) == pytest.approx(dense, rel=1e-3)


@pytest.mark.parametrize("incidence", [0.0, 30.0, 60.0, 75.0])
def test_off_the_plane_of_incidence_the_ratio_is_that_of_the_deficits(incidence: float) -> None:
    i, tilt = np.radians(incidence), 1e-4
    light, viewer = np.array([np.sin(i), 0, np.cos(i)]), np.array([-np.sin(i), 0, np.cos(i)])
    normal = np.array([0, np.sin(tilt), np.cos(tilt)])
    mirrored = 2 * (light @ normal) * normal - light
    deficits = ((mirrored - viewer) @ (mirrored - viewer) / 2) / (2 * np.sin(tilt / 2) ** 2)
    assert off_plane(incidence) == pytest.approx(deficits, rel=1e-4, abs=1e-6)


# j and k: laws


def test_half_of_a_lobe_is_at_its_half_width_and_exponents_follow_from_it() -> None:
    for n in (1.0, 200.0, 1e5):
        assert np.cos(np.radians(half_width(n))) ** n == pytest.approx(0.5)
        assert exponent_of(half_width(n)) == pytest.approx(n)
    t = np.radians(np.linspace(0.0, half_width(200.0), 20001))
    inside = np.trapezoid(np.cos(t) ** 200 * np.sin(t), t) * 201
    assert energy_within(200.0, half_width(200.0)) == pytest.approx(inside, rel=1e-6)


def test_the_law_claims_are_judged_without_rows_and_say_that_they_follow_from_laws() -> None:
    for key in "jk":
        found = judged(key)
        assert found["coverage"] == "law"
        assert found["verdict"] != "not measured"


def test_a_constant_ks_leaves_one_code_where_the_claim_says() -> None:
    for one in judged("k")["conditions"]:
        assert rise(one["reflectance"], one["incidence_to_degrees"]) == pytest.approx(CODE)


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
        assert "told identical shading apart" in found["because"]
    else:
        assert len(found["evidence"]) == len(found["conditions"]) == 2 * len(rows) // 3


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


@settings(deadline=None)
@given(st.floats(1.5, 200.0))
def test_the_distance_that_is_far_enough_is_found_between_measured_ones(sides: float) -> None:
    found = judged("i", far=table("far", held(50.0, sides * CODE)), accuracy=accuracy([{}]))
    (record,) = found["conditions"]
    assert record["sides_from"] == pytest.approx(sides)
    assert record["error_times_sides"] == pytest.approx(sides * CODE)


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


# all of them


def test_claims_are_lettered_in_order_and_describe_themselves() -> None:
    assert [claim.key for claim in CLAIMS] == list("abcdefghijkl")
    for claim in CLAIMS:
        assert len(claim.rule_text) > 80
        assert claim.title
        assert not claim.title.endswith(".")
        assert set(claim.needs) <= set(TABLES)


def test_without_scenes_a_claim_says_what_would_measure_it() -> None:
    for key in "fil":
        found = judged(key, accuracy=accuracy([{}]))
        assert found["verdict"] == "not measured"
    for key in "il":
        assert "--scenes" in judged(key, accuracy=accuracy([{}]))["lacking"]


def test_a_run_without_any_of_the_rows_is_refused_with_the_command() -> None:
    with pytest.raises(InputError, match="phongbench run") as refused:
        judge(Tables())
    assert "not timed" in refused.value.what


@pytest.fixture(scope="module")
def engine_rows(swept: Callable[..., pd.DataFrame]) -> pd.DataFrame:
    """Rows of the real engine that every accuracy rule of this issue reads."""
    plan = replace(
        preset("quick"),
        alphas=(10.0, 64.0, 200.0),
        gammas=(4, 8, 64),
        spaces=("reflect", "half"),
        approximations=("phong", "lyon", "gaussian", "blinn"),
        precisions=("float32",),
        strata=("highlight", "lengths"),
        lambda_forms=tuple(f for f in LAMBDA_FORMS if f != "tan2"),
        samples=4096,
        timing=False,
    ).validated()
    return swept(plan)


def test_every_rule_judges_the_rows_of_the_engine(engine_rows: pd.DataFrame) -> None:
    found = {one.claim.key: one.as_dict() for one in judge(Tables(accuracy=engine_rows))}
    assert list(found) == list("abcdefghijkl")
    for key in "abcegj":
        assert found[key]["verdict"] == "holds under conditions"
    assert found["a"]["conditions"][0]["gamma"] == 8
    limits = {one["alpha"]: one for one in found["b"]["conditions"] if one["lambda_form"] == "dot"}
    assert [limits[alpha]["within"] for alpha in (10.0, 64.0, 200.0)] == ["never", "in passing", "from some gamma on"]
    assert limits[64.0]["gammas_within"] == [64]
    assert {one["verdict"] for one in found.values()} <= set(VERDICTS)


def test_evidence_names_rows_of_the_run(engine_rows: pd.DataFrame) -> None:
    tables = Tables(accuracy=engine_rows)
    for one in judge(tables):
        for row in one.finding.evidence:
            table = getattr(tables, row["table"])
            mask = pd.Series(True, index=table.index)
            for column in TABLES[row["table"]].key:
                mask &= table[column].isna() if row[column] is None else (table[column] == row[column]).fillna(False)
            assert table.loc[mask, row["column"]].tolist() == [row["value"]]


def test_the_same_rows_give_the_same_bytes_in_any_order(engine_rows: pd.DataFrame) -> None:
    def told(rows: pd.DataFrame) -> str:
        return json.dumps([one.as_dict() for one in judge(Tables(accuracy=rows))], allow_nan=False)

    once = told(engine_rows)
    assert told(engine_rows.sample(frac=1.0, random_state=1)) == once
    categories = dict.fromkeys(["approximation", "lambda_form", "perturbation", "stratum", "coverage"], "category")
    assert told(engine_rows.astype(categories)) == once


def test_the_answer_of_a_stored_run_is_strict_json(stored: Callable[..., Run]) -> None:
    found = answer(stored())
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert found["run"] == "20260101-000000-0123abcd"
    assert {claim["key"] for claim in found["claims"]} == set("abcdefghijkl")


def test_a_stored_run_that_is_partial_or_changed_is_refused(stored: Callable[..., Run]) -> None:
    with pytest.raises(InputError, match="--resume"):
        answer(stored("20260101-000000-0123abcd", state="partial"))
    run = stored("20260102-000000-0123abcd")
    path = run.path / "accuracy.parquet"
    path.write_bytes(path.read_bytes()[:-1] + b"?")
    with pytest.raises(CorruptRunError, match="bytes have changed"):
        answer(run)


def test_a_rule_that_lacks_rows_is_an_input_error_with_a_mend() -> None:
    with pytest.raises(LackingRowsError) as lacking:
        claims.CLAIMS[0].rule(Rows(Tables()))
    assert isinstance(lacking.value, InputError)
    assert "phongbench run" in str(lacking.value.fix)


def test_plain_data_has_neither_numpy_nor_what_json_lacks() -> None:
    found = plain({"a": (np.float64("inf"), np.int64(2), pd.NA), 1: [float("nan"), None, "x"]})
    assert found == {"a": [None, 2, None], "1": [None, None, "x"]}
    assert type(found["a"][1]) is int


def test_exponents_are_told_as_all_a_range_or_a_list() -> None:
    measured = [5.0, 10.0, 20.0, 50.0, 100.0]
    assert exponents(measured, measured) == "every exponent (5 .. 100)"
    assert exponents(measured[1:4], measured) == "alpha 10 .. 50"
    assert exponents([5.0, 20.0, 100.0], measured) == "alpha 5, 20 and 100"
    assert exponents([5.0], measured) == "alpha 5"
    assert exponents([], measured) == "none of the 5 exponents"
    assert listed([]) == "none"
    assert [times(ratio) for ratio in (0.97, 3.56, 164.2, 2e9)] == ["0.97", "3.6", "160", "over a million"]
    assert (codes(CODE), codes(0.1), rounded(63779.6)) == ("1 code", "26 codes", "63,800")
