"""The probe of lobes: a row for every formula, exponent and incidence; laws beside them; cuts at small exponents."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from phongbench.accuracy import sweep
from phongbench.accuracy.probes import lobes
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.analysis.rows import at
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation, Setting
from phongbench.inputs.plan import preset
from phongbench.results.schema import CUTS, MOMENTS

ALPHAS = (10.0, 100.0)


@pytest.fixture(scope="module")
def context() -> ProbeContext:
    names = ("phong", "lyon", "gaussian", "blinn", "table-x", "kuijk-blake", "doom3")
    plan = replace(preset("quick"), alphas=ALPHAS, gammas=(8, 16), approximations=names, timing=False)
    return ProbeContext(sweep.prepare(plan.validated()), pd.DataFrame(), pd.DataFrame())


@pytest.fixture(scope="module")
def tables(context: ProbeContext) -> dict[str, pd.DataFrame]:
    return dict(lobes.measure(context))


def test_one_row_for_every_formula_exponent_and_incidence(tables: dict[str, pd.DataFrame]) -> None:
    rows = tables["moments"]
    assert list(rows.columns) == MOMENTS.names
    assert not rows.duplicated(MOMENTS.key).any()
    sizes = rows.groupby("approximation").size() / len(lobes.INCIDENCES)
    # two gammas, slopes and spaces and three forms of Lyon; Kuijk and Blake do not take alpha 100
    expected = {"phong": 2, "lyon": 48, "gaussian": 12, "blinn": 4, "table-x": 2, "kuijk-blake": 1, "doom3": 2}
    assert sizes.to_dict() == expected


def test_laws_stand_beside_light_along_the_normal_alone_and_agree(
    tables: dict[str, pd.DataFrame], context: ProbeContext
) -> None:
    rows = tables["moments"]
    with_law = rows[rows["momentum_law"].notna()]
    assert set(with_law["incidence_degrees"]) == {0.0}
    assert set(with_law["approximation"]) == {"phong", "lyon", "gaussian", "blinn"}
    np.testing.assert_allclose(with_law["momentum"], with_law["momentum_law"], rtol=1e-9)
    assert context.violations == []


def test_an_integral_that_is_not_its_law_is_a_violation(tables: dict[str, pd.DataFrame]) -> None:
    row = at(tables["moments"], approximation="lyon", lambda_form="dot", incidence_degrees=0.0).iloc[0].to_dict()
    assert lobes.disagreements([row]) == []
    [sentence] = lobes.disagreements([row | {"energy": 1.001 * row["energy"]}])
    assert sentence.startswith("energy of lyon (dot) at alpha 10")


def test_phong_is_the_measure_of_all_ratios(tables: dict[str, pd.DataFrame]) -> None:
    phong = at(tables["moments"], approximation="phong")
    for name in ("energy_ratio", "momentum_ratio", "half_width_ratio"):
        assert (phong[name] == 1).all()


def test_the_forms_dot_and_difference_are_the_same_lobe(tables: dict[str, pd.DataFrame]) -> None:
    lyon = at(tables["moments"], approximation="lyon")
    dot, difference = (at(lyon, lambda_form=form)["energy"].to_numpy() for form in ("dot", "difference"))
    np.testing.assert_array_equal(dot, difference)


def test_cuts_are_where_phong_and_the_gate_end_and_half_vectors_have_none(tables: dict[str, pd.DataFrame]) -> None:
    rows = tables["cuts"]
    assert list(rows.columns) == CUTS.names
    phong, blinn = at(rows, approximation="phong"), at(rows, approximation="blinn")
    assert phong["alpha"].tolist() == list(lobes.CUT_ALPHAS)
    assert (phong["cut_degrees"] == 90).all()
    np.testing.assert_allclose(phong["step"], math.sin(math.radians(1)) ** phong["alpha"], rtol=1e-9)
    assert blinn["cut_degrees"].isna().all()
    np.testing.assert_allclose(blinn["at_90"], 4.0 ** -blinn["alpha"], rtol=1e-9)
    gauss = at(rows, approximation="gaussian", alpha=1.0)
    assert gauss["step"].item() == pytest.approx(math.exp(-(1 - math.sin(math.radians(1)))), rel=1e-9)
    doom = at(rows, approximation="doom3")
    assert doom["cut_degrees"].unique().tolist() == [math.ceil(8 * 2 * math.degrees(math.acos(0.75))) / 8]


def test_a_cut_is_looked_for_once_for_each_formula_and_gamma(tables: dict[str, pd.DataFrame]) -> None:
    lyon = at(tables["cuts"], approximation="lyon")
    assert set(lyon["lambda_form"]) == {"dot"}
    assert set(lyon["beta_policy"]) == {"taylor"}
    assert not tables["cuts"].duplicated(CUTS.key).any()
    assert 0.0 not in set(at(tables["cuts"], approximation="doom3")["alpha"])  # it does not take alpha 0


def test_a_lobe_without_end_has_no_cut() -> None:
    assert all(map(math.isnan, lobes.cut(np.ones(1441))))
    values = np.zeros(1441)
    assert lobes.cut(values) == (0.0, 0.0)
    values[:10] = 1.0
    assert lobes.cut(values) == (10 / 8, 1.0)


def own(name: str, kernel: Callable[..., float], coefficients: Callable[[Setting], dict[str, float]]) -> Approximation:
    schlick = REGISTRY["schlick"]
    return replace(schlick, name=name, kernel=kernel, coefficients=coefficients, at_zero=None, falls=False)


def dark(cosine: float, level: float) -> float:
    """The same value everywhere."""
    return level


def pole(cosine: float, level: float) -> float:
    """Infinite at the peak."""
    return level / (1.0 - cosine)


def test_hostile_lobes_of_a_user_are_rows_and_no_crash() -> None:
    made = {
        "dark": own("dark", dark, lambda s: {"level": 0.0}),
        "nan": own("nan", dark, lambda s: {"level": math.nan}),
        "negative": own("negative", dark, lambda s: {"level": -1.0}),
        "pole": own("pole", pole, lambda s: {"level": 1.0}),
        "fails": own("fails", dark, lambda s: {"level": 1 / (s.alpha - 20)}),
    }
    registry = {**REGISTRY, **made}
    plan = replace(preset("quick"), alphas=(10.0, 20.0), gammas=(8,), approximations=tuple(made), timing=False)
    prepared = sweep.prepare(plan.validated(registry), registry)
    sweep.compile_kernels(prepared)
    found = lobes.measure(ProbeContext(prepared, pd.DataFrame(), pd.DataFrame()))
    upright = at(found["moments"], incidence_degrees=0.0, alpha=10.0).set_index("approximation")
    assert upright["energy"]["dark"] == 0
    assert upright["energy"]["negative"] == pytest.approx(-2 * math.pi)
    assert not math.isfinite(upright["energy"]["nan"])
    assert upright["half_width_degrees"][["dark", "nan"]].isna().all()
    assert set(at(found["moments"], approximation="fails")["alpha"]) == {10.0}
    assert 20.0 not in set(at(found["cuts"], approximation="fails")["alpha"])
    assert at(found["cuts"], approximation="dark")["cut_degrees"].unique().tolist() == [0.0]
