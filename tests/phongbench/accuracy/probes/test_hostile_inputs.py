"""Hostile input: what each formula makes of it is known, and follows from IEEE arithmetic and the gate on a.b > 0."""

from dataclasses import replace

import numpy as np
import pytest

from phongbench.accuracy import probes, sweep
from phongbench.accuracy.probes import hostile_inputs
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.compiler.lowering import FLOAT16, FLOAT32, FLOAT64, precision_named
from phongbench.formulas import lambda_forms
from phongbench.inputs.plan import preset
from phongbench.results.schema import BEHAVIOUR

VECTORS = (
    "a is zero",
    "both are zero",
    "both are subnormal",
    "both are huge",
    "a is huge",
    "a holds NaN",
    "a is infinite",
    "a = -b",
)
WORDS = {"v": "value", "s": "saturates", "n": "nan", "i": "infinite", "a": "above-one", "-": "negative", "r": "refused"}
#: (formula, form, gated) -> the outcome of VECTORS in float32, in order, and why
PINNED = {
    # zero and subnormal: a.b is 0, the gate is shut, dark. Huge: lambda is -inf, the line above 1 without end.
    # NaN: the positive part is 0. Infinite: a.b is infinite where no component is 0, NaN elsewhere.
    ("lyon", "dot", True): "sssiisiv",
    # without the gate lambda is 1 there, beyond the cutoff: the same
    ("lyon", "dot", False): "sssiisiv",
    # a - b is 0 where both are huge: 1, as it should be; infinite where one is
    ("lyon", "difference", True): "sssvsssv",
    # without the gate two zero vectors are equal, so they shine; so do subnormal ones, rightly
    ("lyon", "difference", False): "ssvvsssv",
    # of huge vectors a x b is inf - inf, NaN, dark, where no component is 0, and 0, bright, along the axes
    ("lyon", "cross", True): "sssssssv",
    # without the gate a zero vector shines with every other, and a = -b again, fully: the ghost
    ("lyon", "cross", False): "ssvsssss",
    # 0/0 for zero vectors, NaN where both are huge: dark; where one is, (a.b)^2 = inf divides a x b away: bright
    ("lyon", "tan2", True): "ssssvssv",
    ("gaussian", "dot", True): "sssiisiv",
    ("gaussian", "difference", True): "sssvsssv",
    ("gaussian", "cross", False): "ssvsssss",
    ("phong", "none", True): "sssiisiv",
    # beyond its pole x = alpha / (alpha - 1) the denominator is negative, and inf / -inf is NaN
    ("schlick", "none", True): "sssn-snv",
    # exponents are limited to what bits can hold
    ("bit-trick", "none", True): "sssaasav",
    # a table's end is its end: bright for an infinite cosine, but u of a lambda of -inf bends back up to inf: dark
    ("table-x", "none", True): "sssvvssv",
    ("table-u", "dot", True): "sssssssv",
}


@pytest.fixture(scope="module")
def context():
    plan = replace(
        preset("quick"),
        alphas=(50.0,),
        gammas=(8,),
        slopes=("taylor",),
        timing=False,
        lambda_forms=tuple(lambda_forms.LAMBDA_FORMS),
        precisions=("float32", "float16", "q1.15", "bfloat16", "float64"),
    ).validated()
    return ProbeContext(sweep.prepare(plan), None, None)


@pytest.fixture(scope="module")
def rows(context):
    return hostile_inputs.measure(context)["behaviour"]


def outcomes(rows, name, form, gated=True, precision="float32", space="reflect"):
    mine = rows[(rows["approximation"] == name) & (rows["lambda_form"] == form) & (rows["gated"] == gated)]
    mine = mine[(mine["precision"] == precision) & (mine["space"] == space)]
    return mine.set_index("case")["outcome"]


@pytest.mark.parametrize("key", PINNED, ids=lambda k: f"{k[0]}-{k[1]}{'' if k[2] else '-open'}")
def test_what_becomes_of_hostile_vectors(rows, key):
    found = outcomes(rows, *key)
    assert {case: found[case] for case in VECTORS} == {
        case: WORDS[letter] for case, letter in zip(VECTORS, PINNED[key], strict=True)
    }


def test_every_cell_answers_every_case_and_the_table_is_the_contracts(rows, context):
    assert list(rows.columns) == BEHAVIOUR.names
    outcomes = {"value", "saturates", "nan", "infinite", "above-one", "negative", "refused"}
    assert set(rows["outcome"]) <= outcomes
    key = ["approximation", "lambda_form", "space", "precision", "gated"]
    assert not rows.duplicated([*key, "case"]).any()
    cells = {(c.approximation, c.lambda_form, c.formula.space, c.precision, c.gated) for c in context.sweep.cells}
    assert {tuple(k) for k in rows[key].itertuples(index=False)} == cells
    assert set(rows.groupby(key).size()) == {8 + 12, 9 + 12}


