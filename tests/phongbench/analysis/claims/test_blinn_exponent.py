"""Claim g: Blinn's exponent."""

from typing import Any

import numpy as np
import pytest
from claim_tables import accuracy, judged

from phongbench.analysis.claims.blinn_exponent import equal_exponent_error, off_plane
from phongbench.formulas.minimax_fits import half_angle_ratio


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
