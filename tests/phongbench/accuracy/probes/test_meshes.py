"""Probe `meshes`: interpolated normals shorten as law 10 says, and every row agrees with a slow, obvious twin."""

import json
from dataclasses import replace
from itertools import product

import numpy as np
import pandas as pd
import pytest

from phongbench.accuracy import sweep
from phongbench.accuracy.probes import meshes
from phongbench.accuracy.probes.interpolated_normals import NORMALS, classic, dots, lengthwise, lit, points, unit
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.analysis.summary import summarise
from phongbench.errors import InputError
from phongbench.formulas import lambda_forms
from phongbench.formulas.exact import TRUTHS
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Setting
from phongbench.inputs import meshes as surfaces
from phongbench.inputs.plan import preset
from phongbench.results import runs, schema
from phongbench.study import run

KEY = ["mesh", "edge_degrees", "approximation", "lambda_form", "space", "alpha", "gamma", "truth"]


@pytest.fixture(scope="module")
def plan():
    return replace(
        preset("quick"),
        alphas=(5.0, 32.0, 128.0),
        gammas=(4, 64),
        slopes=("taylor",),
        precisions=("float32",),
        lambda_forms=("dot", "difference", "cross", "tan2"),
        samples=2048,
    ).validated()


def probed(plan, jobs=2):
    told = []
    context = ProbeContext(sweep.prepare(plan), pd.DataFrame(), pd.DataFrame(), jobs=jobs, note=told.append)
    return meshes.measure(context)["meshes"], told


@pytest.fixture(scope="module")
def rows(plan):
    return probed(plan)[0]


@pytest.fixture(scope="module")
def found():
    """Points of a coarse torus."""
    torus = surfaces.torus(20.0)
    return points(torus, np.arange(len(torus.faces)), seed=3, count=4096)


def angle(a, b):
    """Between directions, exact for small ones too."""
    return 2 * np.arcsin(np.minimum(np.sqrt(dots(unit(a) - unit(b), unit(a) - unit(b))) / 2, 1))


def test_points_are_spread_evenly_over_the_area():
    torus = surfaces.torus(10.0)
    found = points(torus, np.arange(len(torus.faces)), seed=1, count=1 << 16)
    outer = np.mean(np.hypot(found.true[0], found.true[1]) > np.abs(found.true[2]))
    assert outer == pytest.approx(0.5, abs=0.01)  # half the tube's turn looks sideways; inner and outer areas balance
    assert np.abs(found.raw.mean(axis=1)).max() < 0.02


def test_law_10_a_lengthwise_reflection_keeps_its_direction_and_a_classic_one_turns(found):
    seen = lit(found, 64.0)
    length = np.sqrt(dots(found.raw, found.raw))
    built = lengthwise(found.raw, seen.light)
    np.testing.assert_allclose(built, length**2 * seen.reflected, atol=1e-14)
    turned = angle(classic(found.raw, seen.light), seen.reflected)
    short = 1 - length**2
    slant = 2 * np.arccos(np.clip(dots(seen.light, found.unit), -1, 1))
    np.testing.assert_allclose(turned, short * np.abs(np.sin(slant)), atol=3 * short.max() ** 2)
    assert turned.max() > 0.01
    np.testing.assert_allclose(classic(found.unit, seen.light), seen.reflected, atol=1e-14)


@pytest.mark.parametrize("alpha", [10.0, 128.0, 1024.0])
def test_seven_points_in_eight_look_into_the_highlight(found, alpha):
    seen = lit(found, alpha)
    inside = np.arange(4096) % 8 != 0
    wanted = min(12 / alpha, 1) * found.draws[2]
    for pair in ("classic", "half"):
        a, b = seen.true_pair(pair)
        cosine = dots(a, b)
        deficit = 1 - cosine if pair == "classic" else 2 * (1 - cosine**2)  # of the doubled angle
        np.testing.assert_allclose(deficit[inside], wanted[inside], atol=1e-12)
        np.testing.assert_allclose(dots(b, b), 1, rtol=1e-12)
    for vector in (seen.light, seen.viewer, seen.half):
        assert dots(vector, found.unit).min() > -1e-12  # above the horizon


def test_points_are_addressable(found):
    torus = surfaces.torus(20.0)
    fewer = points(torus, np.arange(len(torus.faces)), seed=3, count=100)
    np.testing.assert_array_equal(fewer.raw, found.raw[:, :100])
    other = points(torus, np.arange(len(torus.faces)), seed=4, count=100)
    assert np.abs(other.raw - fewer.raw).max() > 0.1


