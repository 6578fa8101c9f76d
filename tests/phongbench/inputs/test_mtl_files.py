"""Materials: the classic table, and MTL files read strictly."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from phongbench.cli.main import main
from phongbench.errors import InputError
from phongbench.inputs.mtl_files import OPENGL, Material, exponents, mtl_paths, read_exponents, read_mtl
from phongbench.inputs.wavefront_text import printable

ROWS = {m.name: m for m in OPENGL}


def test_the_classic_table_has_24_materials_with_colours_in_range() -> None:
    assert len(ROWS) == len(OPENGL) == 24
    for m in OPENGL:
        assert all(0 <= c <= 1 for colour in (m.ambient, m.diffuse, m.specular) for c in colour)
        assert 0 < m.shininess <= 128


@pytest.mark.parametrize(
    ("name", "shininess"),
    [
        ("emerald", 76.8),
        ("brass", 27.897436),
        ("chrome", 76.8),
        ("gold", 51.2),
        ("black-rubber", 10),
        ("pearl", 11.264),
        ("red-plastic", 32),
        ("jade", 12.8),
        ("bronze", 25.6),
        ("obsidian", 38.4),
    ],
)
def test_shininess_is_128_times_the_factor_of_the_table(name: str, shininess: float) -> None:
    assert ROWS[name].shininess == pytest.approx(shininess)


def test_a_row_of_the_table_is_what_its_source_prints() -> None:
    assert ROWS["gold"] == Material(
        "gold", (0.24725, 0.1995, 0.0745), (0.75164, 0.60648, 0.22648), (0.628281, 0.555802, 0.366065), 51.2
    )


def test_exponents_are_the_distinct_positive_ones_ascending() -> None:
    made = [Material("a", shininess=20.0), Material("b", shininess=5.0), Material("c", shininess=20.0), Material("d")]
    assert exponents(made) == (5.0, 20.0)
    assert len(exponents(OPENGL)) == 9


def written(folder: Path, text: str) -> Path:
    path = folder / "scene.mtl"
    path.write_bytes(text.encode())
    return path


def test_an_mtl_file_gives_its_materials_in_order(tmp_path: Path) -> None:
    text = (
        "\ufeff# Blender MTL File\r\nnewmtl  Shiny red  # named\r\n\tNs 96.078431\r\nKa 1.0 1.0 1.0\r\n"
        "Kd 0.8 0.1 1e-1\r\n  Ks 0.5\r\nKe 0 0 0\r\nillum 2\r\nmap_Kd wood.png\r\n\r\nnewmtl matt\nNs 0\n"
    )
    read = read_mtl(written(tmp_path, text))
    red, matt = read.materials
    assert red == Material("Shiny red", (1, 1, 1), (0.8, 0.1, 0.1), (0.5, 0.5, 0.5), 96.078431)
    assert matt == Material("matt")
    assert exponents((red, matt)) == (96.078431,)
    told = [note.removeprefix(f"{tmp_path / 'scene.mtl'}: ").rpartition(":")[0] for note in read.notes]
    assert told == ["line 7: 'Ke' is ignored", "line 8: 'illum' is ignored", "line 9: 'map_Kd' is ignored"]


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("newmtl a\nNs\n", 2, "Ns takes one number, not 0"),
        ("newmtl a\nNs 1 2\n", 2, "Ns takes one number, not 2"),
        ("newmtl a\n\nNs high\n", 3, "Ns is 'high', not a number"),
        ("newmtl a\nNs nan\n", 2, "Ns is 'nan', not a number"),
        ("newmtl a\nNs 1_0\n", 2, "Ns is '1_0', not a number"),
        ("newmtl a\nNs 1e9999\n", 2, "Ns = 1e9999 is outside 0 .. 100000"),
        ("newmtl a\nNs -1\n", 2, "Ns = -1 is outside 0 .. 100000"),
        ("newmtl a\nNs 100001\n", 2, "Ns = 100001 is outside 0 .. 100000"),
        ("newmtl a\nNs 10\nKd 1 1\n", 3, "Kd takes one or three numbers, not 2"),
        ("newmtl a\nNs 10\nKd 1 x 1\n", 3, "Kd is 'x', not a number"),
        ("newmtl a\nNs 10\nKs 1 -2 1\n", 3, "Ks = -2 is outside 0 .. 1"),
        ("newmtl a\nKd 1 \\\n1 1\nKs 1 x 1\n", 4, "Ks is 'x', not a number"),
        ("newmtl a\nNs 10\nKd spectral x.rfl 1\n", 3, "Kd spectral is not supported"),
        ("Ns 10\nnewmtl a\n", 1, "Ns before the first newmtl"),
        ("newmtl\nNs 10\n", 1, "newmtl without a name"),
        ("newmtl # a\nNs 10\n", 1, "newmtl without a name"),
    ],
)
def test_a_malformed_line_is_named(tmp_path: Path, text: str, line: int, message: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(InputError) as refusal:
        read_mtl(path)
    assert (refusal.value.what, refusal.value.where) == (message, f"{path}:{line}")
    assert refusal.value.fix


@pytest.mark.parametrize("text", ["", "# nothing\n", "newmtl a\nKd 1 1 1\n", "newmtl a\nNs 0\n"])
def test_a_file_without_an_exponent_has_materials_but_no_exponents(tmp_path: Path, text: str) -> None:
    path = written(tmp_path, text)
    assert exponents(read_mtl(path).materials) == ()
    with pytest.raises(InputError, match="no material has a positive Ns") as refusal:
        read_exponents(path)
    assert refusal.value.where == str(path)


def test_bytes_are_no_materials(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not a text file"):
        read_mtl(written(tmp_path, "\x89PNG\r\n\x1a\n\x00\x00\rIHDR"))


@pytest.mark.parametrize(
    ("text", "field", "value", "note"),
    [
        ("Kd 1.0001 0.5 0\nNs 9", "diffuse", (1, 0.5, 0), "line 2: Kd above 1 counts as 1"),
        ("Ka 20\nNs 9", "ambient", (1, 1, 1), "line 2: Ka above 1 counts as 1"),
        ("Kd 0.5 \nNs 9", "diffuse", (0.5, 0.5, 0.5), None),
        ("Kd .1 .2 .3 1\nNs 9", "diffuse", (0.1, 0.2, 0.3), "line 2: the fourth number of Kd is ignored"),
        ("Ks 1 1 1", "shininess", 0, "line 1: a material whose Ks has no positive Ns gets no highlight"),
        ("Ns 2048", "shininess", 2048, None),
        ("Ns 9 # dull", "shininess", 9, None),
        ("d 1\nd 1", "shininess", 0, "line 2: 'd' is ignored: everything is opaque (2 lines)"),
        ("Pr 0.5", "shininess", 0, "line 2: 'Pr' is ignored: it belongs to another reflection model"),
        ("gloss 3", "shininess", 0, "line 2: 'gloss' is ignored: it is not understood"),
    ],
)
def test_what_is_changed_or_ignored_is_told(tmp_path: Path, text: str, field: str, value: object, note: str) -> None:
    read = read_mtl(path := written(tmp_path, f"newmtl a\n{text}\n"))
    assert getattr(read.materials[0], field) == value
    assert read.notes == (() if note is None else (f"{path}: {note}",))


def test_of_two_definitions_the_last_counts_and_is_told_if_it_differs(tmp_path: Path) -> None:
    same, other = "newmtl wall\nNs 5\n", "newmtl wall\nNs 6\n"
    assert read_mtl(written(tmp_path, same + same)).notes == ()
    read = read_mtl(written(tmp_path, same + other))
    assert [m.shininess for m in read.materials] == [6]
    assert [note.partition(": ")[2] for note in read.notes] == [
        "line 3: the material 'wall' is defined again, differently: the last one counts"
    ]


def test_a_hash_after_a_blank_is_a_comment_unless_a_name_needs_it(tmp_path: Path) -> None:
    text = "newmtl red # paint\nNs 1\nnewmtl wall #2\nNs 2\nnewmtl wall #3\nNs 3\nnewmtl a#b\nNs 4\nnewmtl #f00\nNs 5\n"
    read = read_mtl(written(tmp_path, text))
    found = {name: read.find(name) for name in ("red", "red # x", "wall #2", "wall #3", "a#b", "a#b # c", "#f00")}
    assert [m and m.shininess for m in found.values()] == [1, 1, 2, 3, 4, 4, 5]
    assert read.find("wall") is None


@pytest.mark.parametrize(
    ("line", "names"),
    [
        ("a.mtl", ["a.mtl"]),
        ("a.mtl b.mtl", ["a.mtl", "b.mtl"]),
        ("my paint #1.mtl a.mtl", ["my paint #1.mtl", "a.mtl"]),
        ("a.mtl # b.mtl", ["a.mtl"]),
        ('"my paint #1.mtl"', ["my paint #1.mtl"]),
        (r"C:\Models\A.MTL", ["a.mtl"]),
        ("./a.mtl", ["a.mtl"]),
        ("none.mtl a.mtl", ["a.mtl", "not there: none.mtl"]),
        ("x" * 5000, [f"not there: {'x' * 5000}"]),
    ],
)
def test_a_mtllib_line_names_files_as_programs_write_them(tmp_path: Path, line: str, names: list[str]) -> None:
    for name in ("a.mtl", "b.mtl", "my paint #1.mtl"):
        (tmp_path / name).write_text("")
    paths, missing = mtl_paths(tmp_path, [line])
    assert [path.name for path in paths] + [f"not there: {name}" for name in missing] == names


def test_what_could_move_a_cursor_is_escaped() -> None:
    assert printable("a\x1bb \u202ec") == r"a\x1bb \u202ec"
    assert printable("copper, blue (ü)") == "copper, blue (ü)"


def test_a_missing_file_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot read the MTL file") as refusal:
        read_mtl(tmp_path / "none.mtl")
    assert refusal.value.where == str(tmp_path / "none.mtl")
    with pytest.raises(InputError, match="cannot read the MTL file"):
        read_mtl(tmp_path)


def test_exponents_are_read_by_the_same_rules(tmp_path: Path) -> None:
    path = tmp_path / "a.mtl"
    path.write_bytes("newmtl a b\r\tNs\t2048 # high\r\rnewmtl c\rNs 5\rnewmtl c\rNs 7\r".encode("utf-16"))
    done = CliRunner().invoke(
        main, ["run", "--materials", str(path), "--only", "phong", "--samples", "64", "--dry-run"]
    )
    assert done.exit_code == 0, done.output
    assert f"note: {path}: line 6: the material 'c' is defined again" in done.stderr
    path.write_text("newmtl matt\nNs 0\n", encoding="utf-8")
    done = CliRunner().invoke(main, ["run", "--materials", str(path), "--dry-run"])
    assert done.exit_code == 2
    assert f"{path}: no material has a positive Ns" in done.stderr