def test_no_half_vector_is_dark(rows):
    """At L = -V the half vector is 0 / 0; Phong is 0 there, and so is every formula of (N, H).

    Fixed point has no NaN to tell: it makes a zero vector of it, with which only the gate can deal.
    """
    mine = rows[(rows["case"] == "L = -V") & (rows["gated"] | (rows["precision"] != "q1.15"))]
    assert set(mine["space"]) == {"half"}
    assert (mine["outcome"] == "value").all()
    assert (mine["highest"] == 0).all()


def test_only_dividing_by_what_vanishes_gives_nan(rows):
    assert set(rows.loc[rows["outcome"] == "nan", "approximation"]) == {"schlick"}


def test_fixed_point_knows_neither_nan_nor_infinity(rows):
    mine = rows[rows["precision"] == "q1.15"]
    assert not {"nan", "infinite"} & set(mine["outcome"])
    assert mine["highest"].max() < 2


@pytest.mark.parametrize("precision", ["float16", "float32", "bfloat16", "float64"])
def test_an_exponent_of_0_is_1_wherever_light_can_be(rows, precision):
    for name, form in (("phong", "none"), ("lyon", "dot"), ("gaussian", "cross")):
        found = outcomes(rows, name, form, precision=precision)
        assert [found[f"alpha 0 {place}"] for place in hostile_inputs.PLACES] == ["value", "value", "value"]


def test_without_the_gate_an_exponent_of_0_leaks_light(rows):
    assert outcomes(rows, "lyon", "dot", gated=False)["alpha 0 at 90 degrees"] == "saturates"


def test_an_exponent_beyond_float16_makes_the_peak_dark_there(rows):
    """Its coefficient is infinite, and infinite times lambda = 0 is NaN."""
    for name in ("lyon", "gaussian"):
        assert outcomes(rows, name, "dot", precision="float16")["alpha 1e30 at the peak"] == "saturates"
        assert outcomes(rows, name, "dot", precision="float32")["alpha 1e30 at the peak"] == "value"
    assert outcomes(rows, "gaussian", "dot", precision="float16")["alpha 1e5 at the peak"] == "saturates"
    assert outcomes(rows, "lyon", "dot", precision="float16")["alpha 1e5 at the peak"] == "value"


def test_a_formula_that_takes_no_such_exponent_refuses_it(rows):
    found = outcomes(rows, "kuijk-blake", "none")
    assert found[[c for c in found.index if c.startswith("alpha")]].eq("refused").all()
    assert outcomes(rows, "lyon-quadratic", "dot")["alpha 0 at the peak"] == "refused"


@pytest.mark.parametrize(
    ("values", "exact", "wanted"),
    [
        ([0.5, np.nan, 2.0], 1.0, "nan"),
        ([np.inf, -1.0], 1.0, "infinite"),
        ([1.5, -1.0], 1.0, "above-one"),
        ([0.5, -1e-9], 1.0, "negative"),
        ([0.0, 1.0], np.nan, "saturates"),
        ([0.0, 0.0], 1.0, "saturates"),
        ([0.0, 0.0], 0.0, "value"),
        ([1.0], 1.0, "value"),
        ([0.0, 0.5], np.nan, "value"),
    ],
)
def test_the_worst_value_decides(values, exact, wanted):
    assert hostile_inputs.outcome(np.array(values), exact) == wanted


@pytest.mark.parametrize("precision", [FLOAT16, FLOAT32, FLOAT64, precision_named("q1.15")], ids=lambda p: p.name)
def test_cases_are_what_their_names_say(precision):
    made = {c.name: [precision.rounded(v) for v in (c.a, c.b)] for c in hostile_inputs.cases(precision, "reflect")}
    a = made["both are subnormal"][0]
    assert 0 < np.abs(a).max() <= max(precision.smallest, precision.tiny / 2)
    if not precision.saturates:
        with np.errstate(over="ignore"):
            assert np.isinf(precision.rounded(np.square(made["both are huge"][0].astype(np.float64)).max()))
        assert np.isnan(made["a holds NaN"][0]).any(axis=0).all()
    assert np.array_equal(made["a = -b"][0], -made["a = -b"][1])


def test_the_forecast_grows_with_the_plan(context):
    probe = next(p for p in probes.PROBES if p.name == "hostile")
    wide = replace(context.plan, precisions=("float32",))
    assert 0 < probe.seconds(wide, 2) < probe.seconds(context.plan, 2) < 5
