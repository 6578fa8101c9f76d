"""Materials: the classic table, and MTL files read strictly."""

from pathlib import Path

import pytest

from phongbench.errors import InputError
from phongbench.inputs.mtl_files import OPENGL, Material, exponents, read_mtl

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
    red, matt = read_mtl(written(tmp_path, text))
    assert red == Material("Shiny-red", (1, 1, 1), (0.8, 0.1, 0.1), (0.5, 0.5, 0.5), 96.078431)
    assert matt == Material("matt")
    assert exponents((red, matt)) == (96.078431,)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("newmtl a\nNs\n", 2, "Ns takes one number, not 0"),
        ("newmtl a\nNs 1 2\n", 2, "Ns takes one number, not 2"),
        ("newmtl a\n\nNs high\n", 3, "Ns is 'high', not a number"),
        ("newmtl a\nNs nan\n", 2, "Ns is 'nan', not a number"),
        ("newmtl a\nNs 1_0\n", 2, "Ns is '1_0', not a number"),
        ("newmtl a\nNs 1e9999\n", 2, "Ns = 1e9999 is outside 0 .. 1000"),
        ("newmtl a\nNs -1\n", 2, "Ns = -1 is outside 0 .. 1000"),
        ("newmtl a\nNs 1000.5\n", 2, "Ns = 1000.5 is outside 0 .. 1000"),
        ("newmtl a\nNs 10\nKd 1 1\n", 3, "Kd takes one or three numbers, not 2"),
        ("newmtl a\nNs 10\nKd 1 x 1\n", 3, "Kd is 'x', not a number"),
        ("newmtl a\nNs 10\nKs 1 2 1\n", 3, "Ks = 2 is outside 0 .. 1"),
        ("newmtl a\nNs 10\nKd spectral x.rfl 1\n", 3, "Kd spectral is not supported"),
        ("Ns 10\nnewmtl a\n", 1, "Ns before the first newmtl"),
        ("newmtl\nNs 10\n", 1, "newmtl without a name"),
        ("newmtl a\nNs 10\nnewmtl a\n", 3, "the material 'a' is defined twice"),
    ],
)
def test_a_malformed_line_is_named(tmp_path: Path, text: str, line: int, message: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(InputError) as refusal:
        read_mtl(path)
    assert (refusal.value.what, refusal.value.where) == (message, f"{path}:{line}")
    assert refusal.value.fix


@pytest.mark.parametrize("text", ["", "# nothing\n", "newmtl a\nKd 1 1 1\n", "\x89PNG\r\n\x1a\n\x00\x00"])
def test_a_file_without_any_shininess_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError, match="no material has a shininess"):
        read_mtl(written(tmp_path, text))


def test_a_missing_file_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot read the MTL file") as refusal:
        read_mtl(tmp_path / "none.mtl")
    assert refusal.value.where == str(tmp_path / "none.mtl")
    with pytest.raises(InputError, match="cannot read the MTL file"):
        read_mtl(tmp_path)
