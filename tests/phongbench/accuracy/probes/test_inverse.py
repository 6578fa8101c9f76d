"""The probe `inverse`: exact Phong gives the normals back, approximations bend them in a known order."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from phongbench.accuracy import sweep
from phongbench.accuracy.probes import inverse
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.analysis.exponents import Exponents
from phongbench.analysis.inverse_errors import within
from phongbench.errors import InputError
from phongbench.inputs.plan import PRESETS, preset
from phongbench.inverse.surface_heights import integrate
from phongbench.inverse.surfaces import SURFACES, known_surface
from phongbench.results.inverse_table import INVERSE
from phongbench.results.records import Records, first_of


@pytest.fixture(scope="module")
def rows() -> pd.DataFrame:
    plan = replace(
        preset("quick"), alphas=(10.0, 50.0), gammas=(8, 32), approximations=("phong", "lyon", "gaussian", "schlick"),
        lambda_forms=("dot", "difference"), precisions=("float32",), probes=("inverse",),
    )  # fmt: skip
    context = ProbeContext(sweep.prepare(plan), pd.DataFrame(), pd.DataFrame(), jobs=2)
    return dict(inverse.measure(context))["inverse"]


def errors(rows: pd.DataFrame, alpha: float, **of: object) -> pd.Series:
    mine = rows[(rows["surface"] == "sphere") & (rows["lights"] == 4) & (rows["noise"] == "none")]
    for name, value in of.items():
        mine = mine[mine[name] == value]
    return mine[mine["alpha"] == alpha].iloc[0]


def test_every_formula_has_its_rows_once(rows: pd.DataFrame) -> None:
    assert not rows.duplicated(INVERSE.key).any()
    sizes = rows.groupby(INVERSE.key[:6], dropna=False).size()
    assert set(sizes) == {2 * (len(SURFACES) + len(inverse.NOISES) - 1)}
    assert {"matt", "phong"} <= set(rows["approximation"])
    equal = [
        rows[rows["lambda_form"] == form].drop(columns="lambda_form").reset_index(drop=True)
        for form in ("dot", "difference")
    ]
    pd.testing.assert_frame_equal(*equal)


def test_exact_phong_gives_the_normals_back(rows: pd.DataFrame) -> None:
    exact = rows[(rows["approximation"] == "phong") & (rows["noise"] == "none")]
    assert exact["max_degrees"].max() < 1e-6
    assert exact["residual_rms"].max() < 1e-12
    assert (exact["known"] > 0.9 * exact["samples"]).all()
    noisy = rows[(rows["approximation"] == "phong") & (rows["noise"] != "none") & (rows["lights"] == 4)]
    assert (noisy["mean_degrees"].between(0.01, 1.0)).all()


def test_formulas_come_in_the_order_of_their_errors(rows: pd.DataFrame) -> None:
    def mean(alpha: float, name: str, **of: object) -> float:
        return float(errors(rows, alpha, approximation=name, **of)["mean_degrees"])

    lyon = {
        (slope, gamma): {"beta_policy": slope, "gamma": gamma} for slope in ("taylor", "minimax") for gamma in (8, 32)
    }
    at_10 = [
        mean(10, "lyon", **lyon["minimax", 8]),
        mean(10, "lyon", **lyon["taylor", 8]),
        mean(10, "gaussian"),
        mean(10, "matt"),
        mean(10, "schlick"),
    ]
    at_50 = [
        mean(50, "lyon", **lyon["minimax", 32]),
        mean(50, "gaussian"),
        mean(50, "lyon", **lyon["minimax", 8]),
        mean(50, "lyon", **lyon["taylor", 8]),
        mean(50, "matt"),
        mean(50, "schlick"),
    ]
    assert at_10 == sorted(at_10)
    assert at_50 == sorted(at_50)
    assert errors(rows, 50, approximation="lyon")["median_degrees"] < 1e-6
    assert errors(rows, 50, approximation="schlick")["median_degrees"] > 0.1


def test_only_some_exponents_stand_for_all_and_quick_does_not_ask() -> None:
    assert inverse.chosen_alphas((1.0, 12.0, 400.0)) == [12.0, 400.0]
    assert inverse.chosen_alphas(preset("standard").alphas) == [10.0, 20.0, 50.0, 100.0, 200.0, 1000.0]
    asked = {name for name, plan in PRESETS.items() if "inverse" in plan.probes}
    assert asked == {"standard", "full"}
    assert inverse.seconds(preset("standard"), 2) > inverse.seconds(preset("quick"), 2) > 0


@pytest.mark.parametrize("name", SURFACES)
def test_normals_of_a_known_surface_are_those_of_its_heights(name: str) -> None:
    surface = known_surface(name, 48)
    found = integrate(surface.normals, surface.mask)[surface.mask]
    truth = surface.heights[surface.mask]
    assert np.abs((found - found.mean()) - (truth - truth.mean())).max() < 0.01 * np.ptp(truth)
    np.testing.assert_allclose(np.linalg.norm(surface.normals, axis=2)[surface.mask], 1.0)


def test_a_recommendation_may_ask_for_normals(rows: pd.DataFrame) -> None:
    run = type("Run", (), {"records": lambda self, name: Records.of(rows), "id": "made-up"})()
    keys = ["approximation", "lambda_form", "space", "beta_policy", "gamma"]
    cells = first_of((row for row in Records.of(rows).rows(keys) if row["approximation"] != "matt"), keys)
    known = {row["approximation"] for row in cells}
    notes: list[str] = []
    kept = within(cells, run, Exponents.of("10..50"), 0.2, notes)  # type: ignore[arg-type]
    assert {"phong", "lyon"} <= {row["approximation"] for row in kept} < known
    assert "schlick" not in {row["approximation"] for row in kept}
    assert f"{len(kept)} of {len(cells)} cells" in notes[0]
    assert len(within(cells, run, Exponents.of(50), 1e-9, notes)) == 1  # type: ignore[arg-type]
    for wrong in (0, -1, math.nan, "much"):
        with pytest.raises(InputError):
            within(cells, run, Exponents.of(50), wrong, notes)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="probe inverse"):
        within(cells, None, Exponents.of(50), 1.0, notes)
    with pytest.raises(InputError, match="outside"):
        within(cells, run, Exponents.of(500), 1.0, notes)  # type: ignore[arg-type]
