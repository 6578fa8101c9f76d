"""The probe of scenes: pictures against the lobe's law, skips against their bounds, polygons under far lights."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from phongbench.accuracy.probes import directional_lights, far_lights, pictures, skipped_work
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.inputs.plan import PRESETS, USUAL_PROBES
from phongbench.inputs.plan_files import compose
from phongbench.results import runs, schema
from phongbench.scenes import scene_files
from phongbench.scenes.render import render
from phongbench.study import run as study

PAIR = ("test-card", "chequerboard")


@pytest.fixture(scope="module")
def two_scenes():
    """One scene without reflections, one with; the others take longer and ask nothing else."""
    with pytest.MonkeyPatch.context() as patch:
        shipped = scene_files.examples()
        patch.setattr(pictures, "examples", lambda: {name: shipped[name] for name in PAIR})
        yield


@pytest.fixture
def one_scene(monkeypatch):
    """The one that takes least."""
    monkeypatch.setattr(pictures, "examples", lambda: {PAIR[0]: ""})


@pytest.fixture(scope="module")
def tiny(small_plan):
    return replace(
        small_plan,
        approximations=("phong", "lyon", "gaussian", "blinn"),
        alphas=(10.0, 50.0),
        gammas=(4, 8),
        lambda_forms=("dot", "cross"),
        precisions=("float32",),
        samples=500,
        probes=("scenes",),
    ).validated()


def tables(plan, registry=REGISTRY, note=lambda text: None):
    """What the probe answers; it asks nothing of the sweep but its plan and registry."""
    sweep = type("Sweep", (), {"plan": plan, "registry": registry})()
    shares = []
    context = ProbeContext(sweep, pd.DataFrame(), pd.DataFrame(), 2, advance=shares.append, note=note)
    found = pictures.measure(context)
    assert context.violations == []
    assert math.isclose(sum(shares), 1.0)
    return found


@pytest.fixture(scope="module")
def found(two_scenes, tiny):
    return tables(tiny)


# pictures


def test_a_picture_errs_by_no_more_than_its_lobe_promises(found):
    rows = found["scenes"]
    assert set(rows["scene"]) == set(PAIR)
    drawn = rows[rows["left_out"].isna() & (rows["approximation"] != "blinn")]
    assert len(drawn) > 8
    assert (drawn["max_abs"] <= 1.001 * drawn["lobe_max"] + 1e-6).all()
    assert (drawn["psnr"] > 20).all()
    assert list(rows.columns) == schema.SCENES.names


def test_on_the_test_card_the_law_is_met_and_not_only_kept(two_scenes, tiny):
    """Where a sphere shows every angle of the lobe the bound is the error: a reader may trust the scalar table."""
    card = scene_files.read_scene("test-card")
    rows = pd.DataFrame(pictures.picture_errors.compare(card, pictures.drawn(tiny), size=(320, 180)))
    lyon = rows[rows["approximation"] == "lyon"]
    np.testing.assert_allclose(lyon["max_abs"], lyon["lobe_error"], rtol=0.05)


def test_only_formulas_of_the_plan_are_drawn(tiny):
    drawn = pictures.drawn(tiny)
    assert {s.approximation for s in drawn} == {"lyon", "gaussian", "blinn"}
    assert {s.gamma for s in drawn} == {4, 8, None}
    assert not pictures.drawn(replace(tiny, approximations=("phong",)))


def test_a_formula_that_does_not_fit_a_scene_is_left_out_with_the_reason(two_scenes, tiny):
    wide = replace(tiny, approximations=("phong", "lyon"), gammas=(4, 8, 16))
    rows = tables(wide)["scenes"]
    out = rows[rows["left_out"].notna()]
    for row in out.to_dict("records"):
        assert "materials." in row["left_out"]
        assert math.isnan(row["max_abs"])


def own(name, **changes):
    """Lyon's formula as a user's of this name."""
    return replace(REGISTRY["lyon"], name=name, **changes)


def test_the_users_own_formulas_are_drawn_like_ours_and_one_that_fails_leaves_its_own_rows_alone(one_scene, tiny):
    mine, fails = own("mine"), own("fails", cutoff=lambda s: 1 / (s.alpha - s.alpha))
    registry = {**REGISTRY, "mine": mine, "fails": fails}
    plan = replace(tiny, approximations=("phong", "lyon", "mine", "fails")).validated(registry)
    notes = []
    rows = tables(plan, registry, notes.append)["scenes"].set_index("approximation")
    ours, theirs, failed = (rows.loc[name].reset_index(drop=True) for name in ("lyon", "mine", "fails"))
    pd.testing.assert_frame_equal(ours[ours["beta_policy"] == "taylor"], theirs)
    assert failed["left_out"].str.fullmatch(r"materials\..*: ZeroDivisionError: float division by zero").all()
    assert failed["max_abs"].isna().all()
    (note,) = notes
    assert note.startswith(f"fails is left out of {len(failed)} of {len(failed)} pictures; test-card: ")
    assert "ZeroDivisionError" in note


def test_the_users_own_formula_is_timed_like_ours(tiny):
    registry = {**REGISTRY, "mine": own("mine")}
    card = scene_files.read_scene("test-card")
    wishes = {"size": (16, 9), "registry": registry}
    exact, mine = pictures._times(card, [Formula.of("mine", "dot", 4, registry=registry)], tiny, wishes)
    assert (exact["name"], mine["name"]) == ("phong", "mine:dot:4")
    assert mine["ratio_low"] <= mine["ratio"] <= mine["ratio_high"]


# skips


def test_exact_skips_change_no_bit_and_bounded_ones_keep_their_bound(found):
    rows = found["skips"]
    exact = rows[rows["kind"] == "exact"]
    assert exact["same_bits"].all()
    assert (rows["largest_change"] <= rows["bound"] + skipped_work.ROUNDING).all()
    assert {"objects", "background", "reflectivity", "all", "all exact"} <= set(rows["name"])


def test_the_more_is_cut_off_the_fewer_rays_are_followed(found):
    cut = found["skips"][found["skips"]["name"] == "cutoff"]
    assert set(cut["scene"]) == {"chequerboard"}
    assert tuple(cut["setting"]) == skipped_work.CUTOFFS
    assert cut["skipped"].is_monotonic_increasing
    assert cut["skipped"].iloc[-1] > 0
    scene = scene_files.read_scene("chequerboard")
    skips = replace(skipped_work.SceneSkips(), cutoff=0.0)
    size = tuple(int(cut[name].iloc[0]) for name in ("width", "height"))
    assert render(scene, size=size, depth=skipped_work.DEEP, skips=skips).rays == cut["of"].iloc[0]


def test_a_skip_that_breaks_its_promise_is_told(found):
    row = found["skips"].iloc[0].to_dict()
    assert skipped_work.violations([row]) == []
    (exact,) = skipped_work.violations([row | {"kind": "exact", "same_bits": False, "largest_change": 0.25}])
    assert "is exact" in exact
    assert "0.25" in exact
    (bounded,) = skipped_work.violations([row | {"kind": "bounded", "bound": 0.1, "largest_change": 0.2}])
    assert "its bound is 0.1" in bounded


# polygons


@pytest.mark.parametrize("alpha", [10.0, 200.0])
def test_far_away_the_error_falls_as_the_distance_grows(alpha):
    """Moving by half a diagonal turns L and V by so many radians each; times the lobe's steepest slope."""
    steepest = math.sqrt(alpha) * (1 - 1 / alpha) ** ((alpha - 1) / 2)
    for held, turns in {"light": 1, "viewer": 1, "both": 2}.items():
        for distance in (1e3, 1e4):
            worst = max(
                far_lights.error(place, held, "specular", alpha, distance) for place in far_lights.placements(alpha)
            )
            law = turns * steepest * math.sqrt(0.5) / distance
            assert 0.9 * law < worst < 1.005 * law


