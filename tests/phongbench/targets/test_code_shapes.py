"""A cost belongs to the shape of code: constants do not matter, everything else does."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY, example
from phongbench.formulas.spec import Approximation
from phongbench.targets.code_shapes import Code, by_shape, catalogue, code


def spelled(spec: Approximation) -> Formula:
    setting = example(spec)
    return Formula.of(spec.name, None, setting.gamma, setting.slope, setting.space)


def shape(spelling: str, alpha: float, language: str = "glsl") -> str:
    return code(Formula.parse(spelling), alpha, language).shape


@given(
    st.floats(17.5, 1e5),  # below, a slope of exactly 2 needs no constant
    st.sampled_from(["taylor", "minimax", "energy"]),
)
def test_exponent_and_slope_change_no_shape(alpha: float, slope: str) -> None:
    assert shape(f"lyon:dot:8:{slope}", alpha) == shape("lyon:dot:8", 50.0)


@pytest.mark.parametrize(("plain", "alpha"), [("phong", 1.0), ("lyon:dot:8", 8.0)])
def test_numbers_that_need_no_multiplication_do(plain: str, alpha: float) -> None:
    assert shape(plain, alpha) != shape(plain, 50.0)


def test_gamma_form_and_gate_do() -> None:
    shapes = [
        shape(f"lyon:{form}:{gamma}", 50.0) for form in ("dot", "difference", "cross", "tan2") for gamma in (4, 8)
    ]
    assert len({*shapes, shape("lyon:dot:8", 2.0)}) == 9


def test_a_whole_power_has_a_shape_for_each_exponent() -> None:
    assert len({shape("integer-power", float(alpha)) for alpha in range(1, 33)}) == 32


def test_comments_and_layout_are_no_part_of_it() -> None:
    plain = Code("", "float f(float x) {\n    return 2.0 * x;\n}")
    assert plain.shape == Code("", "// said\nfloat f(float x) { return 3.5e-07 * x; } // 1").shape
    assert plain.shape != Code("", "float f(float x) { return 2.0 + x; }").shape
    assert plain.shape != Code("", "float f(float x) { return x2 * x; }").shape


def test_the_catalogue_holds_every_formula_and_each_shape_once() -> None:
    codes = catalogue("glsl")
    assert {code(spelled(spec), example(spec).alpha, "glsl").shape for spec in REGISTRY.values()} <= {
        one.shape for one in codes
    }
    assert len(by_shape(codes)) == len(codes)
    assert {one.shape for one in codes} < set(by_shape(codes))
    assert len({one.shape for one in codes}) > 500


def test_a_slope_that_an_instruction_holds_has_an_exact_shape_of_its_own() -> None:
    four, other = (code(Formula.parse("lyon:dot:8"), alpha, "glsl") for alpha in (32.0, 50.0))
    assert four.shape == other.shape
    assert four.exact_shape != other.exact_shape
    assert other.exact_shape == other.shape
    assert by_shape([other, four]) == {other.shape: other, four.exact_shape: four}
    assert list(by_shape([four])) == [four.shape]


@pytest.mark.parametrize(
    ("named", "alpha", "matter"),
    [
        ("lyon:dot:8", 32.0, True),  # 4 d - 3: two numbers, of which an instruction holds one
        ("lyon:cross:8", 32.0, False),  # 1 - 2 c.c: one number beside one that is always held
        ("lyon:tan2:8", 32.0, True),  # scales a quotient
        ("phong", 4.0, True),
        ("schlick", 4.0, True),
    ],
)
def test_held_numbers_matter_beside_another_in_a_power_and_with_a_quotient(
    named: str, alpha: float, matter: bool
) -> None:
    assert code(Formula.parse(named), alpha, "glsl").held_numbers_matter == matter


def test_the_catalogue_has_exact_shapes_only_of_code_in_which_held_numbers_matter() -> None:
    further = [one for shape, one in by_shape(catalogue("glsl")).items() if shape != one.shape]
    assert further
    assert all(one.held_numbers_matter for one in further)


def test_an_exponent_that_a_formula_does_not_take_is_refused() -> None:
    with pytest.raises(InputError, match="alpha"):
        code(Formula.parse("kuijk-blake"), 100.0, "glsl")
