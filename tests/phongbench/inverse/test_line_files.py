"""Lines as files: what is read and written, and errors that name file and row."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner, Result

import phongbench as pb
from phongbench.cli.main import main
from phongbench.inverse.line_files import read_line

MODEL = ["--ambient", "0.1", "--diffuse", "0.7", "--light", "0.2,1"]
VALUES = [0.45, 0.6, 0.75, 0.8, 0.7, 0.5]


def call(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["inverse", "line", *map(str, arguments)])


@pytest.fixture
def line(tmp_path: Path) -> Path:
    path = tmp_path / "line.csv"
    path.write_text("x,intensity\n" + "".join(f"{2 * i},{v}\n" for i, v in enumerate(VALUES)))
    return path


def test_the_command_says_what_the_library_does(line: Path, tmp_path: Path) -> None:
    x = 2.0 * np.arange(len(VALUES))
    found = pb.inverse_line(VALUES, ambient=0.1, diffuse=0.7, light=(0.2, 1), x=x, noise=0.01)
    answer = json.loads(call(line, *MODEL, "--noise", 0.01, "--json").stdout)
    assert answer == found.as_dict()
    assert {"x", "normals", "other", "height", "height_low", "height_high", "marks"} <= set(answer)
    shown = call(line, *MODEL)
    assert shown.stderr.startswith("note: the light [0.2, 1] has length 1.0198")
    assert shown.stdout.splitlines()[0].startswith("x,intensity,nx,nz,angle_degrees")
    for name in ("out.csv", "out.parquet", "out.json"):
        assert call(line, *MODEL, "--out", tmp_path / name).stdout == f"{tmp_path / name}\n"
    pd.testing.assert_frame_equal(pd.read_parquet(tmp_path / "out.parquet"), pd.read_csv(tmp_path / "out.csv"))
    for name, start in (("out.svg", b"<?xml"), ("out.png", b"\x89PNG")):
        assert call(line, *MODEL, "--figure", tmp_path / name).exit_code == 0
        assert (tmp_path / name).read_bytes().startswith(start)


def test_every_way_to_write_a_line_is_read_alike(line: Path, tmp_path: Path) -> None:
    ways = {
        "swapped.csv": "intensity,x\n" + "".join(f"{v},{2 * i}\n" for i, v in enumerate(VALUES)),
        "bare.csv": "".join(f"{2 * i}, {v}\r\n" for i, v in enumerate(VALUES)) + "\n",
        "marked.csv": "\ufeffX,Intensity\n" + "".join(f"{2 * i},{v}\n" for i, v in enumerate(VALUES)),
    }
    files = [line]
    for name, text in ways.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
        files.append(tmp_path / name)
    np.save(tmp_path / "line.npy", np.stack([2.0 * np.arange(len(VALUES)), VALUES], axis=1))
    for path in (*files, tmp_path / "line.npy"):
        found = read_line(path)
        assert found.x is not None
        assert found.x.tolist() == [0, 2, 4, 6, 8, 10]
        assert found.values.tolist() == VALUES
    (tmp_path / "one.csv").write_text("".join(f"{v}\n" for v in VALUES))
    assert read_line(tmp_path / "one.csv").x is None


def test_a_scale_divides_all(tmp_path: Path) -> None:
    np.save(tmp_path / "bytes.npy", np.array([100, 180, 200], np.uint8))
    scaled = json.loads(
        call(
            tmp_path / "bytes.npy", "--ambient", 25.5, "--diffuse", 178.5, "--light", "0,1", "--scale", 255, "--json"
        ).stdout
    )
    plain = pb.inverse_line(np.array([100, 180, 200]) / 255, ambient=0.1, diffuse=0.7, light=(0, 1))
    np.testing.assert_allclose(scaled["height"], plain.height, rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "place", "what"),
    [
        ("", ":1", "an empty file"),
        ("0.5\nnan\n", ":2", "not a finite number"),
        ("0.5\n\n7\n", ":3", "outside 0 .. 1"),
        ("x,intensity\n0,0.5\n0,0.5\n", ":3", "x does not grow"),
        ("x,intensity\n0,half\n", ":2", "not 2 numbers"),
        ("0.5,0.5\n0.5\n", ":2", "not 2 numbers"),
        ("1,2,3\n", ":1", "3 columns"),
        ("y,intensity\n1,2\n", ":1", "columns y, intensity"),
        ("x\n1\n", ":1", "columns x"),
        ("intensity\n", "intensity", "shape (0,)"),
    ],
)
def test_what_cannot_be_read_names_file_and_row(tmp_path: Path, text: str, place: str, what: str) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    found = call(path, *MODEL)
    assert found.exit_code == 2
    assert f"{path}{place}" in found.stderr or f"{place}:" in found.stderr
    assert what in found.stderr


def test_files_that_are_none_are_refused(line: Path, tmp_path: Path) -> None:
    (tmp_path / "text.npy").write_bytes(b"no array")
    np.save(tmp_path / "flat.npy", np.zeros((2, 3)))
    np.save(tmp_path / "names.npy", np.array(["a"]))
    (tmp_path / "latin.csv").write_bytes(b"0.5\n\xff\n")
    for name in ("text.npy", "flat.npy", "names.npy", "latin.csv", "nowhere.csv", "."):
        found = call(tmp_path / name, *MODEL)
        assert (found.exit_code, str(tmp_path / name) in found.stderr) == (2, True), found.stderr
    (tmp_path / "angles.csv").write_text("1\n2\n")
    for prior, what in (("angles.csv", "2 angles for 6 samples"), ("none.csv", "cannot read")):
        found = call(line, *MODEL, "--prior", tmp_path / prior)
        assert (found.exit_code, what in found.stderr) == (2, True), found.stderr
    for option, name in (("--out", "line.txt"), ("--figure", "line.pdf"), ("--out", "line.csv/below.csv")):
        assert call(line, *MODEL, option, tmp_path / name).exit_code == 2
    for option, value in (
        ("--light", "1"),
        ("--light", "0,-1"),
        ("--scale", "0"),
        ("--prior", "flat"),
        ("--noise", "-1"),
    ):
        assert call(line, *MODEL, option, value).exit_code == 2


def test_expected_angles_choose(line: Path, tmp_path: Path) -> None:
    (tmp_path / "angles.csv").write_text("angle\n" + "80\n" * len(VALUES))
    answer = json.loads(call(line, *MODEL, "--prior", tmp_path / "angles.csv", "--json").stdout)
    given = pb.inverse_line(VALUES, ambient=0.1, diffuse=0.7, light=(0.2, 1), prior=[80.0] * len(VALUES))
    assert answer["normals"] == given.as_dict()["normals"]
    (tmp_path / "angles.csv").write_text("80\n" * 5 + "nan\n")
    assert (
        f"{tmp_path / 'angles.csv'}:6: not a finite angle"
        in call(line, *MODEL, "--prior", tmp_path / "angles.csv").stderr
    )