def test_rows_agree_with_plain_python(plan, rows):
    """The same pairs through the scalar bodies, one by one."""
    torus = surfaces.torus(20.0)
    seen = lit(points(torus, np.arange(len(torus.faces)), plan.seed, 2048), 32.0)
    picked = rows[(rows["mesh"] == "torus") & (rows["alpha"] == 32) & (rows["edge_degrees"] > 15)]
    picked = picked[picked["approximation"].eq("lyon") & picked["gamma"].eq(4)]
    assert len(picked) == 4 * 6 * 2  # forms, kinds of pair, truths
    for row in picked.itertuples():
        formula = REGISTRY["lyon"].bound(Setting(32.0, 4, "taylor", row.space))
        a, b = (v.astype(np.float32).astype(float) for v in seen.pair(row.normals, row.pair))
        form = lambda_forms.LAMBDA_FORMS[row.lambda_form]
        values = [formula(form(*x, *y)) if x @ y > 0 else 0.0 for x, y in zip(a.T, b.T, strict=True)]
        first, second = seen.true_pair(row.pair)
        if row.truth == "surface":
            first = seen.points.true if row.pair == "half" else classic(seen.points.true, seen.light)
        cosine = dots(first, second)
        exact = np.maximum(2 * cosine**2 - 1 if row.pair == "half" else cosine, 0.0) ** 32
        errors = np.abs(np.array(values) - exact)
        assert row.max_abs == pytest.approx(errors.max(), abs=1e-5)
        assert row.mean_abs == pytest.approx(errors.mean(), abs=1e-6)
        assert row.rms == pytest.approx(np.sqrt((errors**2).mean()), abs=1e-6)


def test_all_samples_agree_with_arrays(plan, rows):
    """The largest, mean and rms error of exact Phong on raw normals, by NumPy."""
    sphere = surfaces.icosphere(10.0)
    seen = lit(points(sphere, np.arange(len(sphere.faces)), plan.seed, 2048), 128.0)
    exact = np.maximum(dots(seen.reflected, seen.viewer), 0) ** 128
    for pair in ("classic", "lengthwise"):
        errors = np.maximum(dots(*seen.pair("raw", pair)), 0) ** 128 - exact
        row = rows[
            rows["mesh"].eq("icosphere")
            & rows["edge_degrees"].between(8, 12)
            & rows["approximation"].eq("phong")
            & rows["alpha"].eq(128)
            & rows["pair"].eq(pair)
            & rows["normals"].eq("raw")
            & rows["truth"].eq("interpolated")
        ].squeeze()
        assert row["max_abs"] == pytest.approx(np.abs(errors).max(), abs=2e-5)
        assert row["mean_abs"] == pytest.approx(np.abs(errors).mean(), abs=2e-5)
        assert row["rms"] == pytest.approx(np.sqrt((errors**2).mean()), abs=2e-5)
        assert row["codes_8bit"] == pytest.approx(255 * row["max_abs"])
        assert row["samples"] == 2048


def test_every_cell_is_measured_once_for_each_kind_of_pair(plan, rows):
    assert list(rows.columns) == schema.MESHES.names
    assert not rows.duplicated([*KEY, "normals", "pair"]).any()
    assert set(rows["alpha"]) == {32.0, 128.0}  # 5 shows no mesh
    kinds = rows.groupby(KEY, dropna=False)[["normals", "pair"]].apply(lambda g: frozenset(map(tuple, g.to_numpy())))
    reflect, half = (frozenset(product(NORMALS, pairs)) for pairs in (("classic", "lengthwise"), ("half",)))
    assert set(kinds) == {reflect, half}
    assert set(rows["mesh"]) == set(surfaces.TESSELLATIONS)
    assert set(TRUTHS).isdisjoint(rows["truth"])


def test_on_spheres_the_interpolated_normal_is_the_surfaces_and_on_the_torus_it_is_not(rows):
    both = rows.pivot_table(index=[*KEY[:-1], "normals", "pair"], columns="truth", values="max_abs", dropna=False)
    both = both.dropna()
    spheres = both.index.get_level_values("mesh") != "torus"
    np.testing.assert_allclose(both["surface"][spheres], both["interpolated"][spheres], atol=1e-7)
    assert (both["surface"] - both["interpolated"])[~spheres].max() > 0.05


def test_renormalised_normals_leave_the_formulas_own_error(rows):
    whole = rows[rows["normals"].eq("renormalised") & rows["truth"].eq("interpolated")]
    assert whole["length_max"].max() < 4e-5  # rounding of the dot form at alpha = 128
    np.testing.assert_allclose(whole["max_abs"], whole["model_max"], atol=8e-5)


