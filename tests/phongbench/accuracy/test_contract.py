"""No conforming device errs beyond a contract bound: against emulated devices that err as much as they may."""

import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from adversary import FORMULAS
from device_search import directions, worst_found
from emulated_devices import Machine

from phongbench.accuracy.enclosures import contract
from phongbench.accuracy.enclosures.bounds import NotEnclosedError
from phongbench.accuracy.enclosures.bounds import largest as certified
from phongbench.accuracy.enclosures.coordinates import Lengths
from phongbench.accuracy.enclosures.devices import Device
from phongbench.accuracy.enclosures.emitted import Direction
from phongbench.accuracy.enclosures.spans import Span
from phongbench.compiler.precisions import precision_named
from phongbench.formulas.formula import Formula, takes
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.shader_code.evaluated import text
from phongbench.formulas.shader_code.export import source
from phongbench.formulas.shader_code.languages import LANGUAGES

PRECISIONS = ("float32", "float16")
#: at most so many times what a short search finds, and a little: exact Phong's bound needs many intervals
SHARP, NEARLY = {"float32": 3.0, "float16": 6.0}, 2e-5


def drawn(rng: np.random.Generator, precision: str) -> tuple[Formula, float]:
    """A formula of a pair and an exponent that it takes; in float32 lengths may be removed."""
    spec = REGISTRY[str(rng.choice(sorted(FORMULAS)))]
    form = str(rng.choice([f for f in spec.lambda_forms if f != "tan2"]))
    ways = [w for w in ("none", "each", "once", "squared") if takes(spec, form, w) and precision == "float32"]
    gamma = int(2 ** rng.integers(1, 7)) if spec.uses_gamma else None
    slope, space = str(rng.choice(spec.slopes)), str(rng.choice(spec.spaces))
    way = str(rng.choice(ways or ["none"]))
    formula = Formula.of(spec.name, form, gamma, slope, space, normalise=way if space == "reflect" else "none")
    alpha = float(np.exp(rng.uniform(np.log(2), np.log(64 if spec.name == "kuijk-blake" else 1000))))
    return formula, float(round(alpha)) if spec.name == "integer-power" else alpha


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("seed", range(30))
def test_no_device_errs_beyond_the_bound_which_is_sharp(seed: int, precision: str) -> None:
    rng = np.random.default_rng(seed)
    formula, alpha = drawn(rng, precision)
    limited = bool(seed % 2)
    setting = formula.setting(alpha)
    try:
        bound = contract.largest(formula.spec(), formula, setting, precision_named(precision), limited=limited)
    except NotEnclosedError:  # no code in float16: it reads bits, or a constant is beyond it
        assert contract.unwritten(formula.spec(), formula, setting, precision_named(precision))
        return
    found = worst_found(formula, alpha, precision, rng, limited=limited)
    assert found <= bound, (str(formula), alpha)
    if np.isfinite(bound) and found < 0.5:
        assert bound <= SHARP[precision] * found + NEARLY, (str(formula), alpha)


