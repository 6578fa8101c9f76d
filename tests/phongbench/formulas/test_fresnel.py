"""Formulas of reflectance against complex arithmetic at 40 digits, the values of texts, and the laws of reflection."""

import itertools
import math
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from phongbench.compiler.lowering import FLOAT16, FLOAT32, FLOAT64
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.fresnel.catalogue import FAMILIES, KINDS
from phongbench.formulas.fresnel.f82 import DIP
from phongbench.formulas.fresnel.reflectance import Fresnel
from phongbench.inputs.optical_constants import COPPER, EXACT, GLASS, in_terms_of
from phongbench.testing import check_describes_itself

DEGREES = np.linspace(0, 90, 181)
COSINES = np.cos(np.radians(DEGREES))
COSINES[-1] = 0.0
INDICES = st.tuples(st.floats(0.02, 20), st.floats(0, 20))


def by_complex_arithmetic(n: Any, k: Any, cosine: Any) -> Any:
    """The mean of both polarisations' |amplitude|^2, as books derive it: Snell's law with a complex index."""
    with mpmath.workdps(40):
        index, c = mpmath.mpc(n, k), mpmath.mpf(cosine)
        inside = mpmath.sqrt(1 - (1 - c**2) / index**2)  # the cosine of the refracted ray, complex
        if inside == 0 and c == 0:
            return mpmath.mpf(1)
        across = (c - index * inside) / (c + index * inside)
        along = (index * c - inside) / (index * c + inside)
        return (abs(across) ** 2 + abs(along) ** 2) / 2


def a(kind: str, **numbers: float) -> Fresnel:
    """The same numbers for all channels."""
    return Fresnel(kind, **{name: [value] * 3 for name, value in numbers.items()})


def any_of(kind: str, seed: int = 0) -> Fresnel:
    """One of a kind, its numbers drawn from within their ranges."""
    rng = np.random.default_rng(seed)
    numbers = {p.name: rng.uniform(p.low, min(p.high, 8.0), 3).tolist() for p in KINDS[kind].parameters}
    return Fresnel(kind, **numbers)


# the exact ones


@given(INDICES, st.floats(1e-6, 1))
def test_a_conductor_is_what_complex_arithmetic_says(index: tuple[float, float], cosine: float) -> None:
    n, k = index
    expected = float(by_complex_arithmetic(n, k, cosine))
    room = 1e-11 if k > 0.1 else 1e-6  # the square root of what r + q loses
    assert a("conductor", n=n, k=k).bound(0)(cosine) == pytest.approx(expected, abs=room)


@given(st.floats(0.02, 20), st.floats(1e-6, 1))
def test_a_dielectric_is_what_complex_arithmetic_says(n: float, cosine: float) -> None:
    expected = float(by_complex_arithmetic(n, 0, cosine))
    # at the angle of total reflection the reflectance rises without end, so what rounding makes of it does too
    room = 1e-11 if abs(n * n - 1 + cosine * cosine) > 1e-6 else 1e-6
    assert a("dielectric", n=n).bound(0)(cosine) == pytest.approx(expected, abs=room)
    assert a("conductor", n=n, k=0).bound(0)(cosine) == pytest.approx(expected, abs=1e-6)


@given(st.floats(1.01, 8), st.floats(0.01, 1))
def test_light_going_back_meets_the_same_reflectance(n: float, cosine: float) -> None:
    """Helmholtz: from inside, at the refracted angle, as much is reflected as from outside; beyond it, all."""
    inside = math.sqrt(1 - (1 - cosine**2) / n**2)
    assert a("dielectric", n=1 / n).bound(0)(inside) == pytest.approx(a("dielectric", n=n).bound(0)(cosine), abs=1e-9)
    critical = math.sqrt(1 - 1 / n**2)
    assert a("dielectric", n=1 / n).bound(0)(0.999 * critical) == 1


def test_what_is_no_surface_reflects_nothing() -> None:
    for cosine in (1.0, 0.5, 1e-3):
        assert a("dielectric", n=1).bound(0)(cosine) == 0
        assert a("conductor", n=1, k=0).bound(0)(cosine) == pytest.approx(0, abs=1e-15)


#: exact unpolarised reflectance: glass, its Schlick, copper red, green and blue
TABLE = {
    0: (0.04000, 0.04000, 0.9352, 0.6235, 0.5383),
    45: (0.05024, 0.04207, 0.9329, 0.6221, 0.5391),
    60: (0.08919, 0.07000, 0.9282, 0.6254, 0.5477),
    75: (0.25306, 0.25473, 0.9268, 0.6743, 0.6114),
    80: (0.38770, 0.40991, 0.9359, 0.7300, 0.6773),
    85: (0.61280, 0.64849, 0.9595, 0.8318, 0.7967),
}