def test_law_8_and_10_what_short_normals_change_grows_as_the_laws_say(rows):
    """Shortness grows like the edge squared; the dot form sees it at first order, the others on the flank only."""
    lyon = rows[rows["approximation"].eq("lyon") & rows["gamma"].eq(64) & rows["alpha"].eq(32.0)]
    lyon = lyon[lyon["normals"].eq("raw") & lyon["truth"].eq("interpolated") & lyon["mesh"].eq("uv-sphere")]
    for pair in ("lengthwise", "half", "classic"):
        change = lyon[lyon["pair"] == pair].pivot_table(
            index="edge_degrees", columns="lambda_form", values="length_max"
        )
        fine = change[change.index < 12]
        slopes = {form: np.polyfit(np.log(fine.index), np.log(fine[form]), 1)[0] for form in fine}
        assert slopes["cross"] == pytest.approx(2, abs=0.15)
        if pair != "half":  # one short vector among two: |a - b|^2 / 2 has a term of fourth order beside the flank's
            assert slopes["difference"] == pytest.approx(2, abs=0.35)
        assert (fine["dot"] > 5 * fine["cross"]).all()
        if pair != "classic":
            assert fine["tan2"].max() < 2e-5  # free of lengths
    raw = lyon.pivot_table(index="edge_degrees", columns=["pair", "lambda_form"], values="length_max")
    assert (raw["classic"]["cross"] > 4 * raw["lengthwise"]["cross"])[raw.index < 12].all()


def test_threads_do_not_change_the_rows_and_seeds_do(plan, rows):
    pd.testing.assert_frame_equal(probed(plan, jobs=1)[0], rows)
    other = probed(replace(plan, seed=9, alphas=(32.0,)))[0]
    same = rows[rows["alpha"] == 32.0].reset_index(drop=True)
    assert len(other) == len(same)
    assert (other["mean_abs"] != same["mean_abs"]).mean() > 0.9


def test_a_study_of_wide_lobes_only_says_that_no_mesh_is_measured(plan):
    frame, told = probed(replace(plan, alphas=(5.0,)))
    assert frame.empty
    assert list(frame.columns) == schema.MESHES.names
    assert "no exponent" in told[0]


@pytest.fixture
def folded(tmp_path):
    """An OBJ of a fine icosphere with one triangle that folds back and one without area."""
    sphere = surfaces.icosphere(4.0)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in sphere.vertices.tolist()]
    lines += [f"vn {x!r} {y!r} {z!r}" for x, y, z in sphere.normals.tolist()]
    lines += [f"f {i}//{i} {j}//{j} {k}//{k}" for i, j, k in (sphere.faces + 1).tolist()]
    far = int(np.argmin(sphere.normals @ sphere.normals[0])) + 1
    lines += [f"f 1//1 2//2 {far}//{far}", "f 1//1 1//1 2//2"]
    path = tmp_path / "folded.obj"
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def test_a_file_is_measured_in_classes_of_its_edges(plan, folded):
    narrow = replace(plan, alphas=(128.0,), lambda_forms=("cross",), gammas=(64,), meshes=(str(folded),)).validated()
    frame, told = probed(narrow)
    mine = frame[frame["mesh"] == "folded.obj"]
    sphere = surfaces.icosphere(4.0)
    classes = mine.drop_duplicates("edge_degrees").sort_values("edge_degrees")
    assert classes["triangles"].sum() == len(sphere.faces)
    assert classes["edge_degrees"].max() == pytest.approx(sphere.edge_degrees().max())
    assert set(mine["truth"]) == {"interpolated"}
    assert set(mine["left_out"]) == {1}
    odd = "degenerate triangles left out: 1; left out, edges wider than 90 degrees: 1"
    assert told == [f"folded.obj: {len(sphere.faces) + 1} triangles; {odd}"]


def test_a_study_stores_the_rows_and_checks_its_meshes_first(plan, folded, tmp_path):
    small = replace(plan, alphas=(32.0,), samples=300, timing=False, meshes=(str(folded), str(folded))).validated()
    assert small.meshes == (str(folded),)
    outcome = run.run_study(small, tmp_path / "run")
    stored = runs.load(outcome.run.path)
    assert set(stored.meshes["mesh"]) == {*surfaces.TESSELLATIONS, "folded.obj"}
    assert runs.verify(stored) == []
    found = summarise(stored)
    assert "at alpha 32 change the cross form by one 8-bit code from edges of" in found["facts"]["raw normals"]
    assert {row["lambda_form"] for row in found["mesh_edges"]} == set(lambda_forms.LAMBDA_FORMS)
    json.dumps(found, allow_nan=False)
    with pytest.raises(InputError, match="cannot read the mesh"):
        replace(plan, meshes=("absent.obj",)).validated()
    with pytest.raises(InputError, match="left out"):
        replace(plan, meshes=(str(folded),), probes=()).validated()
    twin = tmp_path / "other" / "folded.obj"
    twin.parent.mkdir()
    twin.write_bytes(folded.read_bytes())
    with pytest.raises(InputError, match=r"named folded\.obj"):
        replace(plan, meshes=(str(folded), str(twin))).validated()


def test_the_forecast_grows_with_the_work(plan):
    one = meshes.seconds(plan, 1)
    assert 0 < one < 60
    assert meshes.seconds(plan, 2) == pytest.approx(one / 2)
    assert meshes.seconds(replace(plan, samples=1 << 20), 1) > one
    assert meshes.seconds(replace(plan, meshes=("a.obj",)), 1) > one
