"""OBJ and MTL files as people have them: the picture that each gives, or the message, on every route."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from phongbench.cli.main import main

pytest.importorskip("embreex", reason="embreex (extra `scene`) is not installed")

SCENE = """
[picture]
size = [8, 8]
depth = 0
[camera]
position = [0.0, 0.0, 3.0]
target = [0.0, 0.0, 0.0]
[[lights]]
direction = [0.0, 0.0, 1.0]
[materials.white]
ambient = [0.0, 0.0, 0.0]
diffuse = [1.0, 1.0, 1.0]
[[objects]]
shape = "mesh"
file = "a.obj"
"""
COLOURS = {(0, 0, 0): ".", (1, 0, 0): "r", (0, 0, 1): "b", (1, 1, 1): "w", (0.5, 0.5, 0.5): "g"}
#: with a normal whose cosine is 0.6
COLOURS |= {(0.6, 0, 0): "R", (0, 0, 0.6): "B", (0.6, 0.6, 0.6): "W"}

#: a square of two halves, and its two materials
POINTS = "v -1 -1 0\nv 0 -1 0\nv 1 -1 0\nv -1 1 0\nv 0 1 0\nv 1 1 0\n"
LEFT, RIGHT = "f 1 2 5 4\n", "f 2 3 6 5\n"
OBJ = f"mtllib a.mtl\n{POINTS}usemtl red\n{LEFT}usemtl blue\n{RIGHT}"
RED, BLUE = "newmtl red\nKa 0 0 0\nKd 1 0 0\n", "newmtl blue\nKa 0 0 0\nKd 0 0 1\n"
MTL = RED + BLUE
NORMAL = "vn 0 0 1\n"

IGNORED = ("d", "Tr", "illum", "Ni", "Ke", "Pr", "map_Kd", "bump")
Files = dict[str, str | bytes]


def obj(text: str | bytes) -> Files:
    """An OBJ beside the two materials."""
    return {"a.obj": text, "a.mtl": MTL}


def mtl(text: str | bytes, **more: str) -> Files:
    """An MTL beside the square."""
    return {"a.obj": OBJ, "a.mtl": text, **{f"{name}.mtl": other for name, other in more.items()}}


def replaced(*pairs: str) -> Files:
    """The square, in whose OBJ texts are replaced: what is there, by what, and so on."""
    text = OBJ
    for old, new in zip(pairs[::2], pairs[1::2], strict=True):
        assert old in text
        text = text.replace(old, new)
    return obj(text)


def both(*pairs: str) -> Files:
    """The square and its materials, in both of which texts are replaced."""
    one, two = OBJ, MTL
    for old, new in zip(pairs[::2], pairs[1::2], strict=True):
        one, two = one.replace(old, new), two.replace(old, new)
    return {"a.obj": one, "a.mtl": two}


def draw(folder: Path, files: Files, *, material: str | None = None) -> Result:
    """What `phongbench render` does with the scene of an OBJ."""
    for name, text in files.items():
        (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    scene = SCENE + (f'material = "{material}"\n' if material else "")
    (folder / "scene.toml").write_text(scene, encoding="utf-8")
    return CliRunner().invoke(main, ["render", str(folder / "scene.toml"), "--out", str(folder / "o.npy"), "--json"])


def quarters(folder: Path) -> str:
    """The colours in the middle of the picture's quarters: above left and right, below left and right."""
    picture = np.load(folder / "o.npy").astype(float)
    return "".join(COLOURS[tuple(picture[y, x].round(3).tolist())] for y in (2, 5) for x in (2, 5))


