"""A scene file says what it means or is refused with file, line and key."""

import json
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from phongbench.errors import InputError
from phongbench.inputs.optical_constants import EXACT, in_terms_of
from phongbench.scenes.scene import Mesh, Plane, Scene, Sphere
from phongbench.scenes.scene_files import examples, read_scene, scene_of
from phongbench.support.document_paths import line_of
from phongbench.support.documents import Table

Written = Callable[[str], Scene]

MESH = """
[[objects]]
shape = "mesh"
surface = "icosphere"
degrees = 40
material = "white"
translate = [3.0, 1.0, 0.0]
"""


@pytest.mark.parametrize("name", examples())
def test_every_shipped_scene_can_be_read(name: str) -> None:
    scene = read_scene(name)
    assert scene.objects
    assert scene.lights
    assert scene.name == name


def test_what_a_scene_says_is_what_it_holds(small: str, written: Written) -> None:
    scene = written(small)
    assert scene.picture.size == (48, 32)
    assert [m.name for m in scene.materials] == ["white", "mirror"]
    sphere, plane = scene.objects
    assert isinstance(sphere, Sphere)
    assert (sphere.centre, sphere.radius, sphere.material) == ((0.0, 0.8, 0.0), 0.8, 1)
    assert isinstance(plane, Plane)
    assert plane.pattern is not None
    assert (plane.pattern.even, plane.pattern.odd, plane.pattern.side) == (0, 1, 0.5)
    assert scene.lights[1].reach == 20
    assert np.linalg.norm(scene.lights[0].direction or ()) == pytest.approx(1)


def test_copper_and_glass_are_what_was_measured() -> None:
    """The shipped scene's numbers are those of the optical constants, to its four digits."""
    scene = read_scene("copper-and-glass")
    assert len(scene.materials) == 8
    for material in scene.materials:
        name, _, kind = material.name.partition("-")
        exact = EXACT[name]
        found, expected = material.reflection.fresnel, in_terms_of(exact, exact.kind if kind == "exact" else kind)
        assert found is not None
        assert found.kind == expected.kind
        for field in ("f0", "f82", "n", "k"):
            assert getattr(found, field) == pytest.approx(getattr(expected, field), abs=5.1e-5)


def test_a_lights_ambient_is_multiplied_by_its_intensity(small: str, written: Written) -> None:
    scene = written(small.replace("[[lights]]", "[[lights]]\nambient = [0.5, 0.25, 0.0]\nintensity = 2", 1))
    assert scene.lights[0].ambient == (1.0, 0.5, 0.0)


def test_json_says_the_same_as_toml(small: str, written: Written, tmp_path: Path) -> None:
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(tomllib.loads(small)))
    one, two = written(small), read_scene(path)
    for field in ("camera", "materials", "objects", "lights", "ambient_light", "background", "picture"):
        assert getattr(one, field) == getattr(two, field)