@pytest.mark.parametrize("degrees", TABLE)
def test_glass_and_copper_are_those_of_the_table(degrees: int) -> None:
    cosine = np.array([math.cos(math.radians(degrees))])
    found = [GLASS.at(cosine)[0, 0], in_terms_of(GLASS, "schlick").at(cosine)[0, 0], *COPPER.at(cosine)[0]]
    assert found == pytest.approx(TABLE[degrees], abs=1e-4)


def test_the_constants_of_copper_are_those_of_johnson_and_christy() -> None:
    assert COPPER.n == pytest.approx((0.2378, 1.0066, 1.2404), abs=5e-5)
    assert COPPER.k == pytest.approx((3.6264, 2.5823, 2.3929), abs=5e-5)


# the approximations


def largest_errors(exact: Fresnel, kind: str) -> tuple[list[float], list[float]]:
    """Largest |error| of each channel over incidence, and where it lies in degrees."""
    degrees = np.linspace(0, 90, 9001)
    cosines = np.cos(np.radians(degrees))
    error = np.abs(in_terms_of(exact, kind).at(cosines) - exact.at(cosines))
    return error.max(axis=0).tolist(), degrees[error.argmax(axis=0)].tolist()


def test_schlick_and_f82_err_as_much_as_they_are_said_to() -> None:
    glass, at = largest_errors(GLASS, "schlick")
    assert glass == pytest.approx([0.0357] * 3, abs=5e-5)
    assert at == pytest.approx([85] * 3, abs=0.1)
    copper, at = largest_errors(COPPER, "schlick")
    assert copper == pytest.approx([0.0245, 0.0386, 0.0396], abs=5e-5)
    assert all(78 < degrees < 82 for degrees in at)
    assert largest_errors(COPPER, "f82")[0] == pytest.approx([0.0070, 0.0058, 0.0016], abs=5e-5)


@pytest.mark.parametrize(("kind", "most"), [("schlick-exp2", 0.0038), ("schlick-exp2-linear", 0.042)])
def test_the_exponentials_stand_for_the_fifth_power(kind: str, most: float) -> None:
    cosines = np.linspace(0, 1, 20_001)
    error = np.abs(a(kind, f0=0).at(cosines)[:, 0] - (1 - cosines) ** 5)
    assert 0.99 * most <= error.max() <= most


@given(st.floats(0, 1), st.floats(0, 1))
def test_f82_is_what_it_is_told_in_three_places(f0: float, edge: float) -> None:
    for place, expected in ((1.0, f0), (DIP, edge), (0.0, 1.0)):
        assert a("f82", f0=f0, f82=edge).bound(1)(place) == pytest.approx(expected, abs=1e-12)


@given(st.floats(0, 1), st.floats(0, 1))
def test_f82_without_a_dip_is_schlick(f0: float, cosine: float) -> None:
    schlick = a("schlick", f0=f0).bound(0)
    assert a("f82", f0=f0, f82=schlick(DIP)).bound(0)(cosine) == pytest.approx(schlick(cosine), abs=1e-12)


def test_a_dip_that_would_leave_the_range_is_cut_off() -> None:
    high, low = (a("f82", f0=f0, f82=edge).at(COSINES)[:, 0] for f0, edge in ((0.9, 1.0), (0.0, 0.0)))
    assert high.max() == 1
    assert low.min() == 0


# all of them


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_ends_in_its_f0_and_in_a_mirror(kind: str) -> None:
    fresnel = any_of(kind, 3)
    front, grazing = fresnel.at(np.array([1.0, 0.0]))
    wanted = (1, 1, 1) if kind != "constant" else fresnel.f0
    np.testing.assert_allclose(grazing, wanted, atol=1e-12)
    if fresnel.f0 is not None:
        room = {"schlick-exp2": 1.8e-4, "schlick-exp2-linear": 2.5e-3}.get(kind, 1e-12)
        np.testing.assert_allclose(front, fresnel.f0, atol=room)
    else:
        n, k = np.array(fresnel.n), np.array(fresnel.k or (0, 0, 0))
        np.testing.assert_allclose(front, ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2), atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("precision", [FLOAT32, FLOAT64], ids=str)
