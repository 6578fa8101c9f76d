"""What cannot be shaded is refused by its field or its first point, and work that nobody wants ends."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from shading_twin import ABOVE, GREY, Array, cloud, scene

from phongbench.compiler import jit
from phongbench.errors import CancelledError, InputError, UnknownNameError
from phongbench.inputs import mtl_files
from phongbench.shading.shade import Formula, Light, Material, Skips, Viewer, shade

pytestmark = pytest.mark.skipif(jit.DISABLED, reason="thousands of points, in plain Python")


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e30])
@pytest.mark.parametrize("name", ["points", "normals"])
@pytest.mark.parametrize("index", [0, 63, 700, 1299])
def test_the_first_point_that_cannot_be_shaded_is_named(bad: float, name: str, index: int) -> None:
    points, normals = cloud(1300, np.float32)
    {"points": points, "normals": normals}[name][index:, 1] = bad
    for threads in (1, 2):
        with pytest.raises(InputError, match=r"not finite|squares") as caught:
            shade(points, normals, **scene(), threads=threads)
        assert caught.value.where == f"{name}[{index}]"


def test_a_normal_without_length_is_refused_unless_taken_as_it_is() -> None:
    points, normals = cloud(1300)
    normals[[600, 900]] = 0
    with pytest.raises(InputError, match="without length") as caught:
        shade(np.ascontiguousarray(points.T), np.ascontiguousarray(normals.T), **scene(), columns=True)
    assert caught.value.where == "normals[600]"
    dark = shade(points, normals, **scene(), normalise=False).colours[600]
    np.testing.assert_array_equal(dark, GREY.ambient)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (Light, "direction"),
        (lambda: Light(direction=(0, 0, 1), position=(0, 0, 1)), "direction"),
        (lambda: Light(direction=(0, 0, 0)), "direction"),
        (lambda: Light(direction=(0, math.nan, 1)), "direction"),
        (lambda: Light(direction=(0, 1)), "direction"),
        (lambda: Light(position=(0, math.inf, 1)), "position"),
        (lambda: Light(position=(0, 0, 1), attenuation=(0, 0, 0)), "attenuation"),
        (lambda: Light(position=(0, 0, 1), attenuation=(1, -1, 0)), "attenuation"),
        (lambda: Light(direction=(0, 0, 1), attenuation=(1, 1, 0)), "attenuation"),
        (lambda: Light(direction=(0, 0, 1), reach=3), "reach"),
        (lambda: Light(position=(0, 0, 1), reach=-3), "reach"),
        (lambda: Light(direction=(0, 0, 1), diffuse=(1, 1, -1)), "diffuse"),
        (lambda: Light(direction=(0, 0, 1), specular="red"), "specular"),
        (Viewer, "direction"),
        (lambda: Material(shininess=math.inf), "shininess"),
        (lambda: Material(ambient=(1, 1)), "ambient"),
        (lambda: Skips(tail=2), "tail"),
    ],
)
def test_a_light_viewer_or_material_that_cannot_be_names_its_field(make: Any, field: str) -> None:
    with pytest.raises(InputError) as caught:
        make()
    assert caught.value.where == field


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"model": "gouraud"}, "model"),
        ({"specular": Formula("lyonn")}, "specular.approximation"),
        ({"specular": Formula("lyon", "dott", 8)}, "specular.lambda"),
        ({"specular": Formula("lyon", "dot")}, "specular.gamma"),
        ({"specular": Formula("lyon", "dot", 9)}, "specular.gamma"),
        ({"specular": Formula("lyon", "dot", 8, "steep")}, "specular.beta"),
        ({"specular": Formula(slope=3.0)}, "specular.beta"),
        ({"specular": Formula.of("blinn"), "model": "blinn-phong"}, "specular.approximation"),
        ({"specular": Formula("lyon", "dot", 8, "taylor", "eye")}, "specular.space"),
        ({"material": replace(GREY, shininess=5e-4)}, "material.shininess"),
        (
            {"material": replace(GREY, shininess=0.0), "specular": Formula("lyon", "dot", 8, "minimax")},
            "material.shininess",
        ),
        ({"ambient_light": (1, 1, -1)}, "ambient_light"),
        ({"lights": (ABOVE, Light(position=(1e200, 0, 0)))}, "lights[1].position"),
        ({"visible": np.ones((1, 10), bool)}, "visible"),
        ({"visible": np.ones((2, 10))}, "visible"),
        ({"threads": 0}, "threads"),
        ({"out": np.empty((9, 3))}, "out"),
    ],
)
def test_wrong_arguments_are_named(changes: dict[str, Any], where: str) -> None:
    points, normals = cloud(10)
    with pytest.raises(InputError) as caught:
        shade(points, normals, **scene(**changes))
    assert caught.value.where == where
    if "lyonn" in str(caught.value):
        assert isinstance(caught.value, UnknownNameError)


@pytest.mark.parametrize(
    ("points", "normals", "where"),
    [
        (np.zeros((4, 3), int), np.ones((4, 3)), "points"),
        (np.zeros((4, 3), ">f8"), np.ones((4, 3)), "points"),
        (np.zeros((3, 4)), np.ones((3, 4)), "points"),
        (np.zeros((4, 3)), np.ones((5, 3)), "normals"),
        (np.zeros((4, 3)), np.ones((4, 3), np.float32), "normals"),
    ],
)
def test_arrays_of_another_type_or_shape_are_refused(points: Array, normals: Array, where: str) -> None:
    with pytest.raises(InputError) as caught:
        shade(points, normals, **scene())
    assert caught.value.where == where


def test_without_a_highlight_any_shininess_will_do() -> None:
    points, normals = cloud(10)
    shade(points, normals, **scene(material=Material((0, 0, 0), (1, 1, 1), (0, 0, 0), 0.0)))
    matt = mtl_files.Material("matt", shininess=0.0, specular=(1.0, 1.0, 1.0))
    assert Material.of(matt).specular == (0, 0, 0)
    gold = next(m for m in mtl_files.OPENGL if m.name == "gold")
    assert Material.of(gold) == Material(gold.ambient, gold.diffuse, gold.specular, gold.shininess)


def test_work_that_nobody_wants_any_more_ends() -> None:
    points, normals = cloud(100_000, np.float32)
    asked: list[int] = []

    def gone() -> bool:
        asked.append(1)
        return len(asked) > 2

    for threads in (1, 2):
        asked.clear()
        with pytest.raises(CancelledError):
            shade(points, normals, **scene(lights=(ABOVE,) * 40), cancelled=gone, threads=threads)
        assert 3 <= len(asked) <= 4