# what is replaced in the small scene, by what, the line that is to blame (relative to the replaced text), and a word of
# the message
WRONG = [
    ("radius = 0.8", "radus = 0.8", -3, "radius is missing\ndid you mean it by radus?"),
    ("radius = 0.8", "radius = 0.8\ncolour = 3", 1, "colour"),
    ("radius = 0.8", "radius = -1", 0, "outside"),
    ("radius = 0.8", "radius = nan", 0, "outside"),
    ("radius = 0.8", 'radius = "big"', 0, "not a number"),
    ('material = "mirror"', 'material = "chrome"', 0, "unknown material"),
    ('shape = "sphere"', 'shape = "teapot"', 0, "unknown shape"),
    ('["white", "mirror"]', '["white", "black"]', 0, "unknown material"),
    ('["white", "mirror"]', '["white"]', 0, "two materials"),
    ("shininess = 20", "shininess = 1e9", 0, "outside"),
    ("reflectivity = 0.6", "reflectivity = 1.5", 0, "outside"),
    ("reflectivity = 0.6", 'approximation = "lyon:dot:8:9:9"', 0, "more parts than lyon takes"),
    ("size = [48, 32]", "size = [100000, 100000]", 0, "pixels"),
    ("size = [48, 32]", "size = [48]", 0, "list of 2"),
    ("depth = 2", "depth = 1000", 0, "whole number"),
    ("depth = 2", "deep = 2", 0, "unknown key 'deep'"),
    ("target = [0.0, 0.5, 0.0]", "target = [0.0, 1.0, 5.0]", 0, "itself"),
    ("target = [0.0, 0.5, 0.0]", "target = [0.0, 0.0, 5.0]", 0, "along up"),
    ("position = [0.0, 1.0, 5.0]", "position = [0.0, 0.8, 0.5]", 0, "inside or on the sphere objects[0]"),
    ("position = [0.0, 1.0, 5.0]", "position = [0.0, 0.0, 5.0]", 0, "lies on the plane objects[1]"),
    ("direction = [-1.0, 2.0, 1.0]", "direction = [0, 0, 0]", 0, "no direction"),
    ("direction = [-1.0, 2.0, 1.0]", "colour = [1, 1, 1]", -1, "either a direction or a position"),
    ("direction = [-1.0, 2.0, 1.0]", "direction = [1, 1, 1]\nreach = 4", 1, "has no reach"),
    ("attenuation = [0.5, 0.2, 0.1]", "attenuation = [0, 0, 0]", 0, "attenuation"),
    ("background = [0.1, 0.2, 0.3]", "backdrop = [0.1, 0.2, 0.3]", 0, "unknown key 'backdrop'"),
    ("background = [0.1, 0.2, 0.3]", "background = = 3", 0, "not valid TOML"),
    ("radius = 0.8", f"radius = {'9' * 5000}", 0, "thousands of digits"),
    ("radius = 0.8", '"a.b" = 1\nradius = 0.8', 0, 'objects[0]."a.b"'),
    ("radius = 0.8", '"a b\\n" = 1\nradius = 0.8', 0, r'objects[0]."a b\n"'),
    ("shininess = 20", "shininess = 1e-9", 0, "alpha"),
    ("shininess = 20", 'shininess = 20\napproximation = "lion:dot:8"', 1, "did you mean 'lyon'"),
    ("shininess = 20", 'shininess = 20\napproximation = "lyon:dot"', 1, "lyon needs a gamma"),
    ("shininess = 20", 'shininess = 20.5\napproximation = "integer-power"', 0, "does not take"),
    ("shininess = 20", "shininess = 20\napproximation = 8", 1, "approximation: approximation = 8 is not a string"),
    ("position = [1.0, 2.0, 2.0]", "position = [inf, 2.0, 2.0]", 0, "lights[1].position[0]: position[0] = Infinity"),
    ("shininess = 20", 'shininess = 20\nfresnel = { kind = "glass" }', 1, "unknown kind 'glass'"),
    ("shininess = 20", 'shininess = 20\nfresnel = { kind = "conductor", n = [1, 1, 1] }', 1, "needs k"),
    ("shininess = 20", 'shininess = 20\nfresnel = { kind = "dielectric", n = [1, -1, 1] }', 1, "-1 is outside"),
    ("shininess = 20", 'shininess = 20\nfresnel = { kind = "dielectric", n = [1, nan, 1] }', 1, "finite"),
    ("reach = 20", "reach = 20\nambient = [0, 0, 2]", 1, "outside"),
    ("size = [48, 32]", "size = [48.5, 32]", 0, "two whole numbers"),
    ("size = [48, 32]", "size = [-48, 32]", 0, "outside"),
]


@pytest.mark.parametrize(("old", "new", "shift", "words"), WRONG)
def test_what_cannot_be_is_refused_with_its_line(
    small: str, written: Written, old: str, new: str, shift: int, words: str
) -> None:
    assert old in small
    at = small.splitlines().index(next(line for line in small.splitlines() if old in line)) + 1 + shift
    with pytest.raises(InputError) as refused:
        written(small.replace(old, new, 1))
    assert words in str(refused.value)
    assert str(refused.value.where).split(": ")[0].endswith(f"scene.toml:{at}")


def test_a_scene_without_objects_is_refused(small: str, written: Written) -> None:
    with pytest.raises(InputError, match="needs an object"):
        written(small.split("[[objects]]", maxsplit=1)[0])