# what files hold, the picture's four quarters, and the beginnings of the notes in the order of the files
DRAWN: dict[str, tuple[Files, str, tuple[str, ...]]] = {
    "as it is": (obj(OBJ), "rbrb", ()),
    "bytes of 0 at the end": ({"a.obj": OBJ + "\0\0\0", "a.mtl": MTL + "\0"}, "rbrb", ()),
    "tabs": (obj(OBJ.replace(" ", "\t")), "rbrb", ()),
    "many blanks": (obj(OBJ.replace(" ", "  \t ").replace("\n", "  \n")), "rbrb", ()),
    "indented": (obj("".join(f" \t{line}\n" for line in OBJ.splitlines())), "rbrb", ()),
    "CRLF": (both("\n", "\r\n"), "rbrb", ()),
    "CR": (both("\n", "\r"), "rbrb", ()),
    "no last line end": ({"a.obj": OBJ[:-1], "a.mtl": MTL[:-1]}, "rbrb", ()),
    "comments after everything": (both("\n", " # x\n"), "rbrb", ()),
    "comments between": (obj(OBJ.replace("\n", "\n# usemtl green\n \t#v 1 2 3\n\n")), "rbrb", ()),
    "a comment at a number": (replaced("v 1 1 0", "v 1 1 0#corner", "f 2 3 6 5", "f 2 3 6 5#1"), "rbrb", ()),
    "a comment that ends in a backslash": (replaced("usemtl red", "# C:\\models\\\nusemtl red"), "rbrb", ()),
    "continued lines": (obj(OBJ.replace(" 0\n", " \\\n0\n").replace("f 2 3", "f \\ \n 2 \\\n3")), "rbrb", ()),
    "a last line that is continued": (obj(OBJ + "\\"), "rbrb", ()),
    "indices from the end": (replaced(LEFT, "f -6 -5 -2 -3\n", RIGHT, "f -5 -4 -1 -2\n"), "rbrb", ()),
    "indices from the end, between vertices": (
        obj(
            "mtllib a.mtl\nv -1 -1 0\nv 0 -1 0\nv 0 1 0\nv -1 1 0\nusemtl red\nf -4 -3 -2 -1\n"
            "v 0 -1 0\nv 1 -1 0\nv 1 1 0\nv 0 1 0\nusemtl blue\nf -4 -3 -2 -1\n"
        ),
        "rbrb",
        (),
    ),
    "vertices after their faces": (obj(f"mtllib a.mtl\nusemtl red\n{LEFT}usemtl blue\n{RIGHT}{POINTS}"), "rbrb", ()),
    "the library last": (obj(OBJ.replace("mtllib a.mtl\n", "") + "mtllib a.mtl\n"), "rbrb", ()),
    "texture coordinates": (replaced(LEFT, "vt 0 0\nf 1/1 2/1 5/1 4/1\n", RIGHT, "f 2/ 3/ 6/ 5/\n"), "rbrb", ()),
    "normals": (replaced(LEFT, f"{NORMAL}f 1//1 2//1 5//1 4//1\n", RIGHT, "f 2/0/1 3//1 6/9/1 5//1\n"), "rbrb", ()),
    "normals of every part": (
        replaced(LEFT, "vn 0 0.8 0.6\nf 1//1 2//1 5//1 4//1\n", RIGHT, "o two\nf 2//1 3//1 6//1 5//1\n"),
        "RBRB",
        (),
    ),
    "normals for one part": (replaced(LEFT, f"{NORMAL}f 1//1 2//1 5//1 4//1\n"), "rbrb", ()),
    "a normal that is not there": (
        replaced(LEFT, f"{NORMAL}f 1//1 2//2 5//1 4//1\n"),
        "rbrb",
        ("a.obj: corners whose normal is not in the file",),
    ),
    "a normal without length": (
        replaced(LEFT, "vn 0 0 0\nf 1//1 2//1 5//1 4//1\n"),
        "rbrb",
        ("a.obj: normals that are zero",),
    ),
    "groups and objects": (replaced("usemtl blue", "o half\ng one two\nusemtl blue"), "rbrb", ()),
    "a material for each face": (replaced(RIGHT, f"{RIGHT}usemtl red\nf 1 4 5 2\n"), "rbrb", ()),
    "an unused material that is not there": (replaced("usemtl red", "usemtl (null)\nusemtl red"), "rbrb", ()),
    "names with blanks and #": (both("red", "my red #1", "blue", "a#b"), "rbrb", ()),
    "names that differ after # only": (both("red", "wall #1", "blue", "wall #2"), "rbrb", ()),
    "a name with a backslash": (both("red", "Matte\\red"), "rbrb", ()),
    "a byte order mark": ({"a.obj": "\ufeff" + OBJ, "a.mtl": "\ufeff" + MTL}, "rbrb", ()),
    "Latin-1 and UTF-8": (
        {"a.obj": OBJ.replace("red", "gr\u00fcn").encode("latin-1"), "a.mtl": MTL.replace("red", "gr\u00fcn")},
        "rbrb",
        (),
    ),
    "a comment in Latin-1 with the byte of a line end": (replaced("usemtl red", "# \x85 v\nusemtl red"), "rbrb", ()),
    "UTF-16": ({"a.obj": OBJ.encode("utf-16"), "a.mtl": MTL.encode("utf-16")}, "rbrb", ()),
    "UTF-16 without a mark": ({"a.obj": OBJ.encode("utf-16-le"), "a.mtl": MTL.encode("utf-16-be")}, "rbrb", ()),
    "several libraries": (
        {"a.obj": OBJ.replace("mtllib a.mtl", "mtllib a.mtl\nmtllib b.mtl"), "a.mtl": RED, "b.mtl": BLUE},
        "rbrb",
        (),
    ),
    "several libraries in a line": (
        {"a.obj": OBJ.replace("mtllib a.mtl", "mtllib a.mtl b.mtl"), "a.mtl": RED, "b.mtl": BLUE},
        "rbrb",
        (),
    ),
    "a library whose name has blanks and #": (
        {"a.obj": OBJ.replace("a.mtl", "my paint #1.mtl"), "my paint #1.mtl": MTL},
        "rbrb",
        (),
    ),
    "a library of another machine": (replaced("a.mtl", "C:\\Users\\me\\A.MTL"), "rbrb", ()),
    "a library that nobody needs": (
        replaced("mtllib a.mtl", "mtllib a.mtl\nmtllib b.mtl"),
        "rbrb",
        ("a.obj: the MTL file 'b.mtl' is not there",),
    ),
    "one number for a colour": (mtl(MTL.replace("Kd 1 0 0", "Kd 0.5 ")), "gbgb", ()),
    "colours above 1": (
        mtl(MTL.replace("Kd 1 0 0", "Kd 1.0001 0 0").replace("Kd 0 0 1", "Kd 0 0 20")),
        "rbrb",
        ("a.mtl: line 3: Kd above 1 counts as 1 (2 lines)",),
    ),
    "a definition twice": (mtl(MTL + RED), "rbrb", ()),
    "another definition": (
        mtl(MTL + RED.replace("1 0 0", "1 1 1")),
        "wbwb",
        ("a.mtl: line 7: the material 'red' is defined again, differently",),
    ),
    "Ks without Ns": (
        mtl(MTL.replace("Kd 1", "Ks 1 1 1\nKd 1")),
        "rbrb",
        ("a.mtl: line 1: a material whose Ks has no",),
    ),
    "an Ns of 0": (mtl(MTL.replace("Kd 1", "Ns 0\nKd 1")), "rbrb", ()),
    "an Ns above 1000": (mtl(MTL.replace("Kd 1", "Ns 2048\nKd 1")), "rbrb", ()),
    "what is not drawn": (
        mtl(MTL.replace("Kd", "d 1\nTr 0\nillum 2\nNi 1.45\nKe 0 0 0\nPr 0.5\nmap_Kd -s 1 1 1 a.png\nbump b.png\nKd")),
        "rbrb",
        tuple(
            f"a.mtl: line {n}: '{k}' is"
            for n, k in enumerate(["d", "Tr", "illum", "Ni", "Ke", "Pr", "map_Kd", "bump"], 3)
        ),
    ),
    "a concave face": (replaced(RIGHT, "", LEFT, "v -0.8 -0.2 0\nf 1 7 4 6 3\n"), "rrrr", ()),
    "a notch": (obj(f"mtllib a.mtl\n{POINTS}v 0.9 0 0\nusemtl red\nf 1 3 6 4 7\n"), ".r.r", ()),
    "an L of six corners": (obj(f"mtllib a.mtl\n{POINTS}v 0 0 0\nv 1 0 0\nusemtl red\nf 1 3 8 7 5 4\n"), "r.rr", ()),
    "corners on an edge": (replaced(LEFT, "f 1 2 3 6 5 4\n", RIGHT, ""), "rrrr", ()),
    "a corner twice": (replaced(LEFT, "f 1 2 5 5 4 1\n"), "rbrb", ()),
    "a face without area": (
        replaced(LEFT, f"{LEFT}f 1 2 3\nf 1 1 2\n"),
        "rbrb",
        ("a.obj: degenerate triangles left out: 2",),
    ),
    "a face that crosses itself": (
        replaced(LEFT, "f 1 5 2 4\n"),
        ".brb",
        ("a.obj: faces that cross themselves, cut as fans around a corner: 1",),
    ),
    "lines, points and curves": (
        replaced(RIGHT, f"{RIGHT}l 1 2 3\np 1\np 2\ncurv 0 1 1 2\n"),
        "rbrb",
        (
            "a.obj: line 12: 'l' is ignored",
            "a.obj: line 13: 'p' is ignored: points are not drawn (2 lines)",
            "a.obj: line 15: 'curv'",
        ),
    ),
    "vertex colours": (replaced("v 1 1 0\n", "v 1 1 0 0.5 0.5 0.5\n"), "rbrb", ("a.obj: line 7: vertex colours",)),
    "smoothing groups": (replaced("usemtl red", "s off\nusemtl red"), "rbrb", ("a.obj: line 8: smoothing groups",)),
    "a word that is no keyword": (replaced("usemtl red", "hello\nusemtl red"), "rbrb", ("a.obj: line 8: 'hello' is",)),
}

