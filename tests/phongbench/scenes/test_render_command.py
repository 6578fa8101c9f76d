"""`phongbench render`: a picture, and what was left out of the work."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from PIL import Image

from phongbench.benchmarks import scene_bench
from phongbench.benchmarks.scene_peers import PEERS
from phongbench.cli.main import main
from phongbench.scenes.scene_files import examples


def render(*arguments: str | Path) -> Result:
    """Runs the command."""
    return CliRunner().invoke(main, ["render", *map(str, arguments)])


def size(path: Path) -> tuple[int, int]:
    """Width and height of a picture's file."""
    with Image.open(path) as picture:
        return picture.size


def test_a_shipped_scene_becomes_a_picture_and_a_ledger(tmp_path: Path) -> None:
    out = tmp_path / "card.png"
    done = render("test-card", "--size", "64x36", "--out", out, "--json")
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert size(out) == (64, 36)
    assert (told["width"], told["height"], told["rays"], told["picture"]) == (64, 36, 64 * 36, str(out))
    assert {"name", "kind", "unit", "of", "skipped", "bound"} == set(told["ledger"][0])
    assert set(told["seconds"]) == {"preparing", "total", "tracing", "shading"}


def test_people_see_a_table(tmp_path: Path) -> None:
    done = render("chequerboard", "--size", "32x18", "--out", tmp_path / "a.npy", "--no-shadows", "--depth", "1")
    assert done.exit_code == 0, done.output
    assert "reflectivity" in done.stdout
    assert np.load(tmp_path / "a.npy").shape == (18, 32, 3)


def test_without_skips_the_picture_is_that_of_exact_skips(tmp_path: Path) -> None:
    for name, option in (("none", "--no-skip"), ("exact", "--exact")):
        assert render("many-lights", "--size", "48x27", "--out", tmp_path / f"{name}.npy", option).exit_code == 0
    assert np.array_equal(np.load(tmp_path / "none.npy"), np.load(tmp_path / "exact.npy"))


def test_a_formula_is_compared_with_exact_phong(tmp_path: Path) -> None:
    done = render(
        "test-card", "--size", "64x36", "--specular", "lyon:dot:8", "--compare", "--out", tmp_path / "t.png", "--json"
    )
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert told["specular"] == "lyon:dot:8"
    assert 0 < told["error"]["max_abs"] < 0.5
    width, height = size(tmp_path / "t.png")
    assert width > 3 * 64
    assert height > 36


def test_people_read_a_line_for_each_error_rounded_and_with_its_unit(tmp_path: Path) -> None:
    small = ("--size", "64x36", "--compare", "--out", tmp_path / "t.png")
    shown, told = (render("test-card", "--specular", "lyon:dot:8", *small, *more) for more in ((), ("--json",)))
    lines, error = shown.stdout.splitlines(), json.loads(told.stdout)["error"]
    assert any(re.fullmatch(rf"largest error +{error['max_codes']} codes of 255", line) for line in lines)
    assert any(re.fullmatch(rf"pixels off by a code +{error['visible']:.2%}", line) for line in lines)
    assert any(re.fullmatch(r"size +64 x 36 pixels", line) for line in lines)
    assert any(re.fullmatch(r"PSNR +inf dB", line) for line in render("test-card", *small).stdout.splitlines())


def test_the_bench_tells_what_each_skip_saves() -> None:
    done = render("chequerboard", "--size", "32x18", "--bench", "--json")
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    rows = {row["variant"]: row for row in told["skips"]}
    assert rows["none"]["same_bits"]
    assert rows["exact"]["same_bits"]
    assert rows["all"]["ratio"] == 1
    assert [row["tracer"] for row in told["tracers"][:2]] == ["phongbench", "plain NumPy"]
    drew, absent = ({row["tracer"] for row in told[name]} for name in ("tracers", "absent"))
    assert set(PEERS) <= drew | absent
    assert not drew & absent
    assert told["tracers"][1]["pixels_off"] < 0.02


def test_people_read_once_what_a_tracer_does(monkeypatch: pytest.MonkeyPatch) -> None:
    row = dict.fromkeys(("seconds", "mpixels_per_second", "ratio", "pixels_off", "rays"), 0.5)
    row |= {"tracer": "ours", "version": "1.2", "draws": "depth 0", "size": "4x3", "note": "all that is compared"}
    rows = [row | {"mrays_per_second": None, "surfaces_agree": 0.25, "draws": draws} for draws in ("much", "little")]
    found = {"scene": "s", "tracers": rows, "absent": [{"tracer": "theirs", "why": "not installed"}], "skips": []}
    monkeypatch.setattr(scene_bench, "measure", lambda *_: found)
    shown = render("chequerboard", "--bench").stdout
    assert shown.count("all that is compared") == 1
    assert all(word in shown for word in ("much", "little", "0.25", "theirs", "not installed"))


def test_the_shipped_scenes_are_listed() -> None:
    done = render("--list", "--json")
    assert {row["scene"] for row in json.loads(done.stdout)} == set(examples())


def test_exr_holds_what_npy_holds(tmp_path: Path) -> None:
    library = pytest.importorskip("OpenEXR", reason="OpenEXR (extra `scene`) is not installed")
    for name in ("a.npy", "a.exr"):
        assert render("test-card", "--size", "32x18", "--out", tmp_path / name).exit_code == 0
    with library.File(str(tmp_path / "a.exr")) as file:
        assert np.array_equal(file.channels()["RGB"].pixels, np.load(tmp_path / "a.npy"))


@pytest.mark.parametrize("out", ["folder.png", "file/a.png"])
def test_where_nothing_can_be_written_nothing_is_drawn(tmp_path: Path, out: str) -> None:
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "file").write_text("")
    done = render("test-card", "--size", "8x8", "--out", tmp_path / out)
    assert done.exit_code == 2
    assert "cannot write" in done.stderr
    assert "render test-card" not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "name a scene"),
        (("teapot",), "unknown scene 'teapot'"),
        (("absent.toml",), "cannot read the scene"),
        (("test-card", "--out", "a.jpg"), ".jpg"),
        (("test-card", "--size", "3x"), "not a size"),
        (("test-card", "--size", "99999x99999"), "pixels"),
        (("test-card", "--depth", "65"), "depth = 65 is outside"),
        (("test-card", "--supersampling", "0"), "supersampling"),
        (("test-card", "--specular", "lion"), "did you mean 'lyon'"),
        (("test-card", "--specular", "lyon:dot:7"), "not a power of two"),
        (("test-card", "--specular", "lyon:dot"), "lyon needs a gamma"),
        (("test-card", "--specular", "lyon:diff:8"), "unknown lambda form of lyon 'diff'"),
        (("test-card", "--formulas", "--specular", "lion"), "unknown approximation 'lion'"),
        (("test-card", "--formulas", "--model", "blinn-phong"), "leave --model away"),
        (("test-card", "--compare", "--out", "a.npy"), "write it as .png"),
        (("test-card", "--with", "absent.py"), "absent.py"),
        (("test-card", "--skip", "--exact", "--bench", "--compare"), "--bench"),
    ],
)
def test_what_cannot_be_drawn_is_said_in_a_line_or_two(
    arguments: tuple[str, ...], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = render(*arguments)
    assert done.exit_code == 2, done.output
    assert words in done.output
    assert "Traceback" not in done.output
    assert not list(tmp_path.iterdir())
