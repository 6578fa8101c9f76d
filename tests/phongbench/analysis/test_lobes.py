"""The lobes of a run in short: one row a formula, at the usual exponent and gamma."""

import pandas as pd

from phongbench.analysis.lobes import beside_phong
from phongbench.results.records import Records
from phongbench.results.schema import TABLES


def row(name: str, alpha: float, ratio: float, **more: object) -> dict[str, object]:
    usual = {"approximation": name, "lambda_form": "none", "space": "reflect", "beta_policy": "none", "gamma": None}
    ratios = {"energy_ratio": ratio, "momentum_ratio": ratio + 1, "half_width_ratio": ratio + 2}
    return usual | {"alpha": alpha, "incidence_degrees": 0.0} | ratios | more


def rows() -> pd.DataFrame:
    lyon = {"lambda_form": "dot", "beta_policy": "taylor"}
    return TABLES["moments"].frame(
        [
            row("phong", 10.0, 1.0),
            row("phong", 64.0, 1.0),
            row("lyon", 64.0, 0.5, gamma=2, **lyon),
            row("lyon", 64.0, 0.9, gamma=16, **lyon),
            row("lyon", 64.0, 0.95, gamma=16, **lyon | {"beta_policy": "minimax"}),
            row("lyon", 64.0, 0.8, gamma=16, space="half", **lyon),
            row("blinn", 64.0, 0.7, space="half", beta_policy="taylor"),
            row("blinn", 64.0, 0.1, space="half", beta_policy="taylor", incidence_degrees=60.0),
        ]
    )


def test_each_formula_and_pair_has_its_first_row_at_the_usual_exponent_and_gamma() -> None:
    found = beside_phong(Records.of(rows()))
    assert [one["name"] for one in found] == ["phong", "lyon:dot:16", "lyon:dot:16@half", "blinn"]
    assert {one["alpha"] for one in found} == {64.0}
    assert found[1] == {"name": "lyon:dot:16", "alpha": 64.0, "light": 0.9, "momentum": 1.9, "half width": 2.9}


def test_without_the_table_there_are_no_rows() -> None:
    assert beside_phong(Records.none("moments")) == []