REFUSED: dict[str, tuple[Files, str]] = {
    "a nameless library": (replaced("mtllib a.mtl", "mtllib"), "a.obj: the OBJ file names no MTL file"),
    "no library": (replaced("mtllib a.mtl\n", ""), "a.obj: the OBJ file names no MTL file"),
    "a library that is not there": (replaced("a.mtl", "b.mtl"), "b.mtl: cannot read the MTL file"),
    "a material that is not there": (replaced("blue", "green"), "a.obj:10: the material 'green' is not in"),
    "a material of an absent library": (
        replaced("blue", "green", "a.mtl", "a.mtl b.mtl"),
        "the material 'green' is not in the MTL file; not there: b.mtl",
    ),
    "no material": (replaced("usemtl red\n", ""), "a.obj:8: some faces have no material"),
    "a nameless material": (replaced("usemtl red", "usemtl"), "a.obj:9: some faces have no material"),
    "a vertex that is not there": (replaced(RIGHT, "f 2 3 7\n"), "a.obj:11: a face names its vertices by 1 to 6"),
    "a vertex that is not above": (replaced(RIGHT, "f 2 3 -7\n"), "a.obj:11: a face names its vertices by 1 to 6"),
    "a face of two corners": (replaced(RIGHT, "f 2 3\n"), "a.obj:11: a face has three corners or more"),
    "a corner that is no number": (replaced(RIGHT, "f 2 3 x\n"), "a.obj:11: a corner is the number of a vertex"),
    "a vertex that is no number": (replaced("v 1 1 0", "v 1 1 nan"), "a.obj:7: a vertex is three finite numbers"),
    "a vertex with decimal commas": (replaced("v 1 1 0", "v 1,0 1,0 0,0"), "a.obj:7: a vertex is three finite numbers"),
    "a vertex of two numbers": (replaced("v 1 1 0", "v 1 1"), "a.obj:7: a vertex is three finite numbers"),
    "the line after a continued one": (replaced("v 1 -1 0", "v 1 \\\n-1 0", "v 1 1 0", "v 1 1"), "a.obj:8: a vertex"),
    "no faces": (replaced(LEFT, "", RIGHT, ""), "a.obj: the mesh has no faces"),
    "only faces without area": (replaced(LEFT, "f 1 1 2\n", RIGHT, ""), "a.obj: every triangle of the mesh is degen"),
    "bytes": (obj(bytes(range(256))), "a.obj: the mesh is not a text file"),
    "nothing": (obj(b""), "a.obj: the mesh has no faces"),
    "a colour that is no number": (mtl(RED.replace("Kd 1", "Kd x")), "a.mtl:3: Kd is 'x', not a number"),
    "a colour of two numbers": (mtl(RED.replace("Kd 1 0 0", "Kd 1 0")), "a.mtl:3: Kd takes one or three numbers"),
    "a colour below 0": (mtl(RED.replace("Kd 1", "Kd -1")), "a.mtl:3: Kd = -1 is outside 0 .. 1"),
    "an Ns below 0": (mtl(RED + "Ns -5\n"), "a.mtl:4: Ns = -5 is outside 0 .. 100000"),
    "a value of no material": (mtl("Kd 1 1 1\n" + RED), "a.mtl:1: Kd before the first newmtl"),
    "a library of bytes": (mtl(bytes(range(256))), "a.mtl: the MTL file is not a text file"),
}


