"""Written code is measured: to the bit as a C compiler makes it, and never beyond what is proven of devices."""

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from shader_builds import CASES, built, formula_of, text_of

from phongbench.accuracy import sweep
from phongbench.accuracy.enclosures import contract
from phongbench.accuracy.probes import consistency, emitted
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.compiler.precisions import FLOAT16, FLOAT32, precision_named
from phongbench.errors import InputError
from phongbench.formulas.curves import exact
from phongbench.formulas.formula import Formula
from phongbench.formulas.shader_code.export import folding
from phongbench.formulas.shader_code.language import Language
from phongbench.formulas.shader_code.languages import GLSL, C
from phongbench.formulas.shader_code.measured import compiled, fuses
from phongbench.inputs.plan import Plan, preset
from phongbench.results.emitted_table import EMITTED

ALPHA = 50.0
PLAN = replace(
    preset("quick"),
    alphas=(20.0, ALPHA, 400.0),
    gammas=(8,),
    lambda_forms=("dot", "cross"),
    approximations=("phong", "lyon", "bit-trick"),
    slopes=("taylor",),
    raw=(),
    timing=False,
).validated()
#: of operations that are rounded to nearest alone: a library's powers and arcs are its own
ARITHMETIC = ("lyon:dot:8", "lyon:dot:32:minimax", "lyon:cross:8", "lyon:tan2:8", "schlick", "lyon-quadratic:dot:8")


def measured(plan: Plan, violations: list[str]) -> pd.DataFrame:
    context = ProbeContext(sweep.prepare(plan), pd.DataFrame({"coverage": []}), pd.DataFrame(), violations=violations)
    return dict(emitted.measure(context))["emitted"]


@pytest.fixture(scope="module")
def rows() -> pd.DataFrame:
    """The table of PLAN."""
    return measured(PLAN, [])


def values(formula: Formula, language: Language, *, fused: bool = False) -> tuple[Any, Any]:
    """What code gives where the probe measures it, and exact Phong there."""
    precision = precision_named(language.precision)
    given = emitted.inputs(formula, precision, of_cosines=formula.lambda_form in ("none", "dot"))
    code = compiled(formula.spec(), formula, formula.setting(ALPHA), language, limited=True, fused=fused)
    value = np.broadcast_to(code(given.a, given.b), given.cosines.shape).astype(np.float64)
    return value, exact(ALPHA, given.cosines)


def test_each_cell_has_rows_of_both_ways_to_write_and_to_round(rows: pd.DataFrame) -> None:
    assert list(rows.columns) == EMITTED.names
    assert not rows.duplicated(EMITTED.key).any()
    assert set(rows["alpha"]) == {20.0, ALPHA}
    lyon = rows[(rows["approximation"] == "lyon") & (rows["lambda_form"] == "dot") & (rows["space"] == "reflect")]
    assert set(zip(lyon["code"], lyon["fused"], lyon["precision"], strict=True)) == set(
        itertools.product(("gpu", "c"), (False, True), ("float16", "float32"))
    )
    assert not rows[rows["approximation"] == "phong"]["fused"].any(), "its code adds no constant to a product"
    assert set(rows[rows["approximation"] == "bit-trick"]["precision"]) == {"float32"}, "no bits of a float16"
    of_cosines = rows[rows["stratum"] == "cosines"].groupby("precision")["coverage"].unique()
    assert [*of_cosines["float16"], *of_cosines["float32"]] == ["exhaustive", "sampled"]


def test_rows_are_the_metrics_of_the_values(rows: pd.DataFrame) -> None:
    formula = Formula.parse("lyon:dot:8")
    for name, fused in itertools.product(("float32", "float16"), (False, True)):
        value, truth = values(formula, GLSL.in_precision(name), fused=fused)
        mine = rows[(rows["approximation"] == "lyon") & (rows["lambda_form"] == "dot") & (rows["space"] == "reflect")]
        mine = mine[(mine["alpha"] == ALPHA) & (mine["precision"] == name) & (mine["fused"] == fused)]
        row = mine[mine["code"] == "gpu"].iloc[0]
        error = value - truth
        assert row["max_abs"] == np.abs(error).max() == max(row["max_above"], row["max_below"])
        assert row["samples"] == len(value)
        assert row["bias"] == pytest.approx(error.mean(), rel=1e-9)
        assert row["mean_abs"] <= row["rms"] <= row["max_abs"]
        assert (row["above_one"], row["negative"], row["nonfinite"]) == (0, 0, 0)


