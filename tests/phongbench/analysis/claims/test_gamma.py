"""Claims a and b: how large gamma must be."""

from typing import Any

import pytest
from claim_tables import CODE, accuracy, judged, lyon

# a: gamma 4 or 8


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
