"""Law 8 by measurement: the powers fitted to real rows are those of the law."""

import numpy as np
import pandas as pd
import pytest

from phongbench.analysis import length_sensitivity


@pytest.fixture(scope="module")
def fitted(law_rows):
    return length_sensitivity.fits(law_rows)


def of(fitted, form, way, least_gamma=16):
    mine = fitted[(fitted["lambda_form"] == form) & (fitted["perturbation"] == way) & (fitted["gamma"] >= least_gamma)]
    assert len(mine)
    return mine


@pytest.mark.parametrize(
    ("form", "way", "order"),
    [
        ("dot", "a", 1),
        ("dot", "both", 1),
        ("dot", "opposite", 2),
        ("difference", "both", 1),
        ("difference", "opposite", 2),
        ("cross", "a", 1),
        ("cross", "both", 1),
        ("cross", "opposite", 2),
    ],
)
def test_the_order_of_each_form(fitted, form, way, order):
    """Opposite errors leave the scale s = 1 - e^2: of `difference` the second order at the peak is left."""
    mine = of(fitted, form, way)
    assert (mine["exponent"] - order).abs().max() < 0.06
    assert (mine["exponent"] - mine["law_exponent"]).abs().max() < 0.04


@pytest.mark.parametrize("form", length_sensitivity.FORMS)
@pytest.mark.parametrize("way", length_sensitivity.WAYS)
def test_measured_changes_are_the_laws(fitted, form, way):
    mine = of(fitted, form, way)
    mine = mine[mine["alpha"] >= 20]
    assert (mine["largest_ratio"] < 1.08).all()


def test_at_the_peak_the_coefficient_is_that_of_the_law(fitted):
    """dot: alpha (e + d); difference: alpha (e - d)^2 / 2, so 2 alpha e^2; cross: nothing, whatever alpha."""
    for row in of(fitted, "dot", "a").itertuples():
        assert row.coefficient == pytest.approx(row.alpha, rel=0.35)  # expm1 bends the power
        assert row.coefficient == pytest.approx(row.law_coefficient, rel=0.05)
    for row in of(fitted, "difference", "opposite").itertuples():
        assert row.coefficient == pytest.approx(2 * row.alpha, rel=0.2)
    cross = of(fitted, "cross", "opposite")
    assert cross["coefficient"].max() < 1.2 * cross["coefficient"].min()


def test_on_the_flank_cross_is_twice_as_steep_as_difference(fitted):
    key = ["alpha", "gamma", "precision"]
    two = of(fitted, "cross", "both").merge(of(fitted, "difference", "both"), on=key, suffixes=("", "_difference"))
    two = two[two["alpha"] >= 20]
    assert len(two) >= 10
    assert np.allclose(two["coefficient"] / two["coefficient_difference"], 2, rtol=0.06)


def test_what_has_no_law_or_too_few_points_has_no_fit(fitted, law_rows):
    assert length_sensitivity.law("tan2", "a", 50.0, 8.0, np.array([0.01])) is None
    assert set(fitted["lambda_form"]) == set(length_sensitivity.FORMS)
    loud = law_rows.assign(rounding_max=1.0)
    none = length_sensitivity.fits(loud)
    assert none.empty
    assert tuple(none.columns) == length_sensitivity.COLUMNS
    assert np.isnan(length_sensitivity.power_of(np.array([0.1]), np.array([0.2]))).all()


def test_a_power_is_found_again():
    size = np.array([1e-4, 1e-3, 1e-2])
    assert length_sensitivity.power_of(size, 7 * size**1.5) == pytest.approx((1.5, 7))
    rows = pd.DataFrame(
        {"length_error": [1e-4, -1e-3, 1e-3, 0.1], "length_max": [1e-6, 1e-2, 1e-2, 5.0], "rounding_max": [1e-6] * 4}
    )
    assert length_sensitivity.small(rows)["length_error"].tolist() == [1e-3]


@pytest.mark.parametrize(("times", "clear"), [(9.5, False), (10.5, True)])
def test_a_change_is_clear_of_rounding_from_ten_times_on(times, clear):
    row = pd.DataFrame({"length_error": [1e-3], "length_max": [times * 1e-4], "rounding_max": [1e-4]})
    assert len(length_sensitivity.small(row)) == clear


@pytest.mark.parametrize(("sizes", "powers"), [([1e-3], 0), ([1e-4, 1e-3], 1)])
def test_two_clear_points_are_enough_for_a_power(sizes, powers):
    """Changes that are the law's own give the law's power, whatever that is."""
    change = length_sensitivity.law("dot", "a", 50.0, 8.0, np.array(sizes))
    key = {"approximation": "lyon", "beta_policy": "taylor", "gated": True, "space": "reflect", "stratum": "lengths"}
    key |= {"truth": "angle", "perturbation": "a", "lambda_form": "dot", "precision": "float64", "alpha": 50.0}
    rows = pd.DataFrame({"length_error": sizes, "length_max": change}).assign(**key, gamma=8, rounding_max=0.0)
    found = length_sensitivity.fits(rows)
    assert found["points"].tolist() == [2] * powers
    assert found["exponent"].tolist() == found["law_exponent"].tolist()
    assert found["largest_ratio"].tolist() == [1.0] * powers
