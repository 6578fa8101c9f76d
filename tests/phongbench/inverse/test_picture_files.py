"""Photometric stereo on files: PNG, EXR and npy in, normals, normal maps and OBJ out, errors that name the file."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from PIL import Image

from phongbench.cli.main import main
from phongbench.inputs import obj_files
from phongbench.inverse.picture_files import normal_map
from phongbench.support import image_files

LIGHTS = [[0.5, 0.0, 1.0], [-0.5, 0.2, 1.0], [0.1, 0.6, 1.0], [0.0, -0.5, 1.0]]
MODEL = ["--diffuse", "0.8", "--ks", "0", "--threads", "1"]


def call(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["inverse", "photometric", *map(str, arguments)])


def folder_of(tmp_path: Path) -> tuple[np.ndarray, np.ndarray]:
    """A gentle dome in four pictures, in every kind of file; its normals and heights."""
    y, x = np.mgrid[4:-5:-1, -5:6]
    height = -(x * x + y * y) / 20.0
    normals = np.dstack([x / 10, y / 10, np.ones(x.shape)])
    normals /= np.linalg.norm(normals, axis=2)[..., None]
    for k, light in enumerate(LIGHTS):
        picture = 0.8 * normals @ (np.array(light) / np.linalg.norm(light))
        for suffix in ("npy", "exr", "png"):
            image_files.save(tmp_path / f"p{k}.{suffix}", np.repeat(picture[..., None], 3, axis=2))
        Image.fromarray((65535 * picture).astype(np.uint16)).save(tmp_path / f"deep{k}.png")
    (tmp_path / "lights.json").write_text(json.dumps({"lights": [{"direction": light} for light in LIGHTS]}))
    return normals, height


@pytest.mark.parametrize(
    ("names", "most"), [("p{}.npy", 1e-6), ("p{}.exr", 1e-6), ("p{}.png", 0.01), ("deep{}.png", 1e-3)]
)
def test_every_kind_of_picture_gives_the_normals(tmp_path: Path, names: str, most: float) -> None:
    normals, height = folder_of(tmp_path)
    paths = [tmp_path / names.format(k) for k in range(4)]
    linear = ["--linear"] if names.startswith("deep") else []
    out, heights = tmp_path / "n.npy", tmp_path / "z.npy"
    shown = call(
        *paths, "--lights", tmp_path / "lights.json", *MODEL, *linear, "--out", out, "--heights", heights, "--json"
    )
    assert shown.exit_code == 0, shown.output
    told = json.loads(shown.stdout)
    assert (told["known"], told["normals"], told["heights"]) == (height.size, str(out), str(heights))
    found = np.load(out)
    assert found.dtype == np.float32
    assert np.abs(found - normals).max() < most
    assert np.abs(np.load(heights) - (height - height.mean())).max() < 20 * most + 0.02


def test_normals_and_heights_are_written_as_others_read_them(tmp_path: Path) -> None:
    normals, height = folder_of(tmp_path)
    mask = np.zeros((*height.shape, 3), np.uint8)
    mask[1:, :-1] = 255
    image_files.save(tmp_path / "mask.png", mask)
    paths = [tmp_path / f"p{k}.npy" for k in range(4)]
    common = [*paths, "--lights", tmp_path / "lights.json", *MODEL, "--mask", tmp_path / "mask.png"]
    assert call(*common, "--out", tmp_path / "map.png", "--heights", tmp_path / "z.obj").exit_code == 0
    colours = np.asarray(Image.open(tmp_path / "map.png"))
    assert (colours[0] == 128).all()
    np.testing.assert_allclose(colours[1:, :-1].astype(int), normal_map(normals)[1:, :-1], atol=1)
    assert normal_map(np.array([[[-1.0, 0.0, 1.0]]])).tolist() == [[[0, 128, 255]]]
    surface = obj_files.load(tmp_path / "z.obj")
    assert len(surface.vertices) == 8 * 10
    assert len(surface.faces) == 2 * 7 * 9
    a, b, c = (surface.vertices[surface.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()  # towards the viewer
    assert json.loads(call(*common, "--out", tmp_path / "n.exr", "--json").stdout)["heights"] is None
    exr = image_files.load(tmp_path / "n.exr")
    assert np.isnan(exr[0]).all()
    assert np.abs(exr - normals)[1:, :-1].max() < 1e-6


@pytest.mark.parametrize(
    ("change", "named", "what"),
    [
        ({"pictures": 2}, "p1.npy", "2 pictures"),
        ({"lights": {"lights": [{"direction": LIGHTS[0]}] * 3}}, "lights.json", "3 lights for 4 pictures"),
        ({"lights": {"lights": [{"direction": LIGHTS[0]}] * 4}}, "lights[1]", "parallel"),
        ({"lights": {"lights": [{"direction": [0, 0, -1]}] * 4}}, "lights[0]", "from behind"),
        ({"lights": {"lights": [{"direction": [0, 0]}] * 4}}, "lights[0].direction", "not a list of 3 numbers"),
        ({"lights": {"lights": [{"direction": LIGHTS[0], "colour": 1}]}}, "lights[0].colour", "unknown key"),
        ({"lights": [1]}, "lights.json", "table of keys"),
        ({"third": np.ones((3, 3))}, "p2.npy", "3 x 3 pixels, but"),
        ({"third": np.full((9, 11), np.inf)}, "p2.npy", "column 0 of row 0 is not finite"),
        ({"third": np.ones((9, 11, 2))}, "p2.npy", "a picture of shape"),
        ({"third": np.array(["a"])}, "p2.npy", "not an array of numbers"),
        ({"arguments": ["--out", "n.txt"]}, "n.txt", "not written as .txt"),
        ({"arguments": ["--heights", "z.stl"]}, "z.stl", "not written as .stl"),
        ({"arguments": ["--mask", "p9.png"]}, "p9.png", "cannot read"),
        ({"arguments": ["--specular", "lyon:8"]}, "", "lyon"),
        ({"arguments": ["--specular", "phong@reflect"]}, "specular", "removes lengths"),
    ],
)
def test_wrong_input_names_its_file(tmp_path: Path, change: dict[str, object], named: str, what: str) -> None:
    folder_of(tmp_path)
    if "third" in change:
        np.save(tmp_path / "p2.npy", change["third"])  # type: ignore[arg-type]
    if "lights" in change:
        (tmp_path / "lights.json").write_text(json.dumps(change["lights"]))
    paths = [tmp_path / f"p{k}.npy" for k in range(int(change.get("pictures", 4)))]  # type: ignore[call-overload]
    more = [tmp_path / a if "." in a and ":" not in a else a for a in change.get("arguments", [])]  # type: ignore[attr-defined]
    shown = call(*paths, "--lights", tmp_path / "lights.json", *MODEL, "--out", tmp_path / "n.npy", *more)
    assert shown.exit_code == 2, shown.output
    assert named in shown.stderr
    assert what in shown.stderr
    assert not (tmp_path / "n.npy").exists()


@pytest.mark.parametrize("suffix", [".png", ".exr", ".npy", ".jpg"])
def test_files_that_are_no_pictures_are_refused(tmp_path: Path, suffix: str) -> None:
    folder_of(tmp_path)
    bad = tmp_path / f"bad{suffix}"
    bad.write_bytes(b"no picture")
    paths = [bad, *(tmp_path / f"p{k}.npy" for k in range(3))]
    shown = call(*paths, "--lights", tmp_path / "lights.json", *MODEL, "--out", tmp_path / "n.npy")
    assert (shown.exit_code, str(bad) in shown.stderr) == (2, True), shown.stderr


def test_decoding_undoes_encoding() -> None:
    light = np.linspace(0, 1, 1001)
    np.testing.assert_allclose(image_files.decoded(image_files.encoded(light)), light, atol=1e-12)
