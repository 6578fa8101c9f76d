"""OBJ files: what is odd is refused with its line, or repaired and counted."""

import numpy as np
import pytest

from phongbench.errors import InputError
from phongbench.inputs import obj_files

CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\n"


@pytest.fixture
def obj(tmp_path):
    """A factory of OBJ files."""

    def write(text, name="some.obj"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_a_triangle_is_read_with_an_area_weighted_normal(obj):
    surface = obj_files.load(obj(CORNERS + "f 1 2 3\n"))
    assert surface.name == "some.obj"
    assert surface.vertices[surface.faces[0]].tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    np.testing.assert_allclose(surface.normals[surface.faces[0]], 3 * [(0, 0, 1)])
    assert surface.remarks == ("it has no normals: area-weighted ones are used",)
    assert surface.notes == ()
    assert surface.true_normals is None


def test_normals_of_the_file_are_made_unit_and_bad_ones_replaced(obj):
    text = CORNERS + "vn 0 0 2\nvn 0 0 0\nvn 3 0 4\nvn 1e200 0 0\nf 1//1 2//2 3//3\nf 2//4 4//1 3//3\n"
    surface = obj_files.load(obj(text))
    found = surface.normals[surface.faces].tolist()
    np.testing.assert_allclose(found[0], [(0, 0, 1), (0, 0, 1), (0.6, 0, 0.8)])
    np.testing.assert_allclose(found[1], [(1, 0, 0), (0, 0, 1), (0.6, 0, 0.8)])
    assert surface.notes == ("normals that are zero or not finite, replaced by area-weighted ones: 1",)
    assert surface.remarks == ()


def test_each_corner_without_a_normal_of_its_own_gets_one(obj):
    surface = obj_files.load(obj(CORNERS + "vn 1 0 0\nf 1//1 2//4 3//-2\n"))
    np.testing.assert_allclose(surface.normals[surface.faces[0]], [(1, 0, 0), (0, 0, 1), (0, 0, 1)])
    assert surface.notes == ("corners whose normal is not in the file get an area-weighted one: 2",)
    surface = obj_files.load(obj(CORNERS + "vn 1 0 0\nf 1//1 2//1 3//1\nf 2 4 3\n"))
    np.testing.assert_allclose(surface.normals[surface.faces].tolist(), [3 * [(1, 0, 0)], 3 * [(0, 0, 1)]])
    assert surface.remarks == ("corners without a normal get an area-weighted one: 3",)
    surface = obj_files.load(obj(CORNERS + "vn 1 0 0\nf 1 2 3\n"))
    assert surface.remarks == ("its faces name none of its normals: area-weighted ones are used",)


@pytest.mark.parametrize("odd", ["nan 0 0", "inf 0 0", "-1.#IND 0 0", "1.#QNAN00 0 0"])
def test_a_normal_that_is_no_number_is_replaced(obj, odd):
    surface = obj_files.load(obj(CORNERS + f"vn {odd}\nvn 1 0 0\nf 1//1 2//2 3//1\n"))
    np.testing.assert_allclose(surface.normals[surface.faces[0]], [(0, 0, 1), (1, 0, 0), (0, 0, 1)])
    assert surface.notes == ("normals that are zero or not finite, replaced by area-weighted ones: 1",)


@pytest.mark.parametrize(
    ("faces", "triangles", "polygons"),
    [("f 1 2 4 3\n", 2, 1), ("f 1 2 4 3 5\n", 3, 1), ("f 1 2 3\nf 1 2 4 3\nf 1/ 2/ 4/ 3/ 5/\n", 6, 2)],
)
def test_polygons_are_cut_into_triangles_and_counted(obj, faces, triangles, polygons):
    surface = obj_files.load(obj(CORNERS + faces))
    assert len(surface.faces) == triangles
    assert f"polygons cut into triangles: {polygons}" in surface.remarks


def test_degenerate_triangles_are_left_out_and_counted(obj):
    surface = obj_files.load(obj(CORNERS + "v 2 0 0\nf 1 2 3\nf 1 1 2\nf 1 2 6\n"))
    assert len(surface.faces) == 1
    assert surface.left_out == 2
    assert "degenerate triangles left out: 2" in surface.notes


def test_a_corner_that_is_repeated_is_dropped_while_three_are_left(obj):
    surface = obj_files.load(obj(CORNERS + "f 1 2 2 3\nf 1 1 2 2\n"))
    assert len(surface.faces) == 1
    assert surface.left_out == 2  # the two triangles of a line that is drawn to and fro


@pytest.mark.parametrize(
    "text",
    [
        CORNERS + "f -5 -4 -3\n",
        CORNERS.replace("\n", "\r\n") + "f 1 2 3\r\n",
        CORNERS + "f 1 \\\n 2 3 # the first\n",
        "mtllib absent.mtl\no one\n" + CORNERS + "vt 0 0\nusemtl red\n\t f  1/1 2/1 3/1\n",
        "\ufeff" + CORNERS + "s off\ng some\nf 1 2 3\nl 1 2\np 1\n",
        CORNERS + "f 1 2 3/\n",
        CORNERS + "f 1/ 2 3\n",
        CORNERS + "f 1// 2 3//\n",
    ],
)
def test_what_files_look_like_in_the_wild(obj, text):
    surface = obj_files.load(obj(text))
    assert surface.vertices[surface.faces].tolist() == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]


def test_several_objects_and_materials_make_one_surface(obj):
    text = CORNERS + "o one\nusemtl red\nf 1 2 3\nusemtl blue\nf 2 4 3\no two\nv 5 5 5\nv 6 5 5\nv 5 6 5\nf 6 7 8\n"
    surface = obj_files.load(obj(text))
    assert len(surface.faces) == 3
    np.testing.assert_allclose(surface.normals, len(surface.normals) * [(0, 0, 1)])


