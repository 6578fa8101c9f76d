"""Rows of formulas that remove lengths or start from N, L and V: what is left of lengths, and whose truth they have."""

from dataclasses import replace

import mpmath
import numpy as np
import pytest

from phongbench.accuracy import sweep, tables
from phongbench.accuracy.sweep import exact_values
from phongbench.inputs.plan import preset
from phongbench.results.frames import as_given

EPS = {"float16": 2.0**-10, "float32": 2.0**-23}
FORMULAS = (
    "phong/each",
    "phong/once",
    "phong/squared",
    "phong/fast",
    "lyon:cross:8/once",
    "lyon:dot:8@lengthwise/once",
    "phong@lengthwise/each",
    "blinn@halfway/once",
)
PLAN = replace(
    preset("quick"),
    alphas=(10.0, 64.0),
    gammas=(8,),
    approximations=("phong", "blinn", "lyon"),
    slopes=("taylor",),
    precisions=("float16", "float32"),
    strata=("highlight", "lengths", "hostile", "configurations"),
    samples=64_000,
    raw=FORMULAS,
    raw_precisions=("float16", "float32"),
).validated()


@pytest.fixture(scope="module")
def prepared():
    made = sweep.prepare(PLAN)
    sweep.compile_kernels(made)
    return made


@pytest.fixture(scope="module")
def everything(prepared):
    return tables.accuracy(prepared, [tables.part(list(sweep.run(prepared)))])


@pytest.fixture(scope="module")
def rows(everything):
    return everything[(everything["recipe"] != "pair") | (everything["normalise"] != "none")]


def of(rows, **wanted):
    for column, value in wanted.items():
        rows = rows[rows[column] == value]
    return rows


def test_rows_of_pairs_as_they_are_do_not_change(everything):
    plain = sweep.prepare(replace(PLAN, raw=()))
    alone = tables.accuracy(plain, [tables.part(list(sweep.run(plain)))])
    assert as_given(everything).reset_index(drop=True).equals(alone)


def test_every_formula_has_its_rows(rows):
    assert set(rows["normalise"]) == {"none", "each", "once", "squared", "fast"} - {"none"} | (
        {"none"} if any("@" in f and "/" not in f for f in FORMULAS) else set()
    )
    assert set(of(rows, normalise="fast")["precision"]) == {"float32"}
    assert set(rows["truth"]) == {"angle"}
    assert rows["gated"].all()
    assert set(of(rows, stratum="configurations")["recipe"]) == {"lengthwise", "halfway"}
    assert set(rows[rows["recipe"] == "pair"]["stratum"]) == {"highlight", "lengths", "hostile"}


@pytest.mark.parametrize("way", ["each", "once", "squared"])
def test_nothing_is_left_of_lengths(rows, way):
    lengths = of(rows, normalise=way, stratum="lengths", precision="float32", approximation="phong")
    assert "any" in set(lengths["perturbation"])
    assert lengths["length_max"].max() < 1e-12
    assert lengths["model_max"].max() < 1e-12
    assert (lengths["max_abs"] <= 4 * EPS["float32"] * lengths["alpha"]).all()


def test_the_bit_trick_leaves_what_its_root_errs(rows):
    left = of(rows, normalise="fast", stratum="lengths", perturbation="any")
    expected = 1 - (1 - 1.752e-3) ** (2 * left["alpha"])
    assert (left["max_abs"] < expected * 1.01 + 1e-4).all()
    assert (left["max_abs"] > 0.5 * expected).all()


def test_lyon_keeps_its_law_at_any_length(rows):
    """lambda of the cross form is sin^2 / 2, whatever the lengths: the error is that on unit vectors."""
    mine = of(rows, approximation="lyon", lambda_form="cross", normalise="once", precision="float32")
    unit = of(mine, stratum="highlight").set_index("alpha")["model_max"]
    spread = of(mine, stratum="lengths", perturbation="any").set_index("alpha")["max_abs"]
    assert np.allclose(unit, spread, atol=1e-3)


