"""Formulas that remove lengths or start from N, L and V: spelling, exact values, compiled loops, values without a
direction."""

import math

import mpmath
import numpy as np
import pytest

from phongbench.compiler.lowering import FLOAT32, FLOAT64, precision_named
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas import normalising, recipes
from phongbench.formulas.coordinate_kernels import COSINE_ROW, FORM_ROW, OPEN_ROW, coordinates
from phongbench.formulas.formula import Formula, takes
from phongbench.formulas.kernel import Kernel
from phongbench.formulas.lambda_forms import LAMBDA_FORMS, deficit_of_angle
from phongbench.formulas.normalising import NORMALISE
from phongbench.formulas.recipes import RECIPES
from phongbench.formulas.registry import REGISTRY
from phongbench.inputs.raw_formulas import RAW

EPS = 2.0**-23
ALPHA = 50.0
EXACT_WAYS = ("each", "once", "squared")


def pairs(count=20_000, alpha=ALPHA, seed=1):
    """Pairs within the highlight, with lengths from 0.001 to 1000, in float32."""
    random = np.random.default_rng(seed)
    a = random.normal(size=(3, count))
    a /= np.linalg.norm(a, axis=0)
    b = a + 2 / math.sqrt(alpha) * random.normal(size=(3, count)) * random.random(count)
    a, b = (v / np.linalg.norm(v, axis=0) * 10.0 ** random.uniform(-3, 3, count) for v in (a, b))
    return a.astype(np.float32), b.astype(np.float32)


def true_cosine(a, b):
    a, b = a.astype(np.float64), b.astype(np.float64)
    return (a * b).sum(axis=0) / np.sqrt((a * a).sum(axis=0) * (b * b).sum(axis=0))


def values(spelling, a, b, precision=FLOAT32, alpha=ALPHA):
    formula = Formula.parse(spelling)
    spec, setting = formula.spec(), formula.setting(alpha)
    raw = {"normalise": formula.normalise, "recipe": formula.recipe}
    kernel = Kernel.of_pairs(spec, formula.lambda_form, setting, precision, **raw)
    out = np.empty(a.shape[1], precision.carrier)
    kernel.fill_pairs(a.astype(precision.carrier), b.astype(precision.carrier), out)
    return out


# spelling


@pytest.mark.parametrize(
    "spelling", [*RAW, "lyon:dot:8@half", "lyon:dot:8@half/once", "blinn@halfway", "phong@reflect"]
)
def test_a_spelling_is_read_and_written_alike(spelling):
    assert str(Formula.parse(spelling)) == spelling


def test_a_row_tells_its_formula():
    row = {"approximation": "lyon", "lambda_form": "cross", "gamma": 8, "beta_policy": "taylor", "space": "reflect"}
    assert str(Formula.of_row(row)) == "lyon:cross:8"
    assert str(Formula.of_row(row | {"recipe": "lengthwise", "normalise": "once"})) == "lyon:cross:8@lengthwise/once"


@pytest.mark.parametrize(
    ("spelling", "error", "words"),
    [
        ("phong/every", UnknownNameError, "known: none, each, once, squared, fast, estimate"),
        ("phong@mirror", UnknownNameError, "known: pair, half, reflect, lengthwise, halfway"),
        ("lyon:dot:8/squared", InputError, "it takes none, each, once"),
        ("lyon:difference:8/once", InputError, "it takes none, each, fast, estimate"),
        ("lyon:tan2:8/each", InputError, "it takes none"),
        ("integer-power/squared", InputError, "it takes none, each, once"),
        ("blinn@reflect", InputError, "halfway"),
        ("phong@halfway", InputError, "reflect"),
    ],
)
def test_what_does_not_fit_is_refused_with_what_does(spelling, error, words):
    with pytest.raises(error) as refusal:
        Formula.parse(spelling)
    assert words in f"{refusal.value} {refusal.value.fix}"


# removing lengths


