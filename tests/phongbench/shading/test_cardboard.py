"""Shininess 0, as of cardboard: the specular colour wherever the mirrored light is in front, by every way to shade."""

from pathlib import Path

import numpy as np
import pytest

import phongbench as pb
from phongbench.errors import InputError

CARDBOARD = {"ambient": [0, 0, 0], "diffuse": [0, 0, 0], "specular": [0.5, 0.25, 0.125], "shininess": 0}
#: normals that turn away from light and viewer above: R.V = cos of twice the angle is positive up to 45 degrees
DEGREES = np.array([0.0, 20.0, 44.9, 45.1, 80.0, 120.0])
NORMALS = np.stack([np.sin(np.radians(DEGREES)), np.zeros(6), np.cos(np.radians(DEGREES))], axis=1)
LIGHTS = {"directional": {"direction": [0, 0, 1]}, "point": {"position": [0, 0, 1e6]}}


def shaded(formula: str, light: str = "directional", **more: object) -> np.ndarray:
    material, lights = CARDBOARD | more, [LIGHTS[light]]
    viewer = {"direction": [0, 0, 1]}
    return pb.shade(np.zeros((6, 3)), NORMALS, material=material, lights=lights, viewer=viewer, specular=formula)


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("specular", ["phong", "lyon:dot:8", "lyon:cross:2", "gaussian:difference", "schlick"])
def test_it_is_the_specular_colour_in_front_and_dark_behind(specular: str, light: str) -> None:
    expected = np.outer([1, 1, 1, 0, 0, 0], CARDBOARD["specular"])
    np.testing.assert_allclose(shaded(specular, light), expected, atol=1e-12)


def test_a_power_of_the_half_vector_shines_wherever_the_light_does() -> None:
    np.testing.assert_array_equal(shaded("blinn")[:, 0], [0.5, 0.5, 0.5, 0.5, 0.5, 0.0])


def test_what_is_no_constant_there_is_refused_by_its_field_with_the_reason() -> None:
    with pytest.raises(InputError, match="the slope minimax does not fall to 0") as problem:
        shaded("lyon:dot:8:minimax")
    assert problem.value.where == "material.shininess"
    assert "phong" in str(problem.value.fix)
    shaded("lyon:dot:8:minimax", specular=[0, 0, 0])  # without a highlight nothing is asked


SCENE = """
background = [0, 0, 0]
[camera]
position = [0, 0, 50]
target = [0, 0, 0]
field_of_view = 3
[[lights]]
direction = [0, 0, 1]
[materials.cardboard]
ambient = [0, 0, 0]
diffuse = [0, 0, 0]
specular = [0.5, 0.5, 0.5]
{line}
[[objects]]
shape = "sphere"
centre = [0, 0, 0]
radius = 1
material = "cardboard"
"""


def test_a_scene_takes_it_where_it_is_written_and_asks_where_it_is_left_out(tmp_path: Path) -> None:
    file = tmp_path / "cardboard.toml"
    file.write_text(SCENE.format(line="shininess = 0"))
    picture = pb.render(file, size=(64, 64)).array
    assert set(np.unique(picture).tolist()) == {0.0, 0.5}
    lit = (picture[..., 0] > 0).sum() / 64**2
    # R.V > 0 where the normal turns by less than 45 degrees: half of the sphere's disc
    assert lit == pytest.approx(0.5 * np.pi / (50 * 2 * np.tan(np.radians(1.5))) ** 2, rel=0.05)
    file.write_text(SCENE.format(line=""))
    with pytest.raises(InputError, match="a highlight needs a shininess"):
        pb.render(file, size=(8, 8))