def test_in_float16_lengths_beyond_its_squares_are_counted(rows):
    """1000^2 is no float16: the lobe is lost there, and the rows say so."""
    lost = of(rows, stratum="lengths", perturbation="any", precision="float16", normalise="each", approximation="phong")
    kept = of(
        rows, stratum="lengths", perturbation="both", precision="float16", normalise="each", approximation="phong"
    )
    assert lost["max_abs"].min() > 0.9
    assert (kept["max_abs"] <= 16 * EPS["float16"] * kept["alpha"]).all()


def test_hostile_vectors_are_counted_and_never_crash(rows):
    assert (of(rows, stratum="hostile", normalise="each", approximation="phong")["nonfinite"] > 0).all()


def test_a_recipe_is_judged_by_the_true_mirror_direction(prepared):
    """The exact values of configurations, against 40 digits."""
    batch = next(b for b in prepared.batches if b.stratum.perturbation == "any" and b.recipe == "lengthwise")
    n, vl = batch.pairs(PLAN.seed, 0, 60)
    exact = exact_values(batch, 64.0, n, vl)[0]
    with mpmath.workdps(40):
        for i in range(60):
            normal, light, view = ([mpmath.mpf(float(x)) for x in v[:, i]] for v in (n, vl[3:], vl[:3]))
            square = sum(x * x for x in normal)
            twice = 2 * sum(x * y for x, y in zip(normal, light, strict=True))
            mirror = [twice * x - square * y for x, y in zip(normal, light, strict=True)]
            sizes = mpmath.sqrt(sum(x * x for x in mirror) * sum(x * x for x in view))
            cosine = sum(x * y for x, y in zip(mirror, view, strict=True)) / sizes
            assert abs(float(max(cosine, 0) ** 64) - exact[i]) < 1e-13


def test_formulas_of_n_h_are_another_lobe_off_the_plane(rows):
    """Blinn at 4 alpha is within 0.03 of Phong on coplanar vectors; over all azimuths it is not."""
    blinn = of(rows, approximation="blinn", stratum="configurations", precision="float32", perturbation="none")
    phong = of(rows, approximation="phong", stratum="configurations", precision="float32", perturbation="none")
    assert (blinn["model_max"] > 0.3).all()
    assert (phong["model_max"] < 1e-12).all()


def test_formulas_of_n_h_that_are_given_their_pair_are_judged_there_too(everything, rows):
    """With H = L/|L| + V/|V| and both made unit, as a shader that hands them over does; on the same samples."""
    given = of(as_given(everything), stratum="configurations")
    assert set(given["space"]) == {"half"}
    assert set(given["perturbation"]) == {"none"}
    assert given["gated"].all()
    assert set(given["approximation"]) == {"blinn", "lyon"}
    mine = of(given, approximation="blinn", precision="float32").set_index("alpha")
    once = of(rows, approximation="blinn", stratum="configurations", precision="float32", perturbation="none")
    once = once.set_index("alpha")
    assert np.allclose(mine["max_abs"], once["max_abs"], atol=1e-4)
    assert np.allclose(mine["model_max"], once["model_max"], atol=1e-12)
    coplanar = of(as_given(everything), approximation="blinn", stratum="highlight", precision="float32", truth="angle")
    assert (mine["max_abs"] > 10 * coplanar.set_index("alpha")["max_abs"]).all()
    assert (given["max_abs"] <= 1 + 64 * EPS["float16"] * given["alpha"]).all()


def test_towards_grazing_incidence_n_h_says_nothing_of_r_v():
    """R.V = 1 - 2 cos^2(i) sin^2(p) where N is tilted by p out of the plane of L and V, and N.H = cos(p)."""
    for incidence, tilt in ((0.0, 0.3), (60.0, 0.3), (89.0, 0.6)):
        i = np.radians(incidence)
        light, view = np.array([np.sin(i), 0, np.cos(i)]), np.array([-np.sin(i), 0, np.cos(i)])
        normal = np.array([0, np.sin(tilt), np.cos(tilt)])
        mirror, half = 2 * (normal @ light) * normal - light, (light + view) / np.linalg.norm(light + view)
        assert normal @ half == pytest.approx(np.cos(tilt), abs=1e-12)
        assert mirror @ view == pytest.approx(1 - 2 * np.cos(i) ** 2 * np.sin(tilt) ** 2, abs=1e-12)