@pytest.mark.parametrize("way", EXACT_WAYS)
@pytest.mark.parametrize("form", ["none", *LAMBDA_FORMS])
def test_in_exact_arithmetic_lengths_leave_no_trace(way, form):
    """Every body at 40 digits gives what the form sees of the angle, for any lengths."""
    spec = REGISTRY["phong" if form == "none" else "lyon"]
    if not takes(spec, form, way):
        pytest.skip("not offered")
    with mpmath.workdps(40):
        a, b = ([mpmath.mpf(x) for x in v] for v in ((300, -20, 77), (0.001, 0.0002, -0.0001)))
        x = sum(p * q for p, q in zip(a, b, strict=True))
        cosine = x / mpmath.sqrt(sum(p * p for p in a) * sum(q * q for q in b))
        coordinate, gate = normalising.plain(form, way)(tuple(a), tuple(b))
        wanted = deficit_of_angle(form, cosine) if form != "none" else cosine**2 if way == "squared" else cosine
        assert abs(coordinate - wanted) < mpmath.mpf(10) ** -38
        assert gate > 0


@pytest.mark.parametrize("way", EXACT_WAYS)
@pytest.mark.parametrize("alpha", [5.0, 50.0, 1000.0])
def test_exact_phong_errs_by_four_units_times_alpha_at_any_length(way, alpha):
    a, b = pairs(alpha=alpha)
    wanted = np.maximum(true_cosine(a, b), 0) ** alpha
    assert np.abs(values(f"phong/{way}", a, b, alpha=alpha) - wanted).max() <= 4 * EPS * alpha


@pytest.mark.parametrize("spelling", [s for s in RAW if "@" not in s])
def test_the_compiled_loop_is_the_plain_body(spelling):
    a, b = pairs(300)
    formula = Formula.parse(spelling)
    body, plain = (
        formula.spec().bound(formula.setting(ALPHA)),
        normalising.plain(formula.lambda_form, formula.normalise),
    )
    expected = []
    for p, q in zip(a.T.astype(float).tolist(), b.T.astype(float).tolist(), strict=True):
        coordinate, gate = plain(tuple(p), tuple(q))
        expected.append(float(body(coordinate)) if gate > 0 else 0.0)
    far = np.abs(values(spelling, a, b) - expected) > 32 * formula.setting(ALPHA).exponent * EPS
    # next to a step of the table the product may be rounded to its other side
    assert far.sum() <= (3 if formula.normalise == "estimate" else 0)


def test_the_bit_trick_and_the_estimate_err_as_their_roots_do():
    q = np.exp(np.random.default_rng(1).uniform(-14, 14, 4000)).astype(np.float32)
    v = np.stack([np.sqrt(q), np.zeros_like(q), np.zeros_like(q)])
    axis = np.zeros_like(v)
    axis[0] = 1
    for name, bound in (("fast", 1.8e-3), ("estimate", 1.5 * 2.0**-12)):
        cosine = coordinates(FLOAT32, v, axis, normalise=name)[COSINE_ROW]
        unit = coordinates(FLOAT32, v, v, normalise=name)[COSINE_ROW]
        assert 0.3 * bound < np.abs(unit / cosine - 1).max() <= 2 * bound + 4 * EPS
        assert np.abs(np.sqrt(unit) - 1).max() <= bound + 4 * EPS


@pytest.mark.parametrize("way", EXACT_WAYS)
def test_a_vector_without_direction_is_dark(way):
    none = np.array([[0, 0, 0], [0, 0, 1], [np.nan, 0, 1], [0, 0, 0]], np.float32).T.copy()
    some = np.array([[0, 0, 1], [0, 0, 0], [0, 0, 1], [0, 0, 0]], np.float32).T.copy()
    for form in ("none", "dot", "cross"):
        name = "phong" if form == "none" else f"lyon:{form}:8"
        if takes(REGISTRY[name.split(":", maxsplit=1)[0]], form, way):
            assert not values(f"{name}/{way}", none, some).any()


@pytest.mark.parametrize("way", EXACT_WAYS)
def test_backs_stay_dark_whatever_the_square(way):
    a, b = pairs(500)
    for spelling in ("phong", "lyon:cross:8"):
        if takes(REGISTRY[spelling.split(":")[0]], Formula.parse(spelling).lambda_form, way):
            assert not values(f"{spelling}/{way}", a, -b)[true_cosine(a, b) > 0].any()


