"""WGSL: naga takes all of it, and what a device makes of it is what the kernels give."""

from typing import Any

import numpy as np
import pytest
from catalogue import everything
from shader_builds import ALPHA, CASES, formula_of, pairs, writable
from wgsl_device import refusal, rounds_to_nearest, values

from phongbench.accuracy.enclosures import contract
from phongbench.compiler.precisions import FLOAT16, FLOAT32, Precision
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import highlights
from phongbench.formulas.shader_code.export import source
from phongbench.formulas.shader_code.languages import LANGUAGES
from phongbench.formulas.shader_code.measured import compiled, cosines, directions

WGSL = LANGUAGES["wgsl"]
PRECISIONS = (FLOAT32, FLOAT16)
NAMES = [precision.name for precision in PRECISIONS]
#: what an arc cosine may add that is as wrong as WGSL lets it be
ARC = {"kuijk-blake": 2e-3}
#: half a step of float32 at 1
UNIT = 2.0**-24
#: of what is done to raw vectors, each once, and recipes with the ways that they are used with
RAW = (
    *("phong/each", "phong/once", "phong/squared", "lyon:dot:8/once", "lyon:cross:8/once", "lyon:difference:8/each"),
    *("phong@reflect", "lyon:dot:8@reflect/each", "lyon:cross:8@lengthwise/once", "blinn@halfway/once"),
)


def run(formula: Formula, precision: Precision, *given: Any) -> Any:
    """What the device gives of directions that the precision holds."""
    language = WGSL.in_precision(precision.name)
    return values(source(formula, ALPHA, language), language.direction[0], *given)


@pytest.mark.parametrize("precision", PRECISIONS, ids=NAMES)
def test_naga_takes_every_formula(precision: Precision) -> None:
    """In every form, recipe, way with lengths and slope, over-long vectors limited and kept."""
    language, taken, refused = WGSL.in_precision(precision.name), 0, []
    for formula in everything():
        for limited in (True, False):
            try:
                text = source(formula, ALPHA, language, limited=limited)
            except InputError:  # bits of a float16, and tricks of processors
                assert formula.normalise in ("fast", "estimate") or not writable(formula, "wgsl", precision.name)
                continue
            taken += 1
            if said := refusal(text):
                refused.append(f"{formula}: {said}")
    assert refused == []
    assert taken > 600


def test_naga_refuses_what_is_wrong() -> None:
    assert "unknown" in refusal("fn f() -> f32 { return unknown(1.0); }")


@pytest.mark.parametrize(("name", "form", "space"), CASES)
def test_on_a_device_it_gives_what_the_kernel_gives(name: str, form: str, space: str) -> None:
    """Within what multiply-adds and the device's own power leave, and the arc cosine, which WGSL lets err by 6.77e-5.

    Zero vectors and those whose squares vanish are among them; of NaN WGSL promises nothing.
    """
    formula = formula_of(name, form, space)
    given = pairs(ALPHA)
    finite = np.isfinite(given[0]).all(axis=1) & np.isfinite(given[1]).all(axis=1)
    a, b = (v[finite] for v in given)
    setting = formula.setting(ALPHA)
    expected = highlights(formula.spec(), form, setting, a, b, layout="aos")
    room = 4 * setting.exponent * UNIT + ARC.get(name, 0.0)
    np.testing.assert_allclose(run(formula, FLOAT32, a, b), expected, rtol=1e-4, atol=room)


@pytest.mark.parametrize("spelling", [*(str(formula_of(*case)) for case in CASES), *RAW])
def test_it_gives_what_the_statements_give_in_numpy(spelling: str) -> None:
    """To the bit on Mesa's software device, which rounds to nearest, but for powers, exponentials and arcs."""
    formula = Formula.parse(spelling)
    spec, setting = formula.spec(), formula.setting(ALPHA)
    for precision in PRECISIONS:
        if not writable(formula, "wgsl", precision.name):
            continue  # it reads a float's bits
        given = [one.astype(precision.dtype) for one in directions(formula, np.linspace(0.0, 80.0, 500))]
        language = WGSL.in_precision(precision.name)
        ways = [
            compiled(spec, formula, setting, language, limited=True, fused=fused)(*given) for fused in (False, True)
        ]
        values = run(formula, precision, *given)
        off = np.min([np.abs(values - way.astype(np.float64)) for way in ways], axis=0)
        exact = rounds_to_nearest() and not spec.cost.transcendentals
        assert off.max() <= (0.0 if exact else 4 * setting.exponent * precision.eps + ARC.get(spec.name, 0.0))


@pytest.mark.parametrize("precision", PRECISIONS, ids=NAMES)
@pytest.mark.parametrize(("name", "form"), [case[:2] for case in CASES if case[2] == "reflect"])
def test_a_device_errs_no_more_than_its_contract(name: str, form: str, precision: Precision) -> None:
    """On directions that are unit but for their rounding, of a plane, up to 80 degrees apart."""
    formula = formula_of(name, form, "reflect")
    if not writable(formula, "wgsl", precision.name):
        pytest.skip("it reads a float's bits")
    given = [one.astype(precision.dtype) for one in directions(formula, np.linspace(0.0, 80.0, 4000))]
    exact = np.maximum(cosines(formula, given), 0.0) ** ALPHA
    error = float(np.abs(run(formula, precision, *given) - exact).max())
    assert error <= contract.largest(formula.spec(), formula, formula.setting(ALPHA), precision)