def test_in_float32_code_differs_from_the_kernel_by_its_folded_constants_alone(rows: pd.DataFrame) -> None:
    lyon = rows[(rows["approximation"] == "lyon") & (rows["precision"] == "float32")]
    for row in lyon.to_dict("records"):
        setting = Formula.of_row(row).setting(row["alpha"])
        assert row["change_max"] <= folding(setting) + 4 * 2.0**-24
    assert lyon["change_max"].max() > 0, "it is another rounding"


def test_an_unfused_constant_costs_a_dot_form_in_float16_what_a_fused_one_does_not(rows: pd.DataFrame) -> None:
    """1 - beta (1 - d) has a small subtrahend near the peak; beta d - (beta - 1) has two large ones."""
    lyon = rows[(rows["lambda_form"] == "dot") & (rows["precision"] == "float16") & (rows["code"] == "gpu")]
    errors = lyon[lyon["alpha"] == ALPHA].groupby(["space", "fused"])["max_abs"].max().unstack()
    assert (errors[False] > 1.03 * errors[True]).all()


@pytest.mark.parametrize("spelling", ARITHMETIC)
def test_a_c_compiler_makes_the_same_of_it_to_the_bit(spelling: str, tmp_path: Path) -> None:
    formula = Formula.parse(spelling)
    given = emitted.inputs(formula, FLOAT32, of_cosines=formula.lambda_form in ("none", "dot"))
    code = built("c", text_of(formula, "c", ALPHA), tmp_path)
    value, _ = values(formula, C)
    assert np.array_equal(code(given.a, given.b).astype(np.float64), value)


def test_a_compiler_that_fuses_makes_the_same_of_fused_code(tmp_path: Path) -> None:
    if "fma" not in Path("/proc/cpuinfo").read_text().split():
        pytest.skip("no fused multiply-adds here")
    formula = Formula.parse("lyon:dot:8")
    given = emitted.inputs(formula, FLOAT32, of_cosines=True)
    code = built("c", text_of(formula, "c", ALPHA), tmp_path, "-O2", "-mfma", "-ffp-contract=fast")
    fused, plain = (values(formula, C, fused=way)[0] for way in (True, False))
    assert np.array_equal(code(given.a, given.b).astype(np.float64), fused)
    assert not np.array_equal(fused, plain)


@pytest.mark.parametrize(("name", "form", "space"), CASES)
def test_no_code_errs_beyond_what_is_proven_of_devices(name: str, form: str, space: str) -> None:
    """Given the exact cosine, where its bound is sharpest; of the other forms on pairs made unit."""
    formula = formula_of(name, form, space)
    of_cosines = form in ("none", "dot")
    for precision in (FLOAT32, FLOAT16):
        language = GLSL.in_precision(precision.name)
        spec, setting = formula.spec(), formula.setting(ALPHA)
        try:
            ways = (False, True) if fuses(spec, formula, setting, language) else (False,)
        except InputError:
            assert (name, precision) == ("bit-trick", FLOAT16) or name == "gaussian-quadratic"
            continue
        errors = [np.abs(np.subtract(*values(formula, language, fused=way))).max() for way in ways]
        domain = contract.COSINE if of_cosines else contract.UNIT
        bound = contract.largest(spec, formula, setting, precision, domain=domain)
        assert max(errors) <= bound, (precision.name, max(errors), bound)


def test_code_above_its_bound_by_contract_is_a_contradiction(rows: pd.DataFrame) -> None:
    code = rows[(rows["code"] == "gpu") & ~rows["fused"]]
    bounds = code.assign(coverage="contract", gated=True, stratum="devices")
    assert consistency.of_written_code(code, bounds) == []
    told = consistency.of_written_code(code, bounds.assign(max_abs=0.99 * bounds["max_abs"]))
    assert len(told) == len(code)
    assert "written code's" in told[0]


def test_standard_and_full_ask_for_it() -> None:
    assert {name for name in ("quick", "standard", "full") if "emitted" in preset(name).probes} == {"standard", "full"}