def test_in_float16_squares_of_long_vectors_overflow():
    half = precision_named("float16")
    a = np.array([[255.0, 0, 0], [257.0, 0, 0]], np.float32).T.copy()
    block = coordinates(half, a, np.array([[1.0, 1], [0, 0], [0, 0]], np.float32), normalise="each")
    assert block[COSINE_ROW, 0] == pytest.approx(1, abs=2e-3)
    assert block[COSINE_ROW, 1] == 0  # 1 / infinity


@pytest.mark.parametrize("name", NORMALISE)
def test_a_block_has_what_the_pair_kernel_takes(name):
    a, b = pairs(256)
    precision = FLOAT32 if NORMALISE[name].precisions else FLOAT64
    a, b = a.astype(precision.carrier), b.astype(precision.carrier)
    block = coordinates(precision, a, b, normalise=name)
    for form in ("none", "dot", "cross"):
        if takes(REGISTRY["phong" if form == "none" else "lyon"], form, name):
            columns = zip(a.T.tolist(), b.T.tolist(), strict=True)
            plain = [normalising.plain(form, name)(tuple(p), tuple(q)) for p, q in columns]
            row = block[FORM_ROW.get(form, COSINE_ROW)]
            size = np.abs(row) + (1 if name != "none" else np.abs(block[COSINE_ROW]))
            assert (np.abs(row - [float(x) for x, _ in plain]) <= 16 * precision.eps * size).all()
            if name != "none":
                assert (np.sign(block[OPEN_ROW]) == np.sign([float(g) for _, g in plain])).all()


# recipes


def configuration(seed=1, count=200):
    """Raw N, L and V, lit, as (9, count) float64: N, then L, then V."""
    random = np.random.default_rng(seed)
    n, light, view = random.normal(size=(3, 3, count))
    light *= np.sign((n * light).sum(axis=0))
    return np.concatenate([n, light, view])


@pytest.mark.parametrize("recipe", ["reflect", "lengthwise"])
def test_the_mirror_direction_lies_beyond_the_normal(recipe):
    nine = configuration()
    n, light = nine[:3], nine[3:6]
    mirror = np.array(recipes.plain(recipe)(*nine)[:3])
    sizes = np.linalg.norm(n, axis=0), np.linalg.norm(light, axis=0)
    assert np.allclose(np.linalg.norm(mirror, axis=0), sizes[1] * (sizes[0] ** 2 if recipe == "lengthwise" else 1))
    unit_n, unit_l, unit_r = n / sizes[0], light / sizes[1], mirror / np.linalg.norm(mirror, axis=0)
    assert np.allclose((unit_n * unit_l).sum(axis=0), (unit_n * unit_r).sum(axis=0))
    assert np.allclose(unit_l + unit_r, 2 * (unit_n * unit_l).sum(axis=0) * unit_n)


def test_halfway_is_as_long_as_twice_the_cosine_to_either():
    nine = configuration()
    light, view = nine[3:6] / np.linalg.norm(nine[3:6], axis=0), nine[6:] / np.linalg.norm(nine[6:], axis=0)
    half = np.array(recipes.plain("halfway")(*nine)[3:])
    assert np.allclose(half, light + view)


@pytest.mark.parametrize("spelling", [s for s in RAW if "@" in s])
def test_a_compiled_recipe_is_the_plain_one(spelling):
    formula = Formula.parse(spelling)
    nine = configuration(count=120)
    if formula.normalise == "none":
        nine /= np.repeat(np.sqrt((nine.reshape(3, 3, -1) ** 2).sum(axis=1)), 3, axis=0)
    nine = nine.astype(np.float32)
    exact = recipes.plain(formula.recipe)(*nine.astype(np.float64))
    body, plain = (
        formula.spec().bound(formula.setting(ALPHA)),
        normalising.plain(formula.lambda_form, formula.normalise),
    )
    expected = []
    for six in np.array(exact).T.tolist():
        coordinate, gate = plain(tuple(six[:3]), tuple(six[3:]))
        expected.append(float(body(coordinate)) if gate > 0 else 0.0)
    result = values(spelling, nine[:3], np.concatenate([nine[6:], nine[3:6]]))
    np.testing.assert_allclose(result, expected, atol=64 * formula.setting(ALPHA).exponent * EPS)


def test_recipes_make_the_pairs_of_their_space():
    assert {name: recipe.space for name, recipe in RECIPES.items()} == {
        "reflect": "reflect",
        "lengthwise": "reflect",
        "halfway": "half",
    }
