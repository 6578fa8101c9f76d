"""Photometric stereo: exact pictures give exact normals, approximations bend them, and no pixel is guessed."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from phongbench.compiler import jit
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.inverse import solver
from phongbench.inverse.photometric import invert_pictures
from phongbench.inverse.surface_model import PhotometricLight, SurfaceModel, solver_rows
from phongbench.shading.lighting import Light, Material, Viewer
from phongbench.shading.shade import shade

Array = NDArray[np.float64]
SIZE = 40
KD, KS = 0.7, 0.5


def sphere(size: int = SIZE) -> tuple[Array, NDArray[np.bool_]]:
    """Normals (h, w, 3) of a sphere, x right, y up, and the mask within 0.9 of its radius."""
    y, x = np.mgrid[1 : -1 : size * 1j, -1 : 1 : size * 1j]
    z = np.sqrt(np.maximum(1 - x * x - y * y, 0.0))
    return np.dstack([x, y, z]), np.asarray(x * x + y * y < 0.81)


def around(slant: float, count: int = 4) -> list[PhotometricLight]:
    """Lights evenly around the viewer, at a slant in degrees."""
    s, turns = math.radians(slant), 2 * math.pi * np.arange(count) / count + 0.3
    return [PhotometricLight.of((math.sin(s) * math.cos(t), math.sin(s) * math.sin(t), math.cos(s))) for t in turns]


def pictures(lights: list[PhotometricLight], alpha: float, normals: Array, formula: str = "phong") -> Array:
    """What the shading of scenes makes of the normals: the oracle, one light at a time."""
    flat = np.ascontiguousarray(normals.reshape(-1, 3)) + np.array([0.0, 0.0, 1e-300])
    drawn = []
    for light in lights:
        strength = (light.intensity,) * 3
        shaded = shade(
            np.zeros_like(flat),
            flat,
            material=Material((0.0,) * 3, (KD,) * 3, (KS,) * 3, alpha),
            lights=[Light(direction=light.direction, diffuse=strength, specular=strength)],
            viewer=Viewer(direction=(0.0, 0.0, 1.0)),
            specular=Formula.parse(formula),
        )
        drawn.append(shaded.colours[:, 0].reshape(normals.shape[:2]))
    return np.array(drawn)


def degrees(found: Array, truth: Array) -> Array:
    """Angles between normals; accurate near 0."""
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(found, truth), axis=-1), (found * truth).sum(axis=-1)))


@pytest.mark.parametrize("formula", ["phong", "lyon:dot:8", "lyon:cross:4", "gaussian:tan2", "blinn"])
def test_pictures_of_a_formula_give_its_normals_back(formula: str) -> None:
    normals, mask = sphere()
    lights = [*around(30), PhotometricLight.of((0.1, 0.2, 1.0), 0.6)]
    drawn = pictures(lights, 30, normals, formula)
    found = invert_pictures(drawn, lights, SurfaceModel(0.0, KD, KS, 30, Formula.parse(formula)), mask=mask)
    off = degrees(found.normals, normals)[mask]
    assert np.isfinite(off).mean() > 0.97
    assert np.nanmean(off) < 1e-3
    assert np.isnan(found.normals[~mask]).all()


def test_formulas_bend_the_normals_in_a_known_order() -> None:
    # lights at 30 degrees around the viewer, the sphere within 0.9 of its radius, started at the truth
    normals, mask = sphere(96)
    lights = around(30)
    order = {
        10: ["lyon:dot:8:minimax", "lyon:dot:8", "lyon:dot:32:minimax", "gaussian:dot", "none", "schlick"],
        50: ["lyon:dot:32:minimax", "gaussian:dot", "lyon:dot:8:minimax", "lyon:dot:8", "none", "schlick"],
        200: ["gaussian:dot", "lyon:dot:32:minimax", "lyon:dot:8:minimax", "lyon:dot:8", "none", "schlick"],
    }
    for alpha, names in order.items():
        drawn, errors = pictures(lights, alpha, normals), {}
        for name in names:
            model = SurfaceModel(
                0.0, KD, 0.0 if name == "none" else KS, alpha, Formula.parse(name.replace("none", "phong"))
            )
            found = invert_pictures(drawn, lights, model, mask=mask, start=normals)
            errors[name] = degrees(found.normals, normals)[mask]
        means = [float(np.nanmean(errors[name])) for name in names]
        assert means == sorted(means), (alpha, means)
        if alpha >= 50:  # a support that ends leaves most normals as they are, a tail bends nearly all
            assert np.nanmedian(errors["lyon:dot:8"]) < 1e-6 < 1e-2 < np.nanmedian(errors["schlick"])


def test_factors_of_both_terms_are_found() -> None:
    normals, mask = sphere(24)
    lights = around(25, 6)
    patches = np.where(np.arange(24) % 2, 0.5, 1.2)[None, :] * np.ones((24, 1))
    drawn = pictures(lights, 20, normals) * patches + 0.1
    model = SurfaceModel(0.1, KD, KS, 20)
    found = invert_pictures(drawn, lights, model, mask=mask, albedo=True, gloss=True)
    known = np.isfinite(found.normals[..., 0]) & mask
    good = known & (found.residual < 1e-9)
    assert good.sum() > 0.9 * mask.sum()
    assert np.nanmax(degrees(found.normals, normals)[good]) < 0.01
    np.testing.assert_allclose(found.diffuse[good], patches[good], atol=1e-4)
    matt = invert_pictures(drawn / 1.0, lights, SurfaceModel(0.1, KD, 0.0), mask=mask, albedo=True)
    assert np.nanmean(degrees(matt.normals, normals)[mask]) > 0.1


def test_the_answer_does_not_depend_on_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("phongbench.inverse.photometric.TILE", 100)
    normals, mask = sphere()
    lights = around(40)
    drawn = pictures(lights, 50, normals)
    one, three = (
        invert_pictures(drawn, lights, SurfaceModel(0, KD, KS), mask=mask, threads=threads) for threads in (1, 3)
    )
    for name in ("normals", "residual", "steps"):
        np.testing.assert_array_equal(getattr(one, name), getattr(three, name))


def test_shadows_and_saturation_are_left_out_and_too_few_samples_give_no_normal() -> None:
    normals, _ = sphere()
    lights = around(60)
    drawn = pictures(lights, 50, normals)
    found = invert_pictures(drawn, lights, SurfaceModel(0, KD, KS))
    lit = (drawn > 0.01 * KD).sum(axis=0)
    assert (np.isnan(found.normals[..., 0]) == (lit < 3)).all()
    spoilt = np.where(drawn > 0.9, 5.0, drawn)
    used = invert_pictures(spoilt, lights, SurfaceModel(0, KD, KS), saturation=1.0)
    both = np.isfinite(used.normals[..., 0])
    assert 0 < both.sum() < np.isfinite(found.normals[..., 0]).sum()
    # of three samples on a highlight's flank a local minimum may be left
    assert (degrees(used.normals, normals)[both] < 0.01).mean() > 0.99
    assert used.summary()["known"] == both.sum()
    nothing = invert_pictures(np.zeros((4, 2, 2)), lights, SurfaceModel())
    assert nothing.summary() == {"pixels": 4, "known": 0, "residual_rms": None, "steps_mean": None}


def test_one_light_turns_the_normal_around_itself_only() -> None:
    # one equation leaves a cone around the light: of its normals, the one nearest to where the search starts
    light = around(30, 1)
    truth = np.array([[[0.0, 0.0, 1.0]]])
    angle = math.degrees(math.acos(light[0].direction[2]))
    cosine = math.cos(math.radians(angle + 5))
    found = invert_pictures(np.full((1, 1, 1), KD * cosine), light, SurfaceModel(0, KD, 0), start=truth)
    assert degrees(found.normals, truth)[0, 0] == pytest.approx(5.0, abs=1e-6)
    assert float(found.normals[0, 0] @ light[0].direction) == pytest.approx(cosine, abs=1e-9)


@pytest.mark.skipif(jit.DISABLED, reason="it compares compiled code with the plain bodies")
def test_steps_are_those_of_independent_derivatives() -> None:
    normal, lights = np.array([0.3, -0.2, 0.0]), around(35, 5)
    normal[2] = math.sqrt(1 - normal @ normal)
    rows, observed = solver_rows(lights), np.zeros(5)
    model = np.array([0.05, KD, KS, 0.0, 0.0, 1.0, 1.0, 9.0, 1e-9])

    def terms(state: Array) -> tuple[Array, Array]:
        facing = rows[:, :3] @ state[:3]
        mirrored = np.maximum(2 * facing * state[2] - rows[:, 2], 0) ** 30
        return model[0] + KD * state[3] * facing + KS * state[4] * mirrored, mirrored

    state = np.array([*normal, 1.1, 0.9])
    room = np.zeros((4, 10))
    room[2, ::2] = terms(state)[1]
    before = np.maximum(2 * (rows[:, :3] @ normal) * normal[2] - rows[:, 2] - 1e-7, 0) ** 30
    room[2, 1::2] = before
    equations = np.zeros((5, 4))
    total = solver._equations(observed, np.ones(5, np.uint8), rows, state, model, room, equations)
    assert total == pytest.approx(float((terms(state)[0] ** 2).sum()), rel=1e-12)
    jacobian = np.zeros((5, 4))
    for k in range(4):
        for sign in (-1, 1):
            moved = np.zeros(5)
            step = np.zeros(4)
            step[k] = sign * 1e-5
            solver._moved(state, step, moved)
            jacobian[:, k] += sign * terms(moved)[0] / 2e-5
    np.testing.assert_allclose(np.tril(equations[:4]), np.tril(jacobian.T @ jacobian), rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(equations[4], jacobian.T @ (observed - terms(state)[0]), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize(
    ("change", "where", "what"),
    [
        ({"pictures": np.ones((2, 2, 2)), "count": 2}, "pictures", "2 pictures"),
        ({"pictures": np.ones((4, 2))}, "pictures", "shape"),
        ({"pictures": np.ones((3, 2, 2))}, "lights", "4 lights for 3 pictures"),
        ({"pictures": np.where(np.arange(16).reshape(4, 2, 2) == 10, np.nan, 1.0)}, "pictures[2]", "column 0 of row 1"),
        ({"pictures": [[["a"]]]}, "pictures", "no pictures"),
        ({"mask": np.ones((3, 3))}, "mask", "a mask of shape"),
        ({"lights": [(0.1, 0, 1), (0.1, 0, 1), (0, 1, 1)]}, "lights[1]", "lights 0 and 1 are parallel"),
        ({"lights": [(-0.5, 0, 1), (0, 0, 1), (0.5, 0, 1)]}, "lights", "plane"),
    ],
)
def test_wrong_input_names_its_place(change: dict[str, object], where: str, what: str) -> None:
    given = change.get("lights")
    lights = around(30, int(change.get("count", 4)))  # type: ignore[call-overload]
    if given is not None:
        lights = [PhotometricLight.of(v) for v in given]  # type: ignore[attr-defined]
    drawn = change.get("pictures", np.ones((len(lights), 2, 2)))
    with pytest.raises(InputError, match=what.replace("[", "\\[")) as problem:
        invert_pictures(drawn, lights, SurfaceModel(), mask=change.get("mask"))  # type: ignore[arg-type]
    assert str(problem.value.where).startswith(where)


def test_models_and_lights_that_cannot_be_are_refused() -> None:
    for towards in ((0, 0, 0), (0, 0, -1), (1, math.nan, 0), "abc"):
        with pytest.raises(InputError):
            PhotometricLight.of(towards)
    for strength in (0, -1, math.inf):
        with pytest.raises(InputError):
            PhotometricLight.of((0, 0, 1), strength)
    for wrong in (
        {"diffuse": 0},
        {"specular": -1},
        {"alpha": 1e9},
        {"formula": Formula.parse("lyon:cross:8@lengthwise")},
    ):
        with pytest.raises(InputError):
            SurfaceModel(**wrong)  # type: ignore[arg-type]


def test_random_pictures_never_crash() -> None:
    rng = np.random.default_rng(5)
    for seed in range(40):
        count = int(rng.integers(3, 6))
        lights = [PhotometricLight.of((*rng.normal(size=2), abs(rng.normal()) + 0.01)) for _ in range(count)]
        drawn = rng.choice([0.0, 0.5, 1e-300, 1e6], (count, 5, 5)) * rng.uniform(0, 2, (count, 5, 5))
        model = SurfaceModel(
            float(rng.choice([0, 0.1])), 0.7, float(rng.choice([0, 0.5, 100])), float(rng.choice([0.1, 50, 1e5]))
        )
        found = invert_pictures(drawn, lights, model, albedo=bool(seed % 2), gloss=bool(seed % 3 == 0))
        known = np.isfinite(found.normals[..., 0])
        np.testing.assert_allclose(np.linalg.norm(found.normals[known], axis=1), 1.0, atol=1e-12)
        assert (found.steps[known] >= 1).all()
