"""Enclosures hold whatever a unit of the precision may compute: against NumPy's own arithmetic, and proven ones."""

import numpy as np
import pytest
from adversary import FORMULAS, WAYS, Attack, Machine, raw_pairs, worst

from phongbench.accuracy.enclosures.bounds import largest
from phongbench.accuracy.enclosures.coordinates import Lengths, coordinates, end_of_deficits, normalised, squared_cross
from phongbench.accuracy.enclosures.ends import outwards
from phongbench.accuracy.enclosures.spans import POWERS, Arithmetic, enclosed
from phongbench.accuracy.probes.certify import bounds as certified
from phongbench.compiler.precisions import precision_named
from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import Kernel
from phongbench.formulas.lambda_forms import LAMBDA_FORMS
from phongbench.formulas.registry import REGISTRY

PRECISIONS = ("float16", "bfloat16", "float32", "float64", "q1.15", "q0.12")


def machines(precision: str) -> list[Machine]:
    return [Machine(precision, fused) for fused in ((False,) if precision == "float64" else (False, True))]


def deficits(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    ua, ub = (v / np.linalg.norm(v, axis=0) for v in (a, b))
    return 0.5 * ((ua - ub) ** 2).sum(axis=0)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_vectors_made_unit_in_any_way_have_lengths_of_the_domain(precision: str) -> None:
    domain = normalised(precision_named(precision))
    for machine in machines(precision):
        for way in WAYS:
            a, b = raw_pairs(np.random.default_rng(3), 20_000, 10.0, (0.25, 4.0))
            lengths = np.linalg.norm(np.concatenate([machine.unit(a, way), machine.unit(b, way)], axis=1), axis=0)
            assert domain.low <= lengths.min()
            assert lengths.max() <= domain.high


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("form", [*LAMBDA_FORMS, "none"])
def test_a_coordinate_lies_in_its_enclosure(form: str, precision: str) -> None:
    format_ = precision_named(precision)
    lengths = normalised(format_, 0.01)
    for machine in machines(precision):
        a, b = (machine.unit(v, WAYS[0]) for v in raw_pairs(np.random.default_rng(5), 8192, 30.0, (0.25, 4.0)))
        a = machine.fit(a * (1 + np.random.default_rng(6).choice([-0.01, 0.0, 0.01], a.shape[1])))
        deficit = deficits(a, b)
        inside = deficit < min(end_of_deficits(format_, lengths), 1.9)
        a, b, deficit = a[:, inside], b[:, inside], deficit[inside]
        room = 1e-15
        c = coordinates(form, format_, np.maximum(deficit - room, 0.0), deficit + room, lengths)
        value, cosine = machine.coordinate(form, a, b), machine.dot(a, b)
        finite = np.isfinite(value)  # tan2 at a right angle
        assert ((c.low <= value) & (value <= c.high))[finite].all()
        assert c.opens[cosine > 0].all()
        assert c.closes[cosine <= 0].all()


@pytest.mark.parametrize("precision", ["float16", "bfloat16", "float32"])
def test_crosses_err_most_of_nearly_equal_vectors_between_two_axes(precision: str) -> None:
    """There the products of a component are longest, a little above 1/2, and nothing but their rounding is left."""
    format_, rng = precision_named(precision), np.random.default_rng(7)
    for machine in machines(precision):
        a = machine.unit(np.array([[1.0], [1.0], [0.0]]) + 0.01 * rng.normal(size=(3, 20_000)), WAYS[0])
        b = machine.unit(a + format_.eps * rng.normal(size=a.shape), WAYS[0])
        a, b = machine.fit(1.008 * a), machine.fit(1.008 * b)
        sizes = (np.linalg.norm(v, axis=0) for v in (a, b))
        deficit = deficits(a, b)
        low, high = np.maximum(deficit - 1e-15, 0), deficit + 1e-15
        found = squared_cross(Arithmetic(format_), low, high, *(Lengths(size, size) for size in sizes))
        value = 2 * machine.coordinate("cross", a, b)
        assert ((found.low <= value) & (value <= found.high)).all()


@pytest.mark.parametrize("name", sorted(FORMULAS))
@pytest.mark.parametrize("precision", ["float16", "float32", "float64"])
def test_a_body_on_intervals_holds_the_body_on_each_number(name: str, precision: str) -> None:
    spec, format_ = REGISTRY[name], precision_named(precision)
    gamma = 8 if spec.uses_gamma else None
    setting = Formula.of(name, None, gamma).setting(20.0)
    x = np.linspace(0.0, 0.999, 200)
    values = {k: float(format_.constant(v)) if k in spec.scalars else v for k, v in spec.coefficients(setting).items()}
    if spec.table is not None:
        values["table"] = [float(entry) for entry in format_.rounded(spec.table(setting))]
    low, high = enclosed(lambda number: spec.kernel(number, **values), x, x + 1e-3, format_)
    attack = Attack(Formula.of(name, None, gamma), 20.0, Machine(precision, fused=False))
    for share in (0.0, 0.3, 1.0):
        inside = np.clip(attack.machine.fit(x + share * 1e-3), x, x + 1e-3)
        found = attack.kernel(attack.machine, inside, **attack.values)
        # a bit more for NumPy's own arc cosine and powers
        assert (low - 1e-7 <= found).all()
        assert (found <= high + 1e-7).all()


@pytest.mark.parametrize("name", sorted(FORMULAS))
def test_no_pair_is_found_beyond_a_bound_and_the_bound_is_near(name: str) -> None:
    spec, rng = REGISTRY[name], np.random.default_rng(11)
    for precision, alpha in (("float32", 40.0), ("float16", 12.0), ("q1.15", 12.0)):
        formula = Formula.of(name, None, 8 if spec.uses_gamma else None)
        bound = largest(spec, formula.lambda_form, formula.setting(alpha), precision_named(precision))
        found = worst(formula, alpha, precision, rng, pairs=512, rounds=4)
        assert found <= bound
        # where rounding decides, chance must find the worst of many directions of error
        assert found >= 0.3 * bound or precision != "float32"


@pytest.mark.parametrize("spelling", ["lyon:dot:8", "lyon:cross:32:minimax", "gaussian:tan2", "schlick"])
def test_in_float64_a_bound_is_that_of_ball_arithmetic(spelling: str) -> None:
    """Of lengths without error nothing is left but the formula's own error."""
    pytest.importorskip("flint")
    formula = Formula.parse(spelling)
    error = certified.error_of(formula.spec(), formula.lambda_form, formula.setting(50.0))
    other = certified.largest(error, 50.0)
    bound = largest(formula.spec(), formula.lambda_form, formula.setting(50.0), precision_named("float64"))
    assert 0.99 * other <= bound <= 1.012 * other


def test_a_budget_asks_only_on_which_side_the_bound_is() -> None:
    formula = Formula.parse("lyon:dot:32:minimax")
    case = (formula.spec(), "dot", formula.setting(50.0), precision_named("float32"))
    sharp = largest(*case)
    assert sharp <= largest(*case, budget=2 * sharp) <= 2 * sharp
    assert largest(*case, budget=0.5 * sharp) > 0.5 * sharp


def test_wrong_lengths_only_raise_a_bound() -> None:
    formula = Formula.parse("lyon:difference:16")
    case = (formula.spec(), "difference", formula.setting(100.0), precision_named("float32"))
    sizes = [largest(*case, length_error=size) for size in (0.0, 1e-4, 1e-3, 1e-2)]
    assert sizes == sorted(sizes)


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_compiled_powers_and_exponentials_err_as_little_as_is_assumed(precision: str) -> None:
    format_ = precision_named(precision)
    off = POWERS[24 if precision == "float32" else 53]
    for spelling in ("phong", "gaussian:difference"):
        formula = Formula.parse(spelling)
        for alpha in (0.5, 7.3, 1000.0, 1e5):
            x = np.linspace(0.0, 1.0, 20_001).astype(format_.carrier)
            coordinate = x if spelling == "phong" else x * format_.carrier.type(20 / alpha)
            value = Kernel.of(formula.spec(), formula.setting(alpha), format_).values(coordinate, np.ones_like(x))
            exact = coordinate.astype(np.float64)
            rate = float(format_.constant(alpha))
            true = exact**rate if spelling == "phong" else np.exp(-rate * exact)
            assert np.abs(value - true).max() <= off


def test_intervals_are_widened_to_the_neighbours_of_their_ends() -> None:
    generator = np.random.default_rng(1)
    some = generator.normal(size=1000) * 10.0 ** generator.integers(-320, 300, 1000)
    special = [0.0, -0.0, np.inf, -np.inf, 5e-324, -5e-324, np.finfo(float).max, -np.finfo(float).max]
    ends = np.concatenate([some, special])
    low, high = outwards(ends, ends)
    with np.errstate(over="ignore"):
        np.testing.assert_array_equal(low, np.where(ends == 0, ends, np.nextafter(ends, -np.inf)))
        np.testing.assert_array_equal(high, np.where(ends == 0, ends, np.nextafter(ends, np.inf)))