def test_the_diffuse_term_errs_by_half_the_sine_of_twice_the_incidence(tiny):
    rows = far_lights.measure(tiny)
    diffuse = rows[(rows["term"] == "diffuse") & (rows["distance"] > 1e3)]
    law = math.sin(math.radians(120)) / 2 * math.sqrt(0.5) / diffuse["distance"]
    np.testing.assert_allclose(diffuse["max_abs"], law, rtol=0.01)
    assert not rows.duplicated(["held", "term", "alpha", "distance"]).any()


def test_held_at_its_middle_a_polygon_is_right_there():
    middle = len(far_lights.square()[0]) // 2
    for place in far_lights.placements(50.0):
        held, true = (far_lights._term(place, how, "specular", 50.0, 4.0)[middle] for how in ("both", "nothing"))
        assert held == pytest.approx(true, abs=1e-12)


# times


def test_with_timing_every_formula_and_skip_has_a_time(two_scenes, tiny):
    timed = tables(replace(tiny, timing=True))
    times = timed["scene_times"]
    drawn = timed["scenes"][timed["scenes"]["left_out"].isna()]
    assert (times["kind"] == "formula").sum() == len(drawn) + len(PAIR)
    assert (times["kind"] == "skip").sum() == (timed["skips"]["name"] != "cutoff").sum()
    assert (times["kind"] == "cutoff").sum() == len(skipped_work.CUTOFFS)
    shading = times[times["kind"] == "shading"]
    assert set(shading["name"]) == {"phong", directional_lights.TWIN, "blinn-phong"}
    assert (times["ratio_low"] <= times["ratio"]).all()
    assert list(times.columns) == schema.SCENE_TIMES.names


# a run


def test_a_run_keeps_the_tables_and_verifies(found, tiny, tmp_path):
    run = runs.load(study.run_study(tiny, tmp_path / "run").run.path)
    assert runs.verify(run) == []
    assert run.scene_times.empty
    for name in ("scenes", "skips", "far"):
        assert len(getattr(run, name))
    for name in ("scenes", "skips", "far"):
        pd.testing.assert_frame_equal(getattr(run, name), found[name])


def test_scenes_are_asked_by_the_flag_and_by_the_full_preset_only():
    assert [name for name, plan in PRESETS.items() if "scenes" in plan.probes] == ["full"]
    assert set(compose(scenes=True).validated().probes) == {*USUAL_PROBES, "scenes"}
    assert compose(scenes=True, probes=("none",)).probes == ("scenes",)
    assert compose(scenes=True, preset_name="full").validated() == PRESETS["full"].validated()
    assert pictures.size(PRESETS["full"]) == (640, 360)
