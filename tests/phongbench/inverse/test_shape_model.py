"""Shapes from one picture: components that are learnt, their fit, and the cone that is left without them."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from phongbench.cli.main import main
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.inverse import held_out, shape_model
from phongbench.inverse.shape_model import ShapeModel, cone, fit, learn, normals_of, synthetic_heads
from phongbench.inverse.surface_model import PhotometricLight, SurfaceModel
from phongbench.support import image_files

SIZE, HELD_OUT = 40, 4
LIGHT = PhotometricLight.of((0.4, 0.3, 1.0))
MODEL = SurfaceModel(0.05, 0.7, 0.2, 20.0)


def call(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["inverse", *map(str, arguments)])


@pytest.fixture(scope="module")
def heads() -> np.ndarray:
    return synthetic_heads(100 + HELD_OUT, SIZE)


@pytest.fixture(scope="module")
def shapes(heads: np.ndarray) -> ShapeModel:
    return learn(heads[HELD_OUT:], 20)


def shaded(heights: np.ndarray, light: PhotometricLight = LIGHT, model: SurfaceModel = MODEL) -> np.ndarray:
    """The picture of heights, by the reflection model's own words."""
    normals, towards = normals_of(heights), np.array(light.direction)
    facing = normals @ towards
    mirrored = np.maximum(2 * facing * normals[..., 2] - towards[2], 0.0)
    shine = np.where(facing > 0, mirrored**model.alpha, 0.0)
    return model.ambient + light.intensity * (model.diffuse * np.maximum(facing, 0) + model.specular * shine)


def off(heights: np.ndarray, truth: np.ndarray) -> float:
    """Mean angle between the normals, in degrees."""
    one, other = normals_of(heights), normals_of(truth)
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(one, other), axis=2), (one * other).sum(axis=2))).mean())


def test_components_are_those_of_the_covariance(heads: np.ndarray) -> None:
    small = learn(heads[:8], 7)
    flat = small.components.reshape(7, -1)
    np.testing.assert_allclose(flat @ flat.T, np.eye(7), atol=1e-10)
    centred = (heads[:8] - small.mean).reshape(8, -1)
    np.testing.assert_allclose(np.sort(np.linalg.eigvalsh(centred @ centred.T / 7))[:0:-1], small.variances, rtol=1e-6)
    assert np.abs(small.heights((centred @ flat.T)[3]) - heads[3]).max() < 1e-9


def test_heads_held_out_come_back_from_one_picture(heads: np.ndarray, shapes: ShapeModel) -> None:
    rows = held_out.recovery(shapes, heads[:HELD_OUT])
    assert held_out.ratio(rows) <= 1 / 3
    assert (rows["prior_degrees"] <= rows["mean_degrees"] / 3).all()
    assert (rows["prior_depth_rmse"] <= rows["mean_depth_rmse"] / 3).all()
    # the prior is worth something where there is noise
    assert rows["prior_degrees"].mean() < rows["components_degrees"].mean()
    truth = held_out.drawn(heads[0], 0)
    assert np.std(truth - shaded(heads[0], held_out.LIGHT, held_out.MODEL)) == pytest.approx(held_out.NOISE, rel=0.1)
    found = fit(shaded(heads[0]), shapes, LIGHT, MODEL)
    assert off(shapes.mean, heads[0]) == pytest.approx(rows["mean_degrees"][0])
    assert found.residual < 0.02


def test_learning_holds_maps_out(heads: np.ndarray, shapes: ShapeModel, tmp_path: Path) -> None:
    np.savez(tmp_path / "maps.npz", np.concatenate([heads[HELD_OUT:], heads[:2]]))
    out = tmp_path / "shapes.npz"
    shown = call("learn", tmp_path / "maps.npz", "--held-out", 2, "--out", out, "--json")
    told = json.loads(shown.stdout)
    assert (told["maps"], len(told["held_out"])) == (100, 2)
    assert told["ratio_to_mean_shape"] <= 1 / 3
    np.testing.assert_array_equal(shape_model.read_shapes(out).components, shapes.components)
    assert "mean_degrees" in call("learn", tmp_path / "maps.npz", "--held-out", 1, "--out", out).stdout


@pytest.mark.parametrize("formula", ["phong", "lyon:cross:8", "blinn"])
def test_derivatives_are_those_of_differences(shapes: ShapeModel, formula: str) -> None:
    model = SurfaceModel(0.05, 0.7, 0.5, 10.0, Formula.parse(formula))
    shader = shape_model._Shader(shapes, LIGHT, model)
    where = np.sqrt(shapes.variances) * np.linspace(-1, 1, 20)
    values, changes = shader.shade(where)
    if formula == "phong":
        np.testing.assert_allclose(values, shaded(shapes.heights(where), LIGHT, model).ravel(), atol=1e-12)
    for k in (0, 7, 19):
        step = np.zeros(20)
        step[k] = 1e-4 * np.sqrt(shapes.variances[k])
        slope = (shader.shade(where + step)[0] - shader.shade(where - step)[0]) / (2 * step[k])
        close = np.abs(slope - changes[:, k]) <= 1e-4 * np.abs(changes[:, k]).max()
        assert close.mean() > 0.99  # but where a pixel's shadow or highlight begins