FUNCTIONS = ("inversesqrt", "sqrt", "exp2", "log2", "acos", "product", "sum", "quotient", "power")


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", FUNCTIONS)
def test_an_operation_lies_within_what_a_device_may_return(name: str, precision: str) -> None:
    """At and beside the numbers where accuracies change: powers of two, 1/2, 1 and 2."""
    rng, format_ = np.random.default_rng(5), precision_named(precision)
    near = np.ldexp(1.0, rng.integers(-10, 3, 4000)) * (1 + format_.eps * rng.integers(-3, 4, 4000))
    low = np.where(rng.random(4000) < 0.5, near, rng.uniform(0.01, 2.0, 4000))
    most = 1.0 if name in ("acos", "power") else 2.0
    low = np.asarray(format_.rounded(np.minimum(low, most)), np.float64)
    high = np.asarray(format_.rounded(low * rng.choice([1.0, 1.0 + 4 * format_.eps, 1.1], 4000)), np.float64)
    high = np.minimum(high, most)
    sign = -1.0 if name == "exp2" else 1.0
    low, high = np.minimum(sign * low, sign * high), np.maximum(sign * low, sign * high)
    rule = Device(format_)
    span = Span.of(low, high, rule)
    pairs = {"product": lambda x: x * 1.7, "sum": lambda x: 0.7 - x, "quotient": lambda x: 1.3 / x}
    known = {
        "inversesqrt": rule.reciprocal_root, "sqrt": rule.root, "exp2": rule.exp2, "log2": rule.log2,
        "acos": rule.arc_cosine, "power": partial(rule.power, y=20.0), **pairs,
    }  # fmt: skip
    enclosure = known[name](span)
    for way in directions(rng).values():
        machine = Machine(precision, way)
        function = pairs.get(name) or getattr(machine, name)
        for share in (0.0, 0.4, 1.0):
            inside = machine.number(np.clip(machine.constant(low + share * (high - low)), low, high))
            if name == "quotient":
                found = machine.divided(machine.constant(np.full(4000, 1.3)), inside.values)
            else:
                found = (function(inside, 20.0) if name == "power" else function(inside)).values
            assert (enclosure.low <= found).all()
            assert (found <= enclosure.high).all()


@pytest.mark.parametrize(("precision", "alpha", "answer"), [("float32", 50.0, 1.7e-5), ("float16", 50.0, 0.31)])
def test_the_power_given_the_exact_cosine_errs_by_its_logarithm(precision: str, alpha: float, answer: float) -> None:
    """alpha log2 e times the logarithm's absolute error, and what the exponential adds."""
    formula = Formula.of("phong")
    bound = contract.largest(
        formula.spec(), formula, formula.setting(alpha), precision_named(precision), domain=contract.COSINE
    )
    assert bound == pytest.approx(answer, rel=0.03)
    assert bound >= 2 ** (alpha * {"float32": 2.0**-21, "float16": 2.0**-7}[precision]) - 1


def test_a_gaussian_in_float16_errs_by_its_exponential_given_its_exponent() -> None:
    """(1 + 2 |t|) ULP of 2^t, most just above t = -1."""
    t = -np.arange(0.0, 8.0, 1 / 512)
    value = Device(precision_named("float16")).exp2(Span.of(t, t, Device(precision_named("float16"))))
    off = max(float((value.high - np.exp2(t)).max()), float((np.exp2(t) - value.low).max()))
    assert off == pytest.approx(1.5e-3, rel=0.05)


@pytest.mark.parametrize("gamma", [8, 32])
def test_lyon_keeps_its_bound_on_every_device(gamma: int) -> None:
    """It is made of operations that are correctly rounded: in float32 they add less than a hundredth of a code."""
    formula = Formula.of("lyon", "difference", gamma)
    args = formula.setting(50.0), precision_named("float32")
    here = certified(formula.spec(), "difference", *args)
    assert contract.largest(formula.spec(), formula, *args) == pytest.approx(here, abs=0.01 / 255)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", sorted(FORMULAS))
def test_what_is_proven_of_the_kernels_is_at_most_what_devices_may_do(name: str, precision: str) -> None:
    """certified <= contract, for the code that does not limit over-long vectors, as kernels do not."""
    spec, format_ = REGISTRY[name], precision_named(precision)
    for form in spec.lambda_forms:
        formula = Formula.of(name, form, 16 if spec.uses_gamma else None)
        setting = formula.setting(20.0)
        here = certified(spec, form, setting, format_)
        if contract.unwritten(spec, formula, setting, format_):
            continue  # GPUs have no code for it: it reads bits of a float32
        # both are upper bounds, sharp within some hundredths, or so little
        assert contract.largest(spec, formula, setting, format_, limited=False) >= 0.9 * here - 5e-5, form


