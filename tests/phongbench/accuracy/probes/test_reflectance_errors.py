"""The probe `incidence`: its errors are those of the texts, in every channel, and it tells where they lie."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from phongbench.accuracy.probes import incidence
from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32, FLOAT64
from phongbench.inputs.plan import Plan
from phongbench.results.schema import INCIDENCE

pytestmark = pytest.mark.skipif(jit.DISABLED, reason="thousands of angles, in plain Python")


@pytest.fixture(scope="module")
def rows() -> pd.DataFrame:
    return INCIDENCE.frame(incidence.rows([FLOAT32]))


def of(rows: pd.DataFrame, material: str, kind: str) -> pd.DataFrame:
    return rows[(rows["material"] == material) & (rows["reflectance"] == kind)]


def test_every_formula_is_measured_on_every_material_that_it_can_tell(rows: pd.DataFrame) -> None:
    assert not rows.duplicated(INCIDENCE.key).any()
    assert rows.notna().all(axis=None)
    measured = rows.groupby("material")["reflectance"].nunique()
    assert measured.to_dict() == {"copper": 6, "glass": 7}  # no dielectric is a metal


@pytest.mark.parametrize(
    ("material", "kind", "errors"),
    [
        ("glass", "schlick", [0.0357] * 3),
        ("copper", "schlick", [0.0245, 0.0386, 0.0396]),
        ("copper", "f82", [0.0070, 0.0058, 0.0016]),
        ("glass", "constant", [0.96] * 3),
    ],
)
def test_the_largest_errors_are_those_of_the_texts(
    rows: pd.DataFrame, material: str, kind: str, errors: list[float]
) -> None:
    found = of(rows, material, kind).set_index("channel")["max_abs"]
    assert found[["red", "green", "blue"]].tolist() == pytest.approx(errors, abs=6e-5)


def test_the_exact_formulas_err_by_roundings_only(rows: pd.DataFrame) -> None:
    exact = rows[rows["reflectance"].isin(["conductor", "dielectric"])]
    assert exact["max_abs"].max() < 1e-6
    assert (exact["within_degrees"] == 90).all()


def test_it_tells_where_a_code_is_exceeded_first(rows: pd.DataFrame) -> None:
    """Glass, constant: its reflectance is .04393 at the angle, a code above .04."""
    found = of(rows, "glass", "constant").iloc[0]
    index = 1.5
    c = np.cos(np.radians([found["within_degrees"], found["within_degrees"] + 90 / (incidence.ANGLES - 1)]))
    inside = np.sqrt(1 - (1 - c**2) / index**2)
    across, along = (c - index * inside) / (c + index * inside), (index * c - inside) / (index * c + inside)
    below, above = (across**2 + along**2) / 2 - 0.04
    assert below <= 1 / 255 < above
    assert found["error_60"] == pytest.approx(0.08919 - 0.04, abs=1e-5)
    assert found["error_85"] == pytest.approx(0.61280 - 0.04, abs=1e-5)
    assert found["worst_degrees"] == 90
    assert found["codes_8bit"] == pytest.approx(255 * found["max_abs"])


@pytest.mark.parametrize(
    ("precisions", "native"),
    [(("float16", "float32"), [FLOAT32]), (("float32", "float64"), [FLOAT32, FLOAT64]), (("q1.15",), [FLOAT32])],
)
def test_precisions_that_are_emulated_are_left_out(precisions: tuple[str, ...], native: list[Any]) -> None:
    plan = Plan(precisions=precisions)
    assert incidence.native(plan) == native
    table = incidence.measure(SimpleNamespace(plan=plan))["incidence"]  # type: ignore[arg-type]
    assert sorted(table["precision"].unique()) == [precision.name for precision in native]
    assert list(table.columns) == INCIDENCE.names
