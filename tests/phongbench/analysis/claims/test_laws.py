"""Claims j and k: what follows from formulas alone."""

import numpy as np
import pytest
from claim_tables import CODE, judged

from phongbench.analysis.claims.incidence import rise
from phongbench.analysis.claims.mirror import energy_within, exponent_of, half_width


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