MESH_WRONG = [
    ('surface = "icosphere"', 'file = "absent.obj"', "cannot read the mesh"),
    ('surface = "icosphere"', 'surface = "teapot"', "unknown surface"),
    ("degrees = 40", "degrees = 0.001", "outside"),
    ("degrees = 40", "scale = 0", "singular"),
    ("degrees = 40", "scale = [1, 1, 0]", "singular"),
    ("degrees = 40", "matrix = [[1, 0, 0, 0], [2, 0, 0, 0], [0, 0, 1, 0]]", "singular"),
    ("degrees = 40", "matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1]]", "last row"),
    ("degrees = 40", "matrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]", ".matrix[0]: matrix[0] = [1, 0, 0] is not"),
    ("degrees = 40", "matrix = [[1, 0, 0, 0], [0, nan, 0, 0], [0, 0, 1, 0]]", ".matrix[1][1]: matrix[1][1] = NaN"),
    ('surface = "icosphere"', 'file = "a\\u0000b"', "no file has such a name"),
    ('surface = "icosphere"', 'file = "."', "Is a directory"),
    ("degrees = 40", 'smooth = "very"', "unknown smooth"),
    ('material = "white"', 'material = "board"', "only a plane"),
    ("translate = [3.0, 1.0, 0.0]", "translate = [0.0, 1.0, 5.2]", "inside or on the mesh objects[2]"),
]


@pytest.mark.parametrize(("old", "new", "words"), MESH_WRONG)
def test_what_is_no_mesh_is_refused(small: str, written: Written, old: str, new: str, words: str) -> None:
    assert old in MESH
    with pytest.raises(InputError) as refused:
        written(small + MESH.replace(old, new, 1))
    assert words in str(refused.value)
    assert "scene.toml" in str(refused.value.where)


