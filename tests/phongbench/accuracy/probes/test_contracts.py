"""Rows by contract: one for each gated cell that a standard speaks of, and none below what was measured."""

from dataclasses import replace

import pandas as pd

from phongbench.accuracy import sweep
from phongbench.accuracy.probes import consistency, contracts
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.analysis.promises import contract_at
from phongbench.formulas.formula import Formula
from phongbench.inputs.plan import Plan, preset
from phongbench.results.schema import ACCURACY

PLAN = replace(
    preset("quick"),
    alphas=(20.0, 50.0, 400.0),
    gammas=(8,),
    lambda_forms=("dot", "tan2"),
    approximations=("phong", "lyon", "gaussian"),
    slopes=("taylor",),
    precisions=("float16", "float32", "float64"),
    raw=(),
    timing=False,
).validated()


def measured(plan: Plan, notes: list[str]) -> pd.DataFrame:
    return contracts.measure(ProbeContext(sweep.prepare(plan), pd.DataFrame(), pd.DataFrame(), detail=notes.append))[
        "accuracy"
    ]


def test_rows_hold_the_bounds_of_both_precisions_at_the_exponents_nearest_to_10_and_50() -> None:
    notes: list[str] = []
    rows = measured(PLAN, notes)
    assert list(rows.columns) == ACCURACY.names
    assert not rows.duplicated(ACCURACY.key).any()
    assert set(rows["coverage"]) == {"contract"}
    assert set(rows["precision"]) == {"float16", "float32"}
    assert set(rows["alpha"]) == {20.0, 50.0}
    assert rows["gated"].all()
    for row in rows.to_dict("records"):
        formula = Formula.of_row(row)
        assert row["max_abs"] == contract_at(formula, row["alpha"], row["precision"], limited=False)
    assert "lyon" in set(rows["approximation"])
    assert ("gaussian", "tan2") not in set(zip(rows["approximation"], rows["lambda_form"], strict=True))
    left = sum(contracts.meant(cell, PLAN) for cell in PLAN.cells()) - len(rows)
    assert f"{left} of" in notes[0]
    assert f"it divides by the squared cosine, which vanishes at a right angle ({left})" in notes[0]


def test_a_bound_below_what_was_measured_or_proven_is_a_contradiction() -> None:
    bounds = measured(replace(PLAN, approximations=("phong",)).validated(), [])
    here = bounds.assign(stratum="highlight", coverage="sampled", length_max=0.0)
    assert consistency.violations(pd.concat([bounds, here], ignore_index=True)) == []
    above = here.assign(max_abs=1.01 * here["max_abs"])
    told = consistency.violations(pd.concat([bounds, above], ignore_index=True))
    assert len(told) == len(above)
    assert all("above contract" in sentence for sentence in told)
    proven = bounds.assign(
        stratum="cosines", coverage="certified", precision="exact", model_max=1.1 * bounds["max_abs"]
    )
    proven = proven.assign(max_abs=proven["model_max"]).sort_values("max_abs").drop_duplicates("alpha", keep="last")
    assert consistency.violations(pd.concat([bounds, proven], ignore_index=True))
