"""Plans: presets, TOML, validation that says what, where and how to fix it."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest

from phongbench.errors import InputError, UnknownNameError
from phongbench.inputs.mtl_files import OPENGL
from phongbench.inputs.plan import PRESETS, QUICK_ALPHAS, STANDARD_ALPHAS, Plan, preset
from phongbench.inputs.plan_files import Between, compose, read_plan

QUICK = preset("quick")


def write(folder, text):
    path = folder / "plan.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("plan", PRESETS.values(), ids=PRESETS)
def test_presets_are_valid_and_survive_a_round_trip(plan):
    ready = plan.validated()
    assert Plan.from_dict(ready.as_dict()) == ready
    assert ready.validated() == ready


def test_quick_covers_what_it_promises():
    assert len(QUICK.alphas) >= 12
    assert {10, 20, 50, 200} <= set(QUICK.alphas)
    assert {2, 4, 8, 16, 32, 64} <= set(QUICK.gammas)
    assert {"dot", "difference", "cross"} <= set(QUICK.lambda_forms)
    assert {"float32", "float16"} <= set(QUICK.precisions)
    assert QUICK.samples >= 100_000


def test_presets_hold_the_powers_of_two_and_exponents_of_real_materials():
    together = set(QUICK_ALPHAS) | set(STANDARD_ALPHAS)
    assert {2.0**n for n in range(12)} <= together
    assert {96.08, 225.0} <= together  # what Blender wrote of a plain material before 2.8, and from then on
    odd = {alpha for alpha in together if alpha != int(alpha)}
    assert odd - {96.08} <= {float(f"{material.shininess:.3g}") for material in OPENGL}  # 96.08: Blender's own


@pytest.mark.parametrize(
    "change", [{"samples": 1}, {"samples": 1 << 40}, {"seed": 0}, {"timing_budget": 1e-9}], ids=str
)
def test_what_is_possible_just_so_is_not_refused(change):
    assert replace(QUICK, **change).validated().digest != QUICK.validated().digest


def test_different_plans_have_different_digests():
    assert QUICK.digest != replace(QUICK, seed=2).digest
    assert QUICK.digest == preset("quick").digest


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"alphas": (0.0,)}, "alpha = 0"),
        ({"alphas": (-3.0,)}, "alpha = -3"),
        ({"alphas": (math.nan,)}, "alpha = nan"),
        ({"alphas": (math.inf,)}, "alpha = inf"),
        ({"alphas": ()}, "alphas is empty"),
        ({"gammas": (3,)}, "gamma = 3 is not a power of two"),
        ({"gammas": (0,)}, "gamma = 0"),
        ({"gammas": ()}, "gammas is empty"),
        ({"samples": 0}, "samples = 0"),
        ({"samples": (1 << 40) + 1}, "samples = 1099511627777"),
        ({"seed": -1}, "seed = -1"),
        ({"timing_budget": 0.0}, "timing budget"),
        ({"timing_budget": math.nan}, "timing budget"),
    ],
)
def test_impossible_values_are_refused_by_name(change, said):
    with pytest.raises(InputError, match=said):
        replace(QUICK, **change).validated()


@pytest.mark.parametrize(
    "change",
    [
        {"approximations": ("lyn",)},
        {"lambda_forms": ("crossed",)},
        {"precisions": ("float8",)},
        {"strata": ("peaks",)},
        {"slopes": ("tailor",)},
        {"spaces": ("world",)},
    ],
)
def test_unknown_names_list_the_known_ones(change):
    with pytest.raises(UnknownNameError) as caught:
        replace(QUICK, **change).validated()
    assert "known:" in str(caught.value)


def test_exact_phong_is_always_measured():
    assert "phong" in replace(QUICK, approximations=("lyon",)).validated().approximations


def test_cells_keep_to_the_axes_and_to_what_formulas_accept():
    plan = replace(QUICK, alphas=(10.0, 27.9), gammas=(4, 8)).validated()
    cells = list(plan.cells())
    assert len(set(cells)) == len(cells)
    assert {c.alpha for c in cells if c.approximation == "integer-power"} == {10.0}
    assert {c.formula.gamma for c in cells if c.approximation == "lyon"} == {4, 8}
    assert {c.formula.gamma for c in cells if c.approximation == "gaussian"} == {None}
    assert {c.lambda_form for c in cells if c.approximation == "schlick"} == {"none"}


def test_a_toml_plan_changes_its_preset(tmp_path):
    path = write(
        tmp_path, 'preset = "standard"\nalphas = [10, 50.5]\ngammas = [8]\nsamples = 1000\ntiming_budget = 3\n'
    )
    assert read_plan(path) == replace(
        preset("standard"), alphas=(10, 50.5), gammas=(8,), samples=1000, timing_budget=3.0
    )


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("alphas = [10]\n\ngama = [8]\n", 3, "'gama'"),
        ('seed = 1\nalphas = ["ten"]\n', 2, "alphas"),
        ("gammas = [4.5]\n", 1, "gammas"),
        ('seed = 1\nsamples = "many"\n', 2, "samples"),
        ("alphas = [true]\n", 1, "alphas"),
        ("timing = 1\n", 1, "timing"),
    ],
)
def test_a_bad_toml_key_is_named_with_its_line(tmp_path, text, line, said):
    path = write(tmp_path, text)
    with pytest.raises(InputError, match=said) as caught:
        read_plan(path)
    assert str(caught.value.where).startswith(f"{path}:{line}: ")


def test_malformed_and_missing_files_are_refused(tmp_path):
    with pytest.raises(InputError, match="not valid TOML"):
        read_plan(write(tmp_path, "alphas = [10\n"))
    with pytest.raises(InputError, match="cannot read"):
        read_plan(tmp_path / "nothing.toml")


def test_compose_prefers_wishes_and_refuses_contradictions(tmp_path):
    assert compose(None, None, None, seed=7, samples=None) == replace(QUICK, seed=7)
    path = write(tmp_path, "seed = 3\n")
    assert compose(path, None, None, alphas=(1.0,)).seed == 3
    with pytest.raises(InputError, match="--preset"):
        compose(path, "quick")
    with pytest.raises(InputError, match="--materials"):
        compose(None, None, path, alphas=(1.0,))
    with pytest.raises(UnknownNameError, match="preset"):
        compose(None, "qick")


@pytest.mark.parametrize(("low", "high"), [(20.0, 80.0), (10.0, 10.0), (1.0, 10000.0), (49.0, 51.0)])
def test_exponents_between_two_are_as_close_as_those_of_a_preset(low, high):
    like = QUICK.alphas
    found = Between(low, high).alphas(like)
    assert (found[0], found[-1]) == (low, high)
    assert list(found) == sorted(set(found))
    usual = (max(like) / min(like)) ** (1 / (len(like) - 1))
    assert all(after / before <= usual * 1.01 for before, after in pairwise(found))  # rounded to three digits
    assert (high / low) ** (1 / max(len(found) - 2, 1)) >= usual or len(found) <= 2  # one fewer would be too few


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (-1.0, 1.0), (2.0, 1.0), (1.0, math.inf), (math.nan, 1.0)])
def test_a_range_from_high_to_low_or_to_no_exponent_is_refused(low, high):
    with pytest.raises(InputError, match="no range of exponents"):
        Between(low, high).alphas(QUICK.alphas)


def test_materials_give_the_exponents(tmp_path):
    path = tmp_path / "scene.mtl"
    path.write_text("newmtl a\nNs 96.08\nnewmtl b\nNs 10\n")
    assert compose(None, None, path).alphas == (10.0, 96.08)


def test_raw_formulas_are_measured_at_exponents_that_they_take_and_in_spaces_of_the_plan():
    raw = ("phong/each", "integer-power/each", "blinn@halfway/once")
    plan = replace(QUICK, alphas=(10.0, 27.9), raw=raw, precisions=("float32",))
    cells = {(str(c.formula), c.alpha) for c in plan.validated().cells() if c.formula.raw}
    of_pair = {("phong/each", 10.0), ("phong/each", 27.9), ("integer-power/each", 10.0)}
    of_half = {("blinn@halfway/once", 10.0), ("blinn@halfway/once", 27.9)}
    assert cells == of_pair | of_half
    reflect = replace(plan, spaces=("reflect",)).validated()
    assert {(str(c.formula), c.alpha) for c in reflect.cells() if c.formula.raw} == of_pair


def test_meshes_are_distinguished_by_their_names(tmp_path):
    paths = [tmp_path / name for name in ("one/a.obj", "other/a.obj", "other/b.obj")]
    for path in paths:
        path.parent.mkdir(exist_ok=True)
        path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    one, same, other = map(str, paths)
    assert replace(QUICK, meshes=(one, other, one)).validated().meshes == (one, other)
    with pytest.raises(InputError, match=r"two meshes are named a\.obj"):
        replace(QUICK, meshes=(one, same)).validated()