@pytest.mark.parametrize("ends", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_a_file_as_windows_writes_it_is_read(small: str, tmp_path: Path, ends: str, mark: str) -> None:
    path = tmp_path / "żółć ☃.toml"
    text = mark + small.replace("\n", ends)
    path.write_bytes(text.replace('"white"', '"weiß ☃"').replace("materials.white", 'materials."weiß ☃"').encode())
    scene = read_scene(path)
    assert (scene.name, scene.materials[0].name) == ("żółć ☃", "weiß ☃")
    path.write_bytes(text.replace("radius = 0.8", "radius = -1").encode())
    line = small.splitlines().index("radius = 0.8") + 1
    with pytest.raises(InputError, match=f":{line}: .*radius = -1"):
        read_scene(path)


GARBAGE = {
    "bytes": (b"a = 1\nb = \xff", "2: cannot read the scene: not UTF-8"),
    "utf-16": ("a = 1".encode("utf-16"), "1: cannot read the scene: not UTF-8"),
    "nul": (b"a = 1\n\0", "2: not valid TOML"),
    "deep": (b"a = " + b"[" * 9999, "too deep to read"),
    "nothing": (b"", "a scene needs an object"),
}


@pytest.mark.parametrize("kind", GARBAGE)
def test_what_is_no_text_is_refused_by_its_line(tmp_path: Path, kind: str) -> None:
    data, words = GARBAGE[kind]
    path = tmp_path / "scene.toml"
    path.write_bytes(data)
    with pytest.raises(InputError) as refused:
        read_scene(path)
    assert words in str(refused.value)
    assert str(refused.value.where).startswith(str(path))


def test_names_that_could_move_a_cursor_are_quoted(small: str, written: Written) -> None:
    named = small.replace("materials.white", r'materials."\u001b[2J"').replace('"white"', r'"\u001b[2J"')
    for text in (named.replace("shininess = 20", "shininess = -20"), named.replace('= "mirror"', '= "chrome"')):
        with pytest.raises(InputError) as refused:
            written(text)
        assert "\x1b" not in str(refused.value)


def test_a_mesh_without_faces_is_refused(small: str, written: Written, tmp_path: Path) -> None:
    (tmp_path / "cloud.obj").write_text("v 0 0 0\nv 1 0 0\n")
    with pytest.raises(InputError, match="no faces"):
        written(small + MESH.replace('surface = "icosphere"', 'file = "cloud.obj"'))


def test_a_document_that_was_sent_names_no_files(small: str) -> None:
    data = tomllib.loads(small + MESH.replace('surface = "icosphere"', 'file = "secret.obj"'))
    with pytest.raises(InputError, match="cannot name files") as refused:
        scene_of(Table(data), "posted")
    assert refused.value.where == "objects[2].file"


def test_an_obj_wears_the_materials_of_its_mtl(small: str, written: Written, tmp_path: Path) -> None:
    (tmp_path / "two.mtl").write_text(
        "newmtl red\nKa 0.1 0 0\nKd 0.8 0.1 0.1\nKs 0.5 0.5 0.5\nNs 96.08\nnewmtl blue\nKd 0.123 0.1 0.8\n"
    )
    (tmp_path / "two.obj").write_text(
        "mtllib two.mtl\nv 2 0 0\nv 3 0 0\nv 3 1 0\nv 2 1 0\nv 2 0 1\nusemtl red\nf 1 2 3 4\nusemtl blue\nf 1 2 5\n"
    )
    scene = written(small + '[[objects]]\nshape = "mesh"\nfile = "two.obj"\n')
    mesh = scene.of(Mesh)[0]
    worn = {scene.materials[i].name: int((mesh.materials == i).sum()) for i in set(mesh.materials.tolist())}
    assert worn == {"red": 2, "blue": 1}
    red = next(m.reflection for m in scene.materials if m.name == "red")
    blue = next(m.reflection for m in scene.materials if m.name == "blue")
    assert (red.ambient, red.diffuse, red.specular, red.shininess) == ((0.1, 0, 0), (0.8, 0.1, 0.1), (0.5,) * 3, 96.08)
    assert blue.diffuse == (0.123, 0.1, 0.8)  # not through the 8 bits that trimesh keeps
    assert blue.specular == (0, 0, 0)


@pytest.mark.parametrize(
    ("uses", "defines", "words"),
    [
        ("usemtl blue\n", "newmtl red\nNs 10\n", "two.obj:5: the material 'blue' is not in the MTL file"),
        ("", "newmtl red\nNs 10\n", "some faces have no material"),
        ("usemtl red\n", "newmtl red\nKs 1 1 1\nNs 1e-9\n", "material 'red': alpha"),
        ("usemtl red\n", "newmtl red\nNs shiny\n", "two.mtl:2: Ns is 'shiny'"),
    ],
)
def test_a_material_that_an_obj_lacks_is_named(
    small: str, written: Written, tmp_path: Path, uses: str, defines: str, words: str
) -> None:
    (tmp_path / "two.mtl").write_text(defines)
    (tmp_path / "two.obj").write_text(f"mtllib two.mtl\nv 2 0 0\nv 3 0 0\nv 3 1 0\n{uses}f 1 2 3\n")
    with pytest.raises(InputError) as refused:
        written(small + '[[objects]]\nshape = "mesh"\nfile = "two.obj"\n')
    assert words in str(refused.value)
    assert "objects[2].file" in str(refused.value)


def test_a_material_of_an_mtl_may_have_blanks_in_its_name(small: str, written: Written, tmp_path: Path) -> None:
    (tmp_path / "two.mtl").write_text("newmtl my red\nKd 1 0 0\nNs 10\n")
    (tmp_path / "two.obj").write_text("mtllib two.mtl\nv 2 0 0\nv 3 0 0\nv 3 1 0\nusemtl my red\nf 1 2 3\n")
    scene = written(small + '[[objects]]\nshape = "mesh"\nfile = "two.obj"\n')
    assert scene.materials[scene.of(Mesh)[0].materials[0]].reflection.diffuse == (1, 0, 0)


def test_a_mesh_is_moved_as_its_transform_says(small: str, written: Written) -> None:
    moved = MESH + "scale = [2.0, 1.0, 0.5]\nrotate = [0.0, 0.0, 90.0]\n"
    mesh, plain = written(small + moved).of(Mesh)[0], written(small + MESH).of(Mesh)[0]
    local = plain.vertices - (3, 1, 0)
    expected = np.stack([-local[:, 1], 2 * local[:, 0], 0.5 * local[:, 2]], axis=1)
    assert np.allclose(mesh.vertices - (3, 1, 0), expected)
    # normals stay perpendicular to the ellipsoid: its gradient there
    gradient = (mesh.vertices - (3, 1, 0)) / np.array([1.0, 4.0, 0.25])
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    assert np.allclose(mesh.normals, gradient)


def test_lines_are_found_in_tables_and_lists_of_tables() -> None:
    text = "a = 1\n[t]\nb = 2\n[[l]]\nc = 3\n[[l]]\nd = 4\nc = 5\n[t.u]\ne = 6\n"
    found = {("a",): 1, ("t", "b"): 3, ("l", 0, "c"): 5, ("l", 1, "c"): 8, ("l", 1): 6, ("t", "u", "e"): 10}
    assert {steps: line_of(text, steps) for steps in found} == found
