"""Small scenes, written as a user writes them."""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from phongbench.scenes.scene import Scene
from phongbench.scenes.scene_files import read_scene

#: a scene that each test changes: what it says about `camera` and so on stands in tables of that name
SMALL = """
ambient_light = [0.2, 0.2, 0.2]
background = [0.1, 0.2, 0.3]

[picture]
size = [48, 32]
depth = 2

[camera]
position = [0.0, 1.0, 5.0]
target = [0.0, 0.5, 0.0]

[materials.white]
diffuse = [0.8, 0.8, 0.8]
specular = [0.5, 0.5, 0.5]
shininess = 20

[materials.mirror]
diffuse = [0.1, 0.1, 0.2]
specular = [0.9, 0.9, 0.9]
shininess = 100
reflectivity = 0.6

[materials.board]
chequerboard = ["white", "mirror"]
side = 0.5

[[lights]]
direction = [-1.0, 2.0, 1.0]

[[lights]]
position = [1.0, 2.0, 2.0]
colour = [1.0, 0.5, 0.2]
attenuation = [0.5, 0.2, 0.1]
reach = 20

[[objects]]
shape = "sphere"
centre = [0.0, 0.8, 0.0]
radius = 0.8
material = "mirror"

[[objects]]
shape = "plane"
material = "board"
"""


@pytest.fixture
def small() -> str:
    """The text of a scene with a mirror ball over a chequerboard."""
    return SMALL


@pytest.fixture
def written(tmp_path: Path) -> Callable[[str], Scene]:
    """Reads a scene from a text, by way of a file named scene.toml."""

    def read(text: str) -> Scene:
        path = tmp_path / "scene.toml"
        path.write_text(text)
        return read_scene(path)

    return read


@pytest.fixture
def own(tmp_path: Path) -> Callable[..., Path]:
    """A user's file with Lyon's formula under another name, by (name, and what of its text is replaced by what)."""
    ours = Path(sys.modules["phongbench.formulas.approximations.lyon"].__file__ or "").read_text()

    def write(name: str, old: str = "", new: str = "") -> Path:
        assert old in ours
        path = tmp_path / f"{name}.py"
        path.write_text(ours.replace('name="lyon"', f'name="{name}"').replace(old, new, 1 if old else 0))
        return path

    return write
