"""The layout of an OBJ file says nothing: blanks, comments, groups, kinds of indices, line ends and encodings."""

import warnings
from contextlib import suppress
from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from phongbench.errors import InputError
from phongbench.inputs.mtl_files import read_mtl
from phongbench.inputs.obj_files import ObjFile, load_obj

MTL = "newmtl red\nKa 0 0 0\nKd 1 0 0\nNs 10\nnewmtl blue # sky\nKd 0.5\nillum 2\n"
BENT = """mtllib a.mtl
v -1 -1 0.25
v 0 -1 0
v 1 -1 0.25
v -1 1 0
v 0 1 0.5
v 1 1 0
v 0.25 0 0
vt 0.5 0.5
vn 0 0 1
vn 0 0.6 0.8
vn 0.6 0 0.8
usemtl my red
f 1/1/1 2/1/2 5/1/1 4/1/3
usemtl blue
f 2/1/3 3/1/3 6/1/1 5/1/1 7/1/2
f 1//1 7//2 3//2
"""


@st.composite
def layouts(random: st.DrawFn) -> bytes:
    """Another layout of BENT: what a file says stays, how it is written changes."""
    one_of = lambda *choices: random(st.sampled_from(choices))  # noqa: E731 - a word for what is drawn here
    lines, counts = [], {"v": 0, "vt": 0, "vn": 0}
    for line in BENT.splitlines():
        key, *words = line.split(" ")
        if key in counts:
            counts[key] += 1
        if key == "f" and one_of(True, False):
            words = [
                "/".join(i and str(int(i) - 1 - counts[k]) for i, k in zip(word.split("/"), counts, strict=True))
                for word in words
            ]
        if key in ("v", "vn"):
            words = [one_of(word, f"{float(word):.3f}", f"{float(word):+e}") for word in words]
        gaps = [one_of(" ", "  ", "\t", " \t ", *([" \\\n"] if key in ("v", "vn", "f") else [])) for _ in words]
        before = one_of("", "", "# v 1 2 3\n", "\n", "o part\n", "g a b\n", "  # \xe9 \\\n", "s 1\n")
        after = one_of("", " ", "\t", " # 1 2 3", " #")
        lines.append(before + one_of("", " ", "\t") + key + "".join(map(str.__add__, gaps, words)) + after)
    text = one_of("", "\ufeff") + "\n".join(lines) + one_of("", "\n")
    text = text.replace("\n", one_of("\n", "\r\n", "\r"))
    return text.encode(one_of("utf-8", "latin-1", "utf-16") if text[0] != "\ufeff" else "utf-8")


def same(one: ObjFile, two: ObjFile) -> bool:
    """Whether two files hold the same triangles with the same normals and materials."""
    a, b = one.surface, two.surface
    return (
        np.array_equal(a.vertices[a.faces], b.vertices[b.faces])
        and np.array_equal(a.normals[a.faces], b.normals[b.faces])
        and np.array_equal(one.worn, two.worn)
        and (a.notes, a.remarks, len(one.materials)) == (b.notes, b.remarks, len(two.materials))
    )


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(layouts())
def test_another_layout_is_the_same_mesh(tmp_path: Path, data: bytes) -> None:
    plain, other = tmp_path / "plain.obj", tmp_path / "other.obj"
    plain.write_text(BENT, encoding="utf-8")
    other.unlink(missing_ok=True)
    other.write_bytes(data)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert same(load_obj(plain), load_obj(other))


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_a_damaged_file_is_read_or_refused(tmp_path: Path, data: st.DataObject) -> None:
    text = bytearray(data.draw(st.sampled_from([BENT.encode(), MTL.encode()])))
    damage = [b"", b" ", b"\n", b"/", b"-", b"f ", b"#", b"\\\n", b"9", b"\xff", b"."]
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text) - 1))
        text[at : at + data.draw(st.integers(0, 3))] = data.draw(st.sampled_from(damage))
    path = tmp_path / "damaged"
    path.unlink(missing_ok=True)
    path.write_bytes(text)
    for reader in (load_obj, read_mtl):
        with suppress(InputError):
            reader(path)
