"""The figures of the made-up run, and of one with rows that start from N, L and V."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pandas as pd
import pytest

from phongbench.analysis.rows import Rows, at
from phongbench.formulas.formula import Formula
from phongbench_reports.figures import FIGURES
from phongbench_reports.plots import Plate, ink
from phongbench_reports.second_process import Drawn


@pytest.fixture(scope="session")
def study(run: Any) -> Rows:
    return Rows(run)


#: figures of formulas that remove lengths or start from N, L and V
OF_RAW = ("raw_vectors", "step_costs")
#: recipe -> error on unit vectors, error gained per 1 % of wrong length, time / exact Phong
RECIPES = {
    "phong@reflect/each": (1e-6, 0.0, 3.0),
    "phong@lengthwise/once": (1e-6, 0.0, 1.6),
    "lyon:cross:8@lengthwise": (1e-3, 0.01, 0.5),
    "lyon:dot:8@lengthwise": (1e-3, 0.3, 0.4),
}
NORMALISING = {"phong/each": 2.0, "phong/once": 1.5, "phong/squared": 1.2, "phong/fast": 1.8, "phong@lengthwise": 1.3}


def of(spelling: str, row: pd.DataFrame, **values: Any) -> pd.DataFrame:
    """The one row, with the columns of this formula."""
    f = Formula.parse(spelling)
    key = {n: getattr(f, n) for n in ("approximation", "lambda_form", "space", "gamma", "recipe", "normalise")}
    return row.assign(**key, **values).astype({"gamma": "Int64"})


def with_recipes(run: Any) -> Any:
    """The run with recipes from N, L and V at three sizes of both signs and any length, and their times."""
    one = at(run.accuracy, approximation="phong", stratum="highlight", precision="float32", alpha=50.0).head(1)
    errors = [
        of(
            name, one, stratum="configurations", perturbation=way, length_error=e, nonfinite=0, beta_policy="none"
        ).assign(max_abs=least + gain * 100 * (abs(e) + (e < 0) * abs(e)))
        for name, (least, gain, _) in RECIPES.items()
        for way, e in (("none", 0.0), *(("both", s * e) for e in (0.001, 0.01, 0.05) for s in (1, -1)), ("any", 0.0))
    ]
    told = at(run.timing, approximation="schlick", precision="float32", working_set="l1").head(1)
    ratios = {name: ratio for name, (_, _, ratio) in RECIPES.items()} | NORMALISING
    times = [of(name, told, ratio=r, ratio_low=0.99 * r, ratio_high=1.01 * r, ns_min=r) for name, r in ratios.items()]
    tables = {"accuracy": [run.accuracy, *errors], "timing": [run.timing, *times]}
    return replace(run, **{name: pd.concat(parts, ignore_index=True) for name, parts in tables.items()})


@pytest.fixture(scope="session")
def plates(study: Rows, drawings: dict[str, Drawn]) -> dict[str, Plate]:
    raw = Rows(with_recipes(study.run))
    with ink():
        found = {p.name: p.make(raw) if p.name in OF_RAW else drawings[p.name].content for p in FIGURES}
    return {name: plate for name, plate in found.items() if isinstance(plate, Plate)}