def test_no_surface_reflects_less_than_nothing_or_more_than_all(kind: str, precision: Any) -> None:
    # a cosine of unit vectors may be a rounding above 1
    cosines = np.append(np.linspace(0, 1, 4001), [1 + 2e-7, 1e-20, 1e-38]).astype(precision.carrier)
    ends = [(p.low, 0.5 * (p.low + p.high), 1.0, p.high) for p in KINDS[kind].parameters]
    for numbers in itertools.product(*ends):
        names = (p.name for p in KINDS[kind].parameters)
        found = a(kind, **dict(zip(names, numbers, strict=True))).at(cosines, precision)
        room = 4 * float(np.finfo(precision.carrier).eps)
        assert np.isfinite(found).all(), numbers
        assert -room <= found.min(), numbers
        assert found.max() <= 1 + room, numbers


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("precision", "room"), [(FLOAT64, 1e-13), (FLOAT32, 3e-6), (FLOAT16, 0.05)], ids=["float64", "float32", "float16"]
)
def test_compiled_bodies_are_the_plain_ones_at_many_digits(kind: str, precision: Any, room: float) -> None:
    for fresnel in (any_of(kind, 5), in_terms_of(COPPER if kind != "dielectric" else GLASS, kind)):
        cosines = COSINES.astype(precision.carrier)
        if precision is FLOAT16:
            cosines = np.asarray(precision.rounded(COSINES), precision.carrier)
        found = fresnel.at(cosines, precision)
        with mpmath.workdps(40):
            expected = [[float(fresnel.bound(c)(mpmath.mpf(float(v)))) for c in range(3)] for v in cosines]
        np.testing.assert_allclose(found, expected, rtol=0, atol=room)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_says_what_it_is(kind: str) -> None:
    check_describes_itself(KINDS[kind])  # type: ignore[arg-type]


def test_a_file_and_a_name_add_a_kind() -> None:
    assert set(FAMILIES) <= {name.partition("-")[0] for name in KINDS}
    assert list(KINDS) == [
        "constant", "schlick", "schlick-exp2", "schlick-exp2-linear", "f82", "dielectric", "conductor",
    ]  # fmt: skip


# what cannot be


@pytest.mark.parametrize(
    ("kind", "numbers", "where", "what"),
    [
        ("dielectric", {}, "n", "needs n"),
        ("conductor", {"n": [1, 1, 1]}, "k", "needs k"),
        ("conductor", {"n": [1, -1, 1], "k": [1, 1, 1]}, "n", "-1 is outside"),
        ("conductor", {"n": [1, 1, 1], "k": [1, 1, -0.1]}, "k", "-0.1 is outside"),
        ("dielectric", {"n": [0, 1, 1]}, "n", "0 is outside"),
        ("dielectric", {"n": [1.5, 1.5]}, "n", "three numbers"),
        ("dielectric", {"n": 1.5}, "n", "three numbers"),
        ("dielectric", {"n": [math.nan] * 3}, "n", "finite"),
        ("conductor", {"n": [1, 1, 1], "k": [math.inf] * 3}, "k", "finite"),
        ("schlick", {"f0": [0, 0.5, 1.01]}, "f0", "1.01 is outside"),
        ("f82", {"f0": [0, 0, 0]}, "f82", "needs f82"),
        ("schlick", {"f0": [0, 0, 0], "n": [1, 1, 1]}, "n", "takes no n"),
        ("constant", {"f0": "red"}, "f0", "three"),
    ],
)
def test_what_no_surface_has_is_refused_by_its_field(kind: str, numbers: Any, where: str, what: str) -> None:
    with pytest.raises(InputError, match=what) as refused:
        Fresnel(kind, **numbers)
    assert refused.value.where == where
    assert refused.value.fix


def test_an_unknown_kind_lists_the_known() -> None:
    with pytest.raises(UnknownNameError, match="unknown kind 'shlick'") as refused:
        Fresnel("shlick", f0=[0, 0, 0])
    assert refused.value.known == tuple(KINDS)
    assert "did you mean 'schlick'" in str(refused.value.fix)


@settings(max_examples=20)
@given(st.sampled_from(sorted(EXACT)), st.sampled_from(sorted(KINDS)))
def test_a_material_in_terms_of_another_formula_keeps_its_ends(name: str, kind: str) -> None:
    exact = EXACT[name]
    if (name, kind) == ("copper", "dielectric"):
        assert in_terms_of(exact, kind) is None
        return
    other = in_terms_of(exact, kind)
    assert other is not None
    if other.f0 is not None:
        np.testing.assert_allclose(other.f0, exact.at(np.ones(1))[0], atol=1e-12)
    else:
        np.testing.assert_allclose(other.at(COSINES), exact.at(COSINES), atol=1e-12)