@pytest.mark.parametrize("spelling", ["lyon:dot:8", "lyon:cross:8", "gaussian:difference", "phong/once", "table-u:dot"])
def test_what_is_proven_is_what_is_shipped(spelling: str) -> None:
    """Statement by statement the text of HLSL, but for types, brackets and the digits of constants."""
    formula = Formula.parse(spelling)
    shipped = source(formula, 50.0, LANGUAGES["hlsl"])
    proven = text(formula.spec(), formula, formula.setting(50.0))
    assert plain(proven) == plain(shipped)


def plain(code: str) -> list[str]:
    """Its names, operators and numbers of five digits, without types and punctuation."""
    words = re.findall(r"\d+\.\d*(?:e-?\d+)?|[a-z_A-Z]\w*|\d+|[-+*/<>]", re.sub(r"lambda:|TABLE\[\d+\] =", "", code))
    dropped = {"float", "int", "float3", "static", "const", "return", "def", "listed", "chosen", "highlight", "TABLE"}
    alike = {"rsqrt": "inversesqrt", "to_int": "int", "to_float": "float"}
    named = (alike.get(word, word) for word in words)
    return [f"{float(word):.5g}" if word[0].isdigit() else word for word in named if word not in dropped]


def test_a_division_that_may_be_by_nothing_has_no_bound() -> None:
    """tan2 divides by the squared cosine, which vanishes at a right angle: there the standards say nothing."""
    formula = Formula.of("lyon", "tan2", 8)
    setting = formula.setting(50.0)
    assert contract.largest(formula.spec(), formula, setting, precision_named("float32"), limited=False) > 0.99


@pytest.mark.parametrize(
    ("spelling", "precision"),
    [
        ("phong", "float64"),
        ("phong", "bfloat16"),
        ("phong", "q1.15"),
        ("phong/fast", "float32"),
        ("blinn@halfway", "float32"),
        ("bit-trick", "float16"),
    ],
)
def test_where_no_standard_speaks_nothing_is_proven(spelling: str, precision: str) -> None:
    formula = Formula.parse(spelling)
    with pytest.raises(NotEnclosedError, match=r"no standard|trick|opposite|bits"):
        contract.largest(formula.spec(), formula, formula.setting(50.0), precision_named(precision))


def test_longer_vectors_and_wrong_recipes_are_never_better() -> None:
    """The bound grows with the lengths' error, and with the roundings that make R."""
    formula = Formula.of("lyon", "dot", 32)
    setting, format_ = formula.setting(50.0), precision_named("float32")
    sizes = [contract.largest(formula.spec(), formula, setting, format_, length_error=e) for e in (0.0, 1e-3, 1e-2)]
    assert sizes == sorted(sizes)
    each = replace(formula, normalise="each")
    pairs = [replace(each, recipe=recipe) for recipe in ("pair", "lengthwise", "reflect")]
    steps = [contract.largest(formula.spec(), f, setting, format_) for f in pairs]
    assert steps == sorted(steps)


def test_a_scaled_vector_leaves_its_direction_by_the_rounding_of_its_components() -> None:
    rng, rule, one = np.random.default_rng(3), Device(precision_named("float32")), np.ones(1)
    vectors, scale = rng.normal(size=(3, 20_000)).astype(np.float32), rng.uniform(0.5, 2, 20_000).astype(np.float32)
    exact = vectors.astype(np.float64) * scale
    moved = np.linalg.norm(vectors * scale - exact, axis=0) / np.linalg.norm(exact, axis=0)
    scaled = Direction("a", rule, 0 * one, 0 * one, Lengths()) * Span.of(one, one, rule)
    assert scaled.lengths is not None
    assert 0.4 * scaled.lengths.off < moved.max() <= scaled.lengths.off  # a device may round either way
    twice = scaled * Span.of(one, one, rule)
    assert twice.lengths is not None
    assert twice.lengths.off == pytest.approx(2 * scaled.lengths.off)