def test_without_a_prior_the_cone_is_left_and_the_truth_lies_on_it(heads: np.ndarray) -> None:
    matt = SurfaceModel(0.05, 0.7)
    picture = shaded(heads[0], LIGHT, matt)
    half = cone(picture, LIGHT, matt)
    true = np.degrees(np.arccos(np.clip(normals_of(heads[0]) @ np.array(LIGHT.direction), -1, 1)))
    assert np.abs(half - true)[np.isfinite(half)].max() < 1e-6
    assert (np.isnan(half) == (true >= 90)).all()
    with pytest.raises(InputError, match="no cone"):
        cone(picture, LIGHT, MODEL)


def test_the_commands_learn_and_fit(heads: np.ndarray, tmp_path: Path) -> None:
    folder = tmp_path / "maps"
    folder.mkdir()
    for k, head in enumerate(heads[HELD_OUT : HELD_OUT + 30]):
        np.save(folder / f"{k:02}.npy", head)
    np.savez(tmp_path / "maps.npz", heads[HELD_OUT : HELD_OUT + 30])
    out = tmp_path / "shapes.npz"
    for source in (folder, tmp_path / "maps.npz"):
        told = json.loads(call("learn", source, "--components", 10, "--out", out, "--json").stdout)
        assert told["maps"] == 30
        assert 0.9 < told["share_of_variance"] <= 1
    image_files.save(tmp_path / "head.npy", shaded(heads[0]))
    model = ["--light", "0.4,0.3,1", "--ambient", 0.05, "--diffuse", 0.7, "--ks", 0.2, "--alpha", 20]
    prior = ["--prior", "pca", out, "--normals", tmp_path / "n.png"]
    shown = call("image", tmp_path / "head.npy", *model, *prior, "--out", tmp_path / "z.npy", "--json")
    assert shown.exit_code == 0, shown.output
    assert off(np.load(tmp_path / "z.npy"), heads[0]) < 5.0
    assert (tmp_path / "n.png").exists()
    cones = call("image", tmp_path / "head.npy", "--light", "0.4,0.3,1", "--out", tmp_path / "c.npy")
    assert cones.exit_code == 0
    assert call("learn", "--synthetic", 5, "--components", 3, "--out", tmp_path / "s.npz").exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (["learn", "{}/none", "--out", "{}/o.npz"], "cannot read"),
        (["learn", "{}/empty", "--out", "{}/o.npz"], "no .npy file"),
        (["learn", "{}/bad.npz", "--out", "{}/o.npz"], "bad.npz"),
        (["learn", "--synthetic", "4", "--out", "{}/o.npz"], "20 components of 4 depth maps"),
        (["learn", "--synthetic", "4", "--components", "2", "--out", "{}/o.txt"], "not written as .txt"),
        (["learn", "--out", "{}/o.npz"], "give depth maps"),
        (["learn", "--synthetic", "4", "--held-out", "4", "--out", "{}/o.npz"], "4 maps held out of 4"),
        (["image", "{}/p.npy", "--light", "0,0,-1", "--out", "{}/o.npy"], "--light"),
        (["image", "{}/p.npy", "--light", "0,0,1", "--out", "{}/o.png"], "not written as .png"),
        (["image", "{}/p.npy", "--light", "0,0,1", "--ks", "1", "--out", "{}/o.npy"], "no cone"),
        (["image", "{}/p.npy", "--light", "0,0,1", "--prior", "pca", "{}/bad.npz", "--out", "{}/o.npy"], "bad.npz"),
        (["image", "{}/p.npy", "--light", "0,0,1", "--prior", "pca", "{}/s.npz", "--out", "{}/o.npy"], "3 x 2 pixels"),
    ],
)
def test_wrong_input_is_refused(tmp_path: Path, arguments: list[str], what: str) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "bad.npz").write_bytes(b"no archive")
    image_files.save(tmp_path / "p.npy", np.full((2, 3), 0.5))
    shape_model.save_shapes(learn(synthetic_heads(4, 8), 2), tmp_path / "s.npz")
    found = call(*(argument.format(tmp_path) for argument in arguments))
    assert found.exit_code == 2, found.output
    assert what in found.stderr


def test_maps_and_pictures_that_cannot_be_are_refused(shapes: ShapeModel) -> None:
    for maps in (np.zeros((3, 4)), np.full((3, 4, 4), np.nan), np.zeros((1, 4, 4))):
        with pytest.raises(InputError):
            learn(maps, 1)
    for picture, noise in ((np.full((SIZE, SIZE), np.nan), 0.01), (np.zeros((SIZE, SIZE)), 0.0)):
        with pytest.raises(InputError):
            fit(picture, shapes, LIGHT, MODEL, noise)
