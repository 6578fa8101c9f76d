"""Pictures by formulas that remove lengths: unit normals look the same, and short ones no longer turn highlights."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from phongbench.compiler import jit
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.inputs import meshes
from phongbench.scenes.render import render
from phongbench.scenes.requests import render_request
from phongbench.scenes.scene import Camera, Mesh, Picture, Scene, Sphere, SurfaceMaterial
from phongbench.scenes.skips import SceneSkips
from phongbench.shading.lighting import Light, Material

pytestmark = pytest.mark.skipif(jit.DISABLED, reason="thousands of rays, in plain Python")

MIRROR = SurfaceMaterial("mirror", Material(specular=(1.0, 1.0, 1.0), shininess=30.0), 0.3)
BALL = meshes.icosphere(40.0)
CAMERA = Camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0))
LIGHTS = (Light(position=(1.0, 1.0, 3.0)), Light(direction=(-1.0, 0.5, 1.0)))


def scene(*objects: Any) -> Scene:
    return Scene("s", CAMERA, (MIRROR,), objects, LIGHTS, picture=Picture((64, 64), 1))


def ball(*, unit: bool) -> Mesh:
    """Some eighty triangles, whose interpolated normals are up to 6 % short."""
    faces = BALL.faces.astype(np.int32)
    return Mesh(np.array(BALL.vertices), faces, BALL.normals, np.zeros(len(faces), np.int32), unit=unit)


def picture(shown: Scene, spelling: str, **more: Any) -> Any:
    return render(shown, specular=Formula.parse(spelling), threads=1, **more).picture


@pytest.mark.parametrize("spelling", ["phong/once", "phong/squared", "phong@lengthwise/each", "lyon:cross:8/once"])
def test_a_sphere_looks_the_same(spelling: str) -> None:
    shown, plain = (
        scene(Sphere((0.0, 0.0, 0.0), 1.0, 0)),
        replace(Formula.parse(spelling), recipe="pair", normalise="none"),
    )
    found = picture(shown, spelling)
    np.testing.assert_allclose(found, picture(shown, str(plain)), atol=2e-4)
    assert found.max() > 0.6
    exact, none = (picture(shown, spelling, skips=skips) for skips in (SceneSkips.exact(), SceneSkips.none()))
    assert exact.tobytes() == none.tobytes()


def test_short_normals_turn_no_highlight_where_the_recipe_removes_lengths() -> None:
    short, whole = scene(ball(unit=False)), scene(ball(unit=True))
    right = picture(whole, "phong")
    off = {
        name: float(np.abs(picture(short, name) - right).max())
        for name in ("phong", "phong/once", "phong@lengthwise/once")
    }
    assert off["phong@lengthwise/once"] < 2e-4
    assert off["phong"] > 0.05
    assert off["phong/once"] > 0.01


def test_the_ledger_has_a_line_for_what_was_not_made_unit() -> None:
    lines = {line.name: line for line in render(scene(ball(unit=False)), specular=Formula.parse("phong/once")).ledger}
    assert lines["vectors_not_normalised"].skipped > 0
    assert lines["vectors_not_normalised"].kind == "exact"
    plain = {line.name: line for line in render(scene(ball(unit=False))).ledger}
    assert plain["vectors_not_normalised"].skipped == 0


def test_a_request_takes_them_and_names_the_field_where_they_do_not_fit() -> None:
    request = render_request({"scene": "chequerboard", "size": [16, 9], "specular": "lyon:cross:8@lengthwise/once"})
    assert str(request.specular) == "lyon:cross:8@lengthwise/once"
    parts = {"approximation": "phong", "recipe": "lengthwise", "normalise": "once"}
    assert str(render_request({"scene": "chequerboard", "specular": parts}).specular) == "phong@lengthwise/once"
    with pytest.raises(InputError) as problem:
        render_request({"scene": "chequerboard", "specular": "phong@reflect", "model": "blinn-phong"})
    assert problem.value.where == "specular"
    with pytest.raises(InputError, match="unknown normalise"):
        render_request({"scene": "chequerboard", "specular": {"approximation": "phong", "normalise": "never"}})