@pytest.mark.parametrize("kind", DRAWN)
def test_a_file_gives_its_picture_and_tells_what_is_not_drawn(tmp_path: Path, kind: str) -> None:
    files, colours, notes = DRAWN[kind]
    done = draw(tmp_path, files)
    assert done.exit_code == 0, done.output
    assert quarters(tmp_path) == colours
    told = [note.removeprefix(f"{tmp_path}/") for note in json.loads(done.stdout)["notes"]]
    assert len(told) == len(notes), told
    assert all(note.startswith(words) for note, words in zip(told, notes, strict=True)), told
    assert done.stderr == ""


@pytest.mark.parametrize("kind", DRAWN)
def test_with_a_material_of_the_scene_the_same_is_covered(tmp_path: Path, kind: str) -> None:
    files, colours, notes = DRAWN[kind]
    done = draw(tmp_path, files, material="white")
    assert done.exit_code == 0, done.output
    assert quarters(tmp_path) == "".join("." if c == "." else "W" if c.isupper() else "w" for c in colours)
    assert len(json.loads(done.stdout)["notes"]) == sum("a.obj" in note and "MTL" not in note for note in notes)


@pytest.mark.parametrize("kind", REFUSED)
def test_what_cannot_be_drawn_is_refused_with_its_place(tmp_path: Path, kind: str) -> None:
    files, message = REFUSED[kind]
    done = draw(tmp_path, files)
    assert done.exit_code == 2, done.output
    assert f"{tmp_path}/{message}" in done.stderr if message[:2] in ("a.", "b.") else message in done.stderr
    assert len(done.stderr.splitlines()) <= 3


def test_people_read_notes_on_stderr(tmp_path: Path) -> None:
    files, _, notes = DRAWN["lines, points and curves"]
    draw(tmp_path, files)
    done = CliRunner().invoke(main, ["render", str(tmp_path / "scene.toml"), "--out", str(tmp_path / "o.npy")])
    lines = [line for line in done.stderr.splitlines() if not line.startswith(("prepare ", "render "))]
    assert len(lines) == len(notes)
    assert all(line.startswith(f"note: {tmp_path}/{words}") for line, words in zip(lines, notes, strict=True))
    assert "note:" not in done.stdout
