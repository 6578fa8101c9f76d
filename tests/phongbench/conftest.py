"""Shared studies: real sweeps of the real engine, small enough to be made once for a session."""

from collections.abc import Callable
from dataclasses import replace

import pandas as pd
import pytest

from phongbench import engine, rows
from phongbench.plan import Plan, preset


def _swept(plan: Plan, jobs: int = 2) -> pd.DataFrame:
    """The accuracy rows of a plan."""
    sweep = engine.prepare(plan)
    engine.compile_kernels(sweep)
    return rows.accuracy(sweep, [rows.part(list(engine.run(sweep, jobs=jobs)))])


@pytest.fixture(scope="session")
def small_plan() -> Plan:
    """All strata, two precisions, few formulas, few pairs."""
    return replace(
        preset("quick"), alphas=(10.0, 50.0), gammas=(4, 8), approximations=("phong", "lyon", "gaussian"),
        slopes=("taylor",),
        precisions=("float16", "float32"), samples=6000, timing=False,
    ).validated()  # fmt: skip


@pytest.fixture(scope="session")
def small_rows(small_plan: Plan) -> pd.DataFrame:
    """The rows of `small_plan`."""
    return _swept(small_plan)


@pytest.fixture(scope="session")
def law_rows() -> pd.DataFrame:
    """Lyon on unit and on wrongly scaled vectors in float64, over the quick preset's exponents.

    What the laws speak about.
    """
    plan = replace(
        preset("quick"), approximations=("phong", "lyon", "gaussian"), slopes=("taylor", "minimax"),
        precisions=("float64",),
        spaces=("reflect",), lambda_forms=("dot", "difference", "cross", "tan2"), strata=("highlight", "lengths"),
        samples=1 << 14,
        timing=False,
    ).validated()  # fmt: skip
    return _swept(plan)


@pytest.fixture(scope="session")
def swept() -> Callable[..., pd.DataFrame]:
    """The accuracy rows of a plan, by (plan, jobs=2)."""
    return _swept