@pytest.mark.parametrize(
    ("text", "where", "what"),
    [
        ("", "", "no faces"),
        (CORNERS, "", "no faces"),
        ("v nan 0 0\nf 1 1 1\n", ":1", "three finite numbers"),
        ("v 0 0 0\nv 1e999 0 0\n", ":2", "three finite numbers"),
        ("v 0 0\n", ":1", "three finite numbers"),
        ("v a b c\n", ":1", "three finite numbers"),
        (CORNERS + "f 1 2 9\n", ":6", "1 to 5"),
        (CORNERS + "f 1 2 0\n", ":6", "1 to 5"),
        (CORNERS + "f 1 2\n", ":6", "three corners"),
        (CORNERS + "f one two three\n", ":6", "number of a vertex"),
        (CORNERS + "f -1 -2 -6\n", ":6", "backwards from -1"),
        ("v 0 0 0\nv 1 0 0\nf -1 -2 -3\nv 1 1 1\n", ":3", "backwards from -1"),
        ("v 0 0 \\\n0\nv 1 0\n", ":3", "three finite numbers"),
        ("v 1_0 0 0\n", ":1", "three finite numbers"),
        ("v 1-2 3\nv 0 0 0 x\n", ":1", "three finite numbers"),
        ("v 0 0 1.#INF\n", ":1", "three finite numbers"),
        (CORNERS + "vn 0 1\nf 1 2 3\n", ":6", "a normal is three"),
        (CORNERS + "f 1.0 2 3\n", ":6", "number of a vertex"),
        (CORNERS + "f 1/1/1/1 2 3\n", ":6", "number of a vertex"),
        (CORNERS + "f /1 2 3\n", ":6", "number of a vertex"),
        (CORNERS + "f 1 2 99999999999999999999999\n", ":6", "1 to 5"),
        (CORNERS + "f 1 1 2\n", "", "degenerate"),
        ("v 0 0 0\nv 1e200 0 0\nv 0 1e200 0\nf 1 2 3\n", "", "1e+200"),
        ("v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n", "", "largest coordinate is 0"),
    ],
)
def test_what_cannot_be_repaired_is_refused_with_its_place(obj, text, where, what):
    path = obj(text)
    with pytest.raises(InputError) as refused:
        obj_files.load(path)
    assert refused.value.where == f"{path}{where}"
    assert what in refused.value.what
    assert refused.value.fix


def test_files_that_are_none_are_refused(tmp_path, obj):
    binary = tmp_path / "binary.obj"
    binary.write_bytes(bytes(range(256)))
    for path, what in ((binary, "not a text file"), (tmp_path / "absent.obj", "No such file"), (tmp_path, "directory")):
        with pytest.raises(InputError, match=what):
            obj_files.load(path)


def test_a_file_is_read_again_only_when_it_changed(obj):
    path = obj(CORNERS + "f 1 2 3\n")
    first = obj_files.load(path)
    assert obj_files.load(path) is first
    obj(CORNERS + "f 1 2 3\nf 2 4 3\n")
    assert len(obj_files.load(path).faces) == 2


def test_indices_count_backwards_from_their_face(obj):
    block = "v {0} 0 0\nv {1} 0 0\nv {0} 1 0\nvn 0 0 {2}\nf -3//-1 -2//-1 -1//-1\n"
    surface = obj_files.load(obj(block.format(0, 1, 1) + block.format(5, 6, -1)))
    assert surface.vertices[surface.faces][:, 0].tolist() == [[0, 0, 0], [5, 0, 0]]
    assert surface.normals[surface.faces][:, 0].tolist() == [[0, 0, 1], [0, 0, -1]]


@pytest.mark.parametrize(
    ("text", "notes"),
    [
        ("l 1 2\nf 1 2 3\nl 2 3\np 1\n", ["line 6: 'l' is ignored: lines are not drawn (2 lines)", "line 9: 'p' is"]),
        ("curv 0 1 1 2\nf 1 2 3\n", ["line 6: 'curv' is ignored: curves"]),
        ("hello world\nf 1 2 3\n", ["line 6: 'hello' is ignored: it is not understood"]),
        ("v 9 9 9 1 0 0\nf 1 2 3\n", ["line 6: vertex colours are not drawn"]),
        ("v 9 9 9 0.5\nf 1 2 3\n", ["line 6: weights of vertices"]),
        ("s off\nf 1 2 3\n", ["line 6: smoothing groups are ignored"]),
        ("s 1\nf 1 2 3\n", []),
        ("o a\ng b c\nvt 0 0\nusemtl red\n# x\nf 1 2 3\n", []),
    ],
)
def test_what_is_not_drawn_is_told_once_for_each_kind(obj, text, notes):
    told = obj_files.load(obj(CORNERS + text)).notes
    assert len(told) == len(notes)
    assert all(one.startswith(words) for one, words in zip(told, notes, strict=True))


def test_the_materials_of_faces_are_those_above_them(obj):
    text = "mtllib a.mtl b.mtl\nmtllib c d.mtl\n" + CORNERS
    read = obj_files.load_obj(
        obj(text + "f 1 2 3\nusemtl red # x\nf 1 2 4 3\nf 1 1 2\nusemtl\nf 1 2 5\nusemtl red # x\nf 1 2 3\n")
    )
    assert read.libraries == ("a.mtl b.mtl", "c d.mtl")
    assert read.materials == ((9, "red # x"),)
    assert read.worn.tolist() == [-1, 0, 0, -1, 0]
    assert read.bare == 8
    assert obj_files.load_obj(obj(text + "usemtl red\nf 1 2 3\nusemtl blue\nf 1 2 4\n")).bare is None
