"""Pictures as files: the encoding of IEC 61966-2-1, what each kind of file holds, and what is refused."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from phongbench.errors import InputError
from phongbench.support import image_files
from phongbench.support.image_files import codes, decoded, encoded


def grey(*levels: float) -> np.ndarray:
    """A picture of one row of greys."""
    return np.repeat(np.array(levels, np.float32)[None, :, None], 3, axis=2)


@pytest.mark.parametrize(
    ("linear", "code"), [(0.0, 0), (1.0, 255), (0.2140, 127.5), (0.5, 187.52), (0.0031308, 10.31), (0.18, 117.6)]
)
def test_known_light_has_its_code(linear: float, code: float) -> None:
    assert 255 * encoded(np.array(linear)) == pytest.approx(code, abs=0.06)


def test_decoding_is_the_inverse_and_light_outside_is_cut_off() -> None:
    light = np.linspace(0, 1, 4097)
    assert decoded(encoded(light)) == pytest.approx(light, abs=1e-12)
    assert codes(np.array([-1.0, 0.0, 1.0, 7.0])).tolist() == [0, 0, 255, 255]
    assert (np.diff(codes(light).astype(int)) >= 0).all()


def test_files_hold_what_was_drawn(tmp_path: Path) -> None:
    picture = np.random.default_rng(1).random((4, 6, 3), np.float32) * 1.5
    image_files.save(tmp_path / "new" / "a.png", picture)
    with Image.open(tmp_path / "new" / "a.png") as shown:
        assert (np.asarray(shown) == image_files.codes(picture)).all()
    image_files.save(tmp_path / "a.npy", picture)
    assert (np.load(tmp_path / "a.npy") == picture).all()
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["a.png"]
    assert Image.open(io.BytesIO(image_files.png(image_files.codes(picture)))).size == (6, 4)


def test_an_exr_holds_every_bit_and_says_what_its_numbers_are(tmp_path: Path) -> None:
    library = pytest.importorskip("OpenEXR", reason="OpenEXR (extra `scene`) is not installed")
    picture = np.random.default_rng(2).random((5, 7, 3), np.float32) * 1e3
    picture[0, :5, 1] = [np.inf, -np.inf, np.nan, -0.0, 1e-42]
    image_files.save(tmp_path / "new" / "A.EXR", picture)
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["A.EXR"]
    with library.File(str(tmp_path / "new" / "A.EXR"), separate_channels=True) as file:
        header, names = dict(file.header()), set(file.channels())
        back = np.stack([file.channels()[name].pixels for name in "RGB"], axis=2)
    assert names == {"R", "G", "B"}
    assert back.dtype == np.float32
    assert (back.view(np.uint32) == picture.view(np.uint32)).all()
    assert header["colorInteropID"] == "lin_rec709_scene"
    assert header["chromaticities"] == pytest.approx((0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329))
    assert image_files.exr(picture) == (tmp_path / "new" / "A.EXR").read_bytes()


def test_without_openexr_it_is_said_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(image_files, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"OpenEXR.*\n.*phongbench\[scene\]"):
        image_files.save(tmp_path / "a.exr", grey(0))
    image_files.save(tmp_path / "a.npy", grey(0))
    assert [path.name for path in tmp_path.iterdir()] == ["a.npy"]


def test_what_cannot_be_written_is_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.jpg.*\n.*\.png, \.npy, \.exr"):
        image_files.save(tmp_path / "a.jpg", grey(0))
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.png").mkdir()
    for name in ("file/a.png", "folder.png", f"{'a' * 300}.png"):
        with pytest.raises(InputError, match="cannot write"):
            image_files.save(tmp_path / name, grey(0))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder.png"]


def test_pixels_that_are_no_numbers_are_counted_and_not_drawn(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="1 of 3 pixels are no numbers, the first in column 2 of row 0"):
        image_files.save(tmp_path / "a.png", grey(0, np.inf, np.nan))
    assert not list(tmp_path.iterdir())
    assert image_files.codes(grey(np.inf)).tolist() == [[[255] * 3]]


@pytest.mark.parametrize(
    ("name", "shape"), [("a.npy", (2, 3)), ("a.npy", (2, 3, 3)), ("a.npy", (2, 3, 1)), ("a.exr", (2, 3, 3))]
)
def test_a_picture_of_one_channel_or_three_is_read_back(tmp_path: Path, name: str, shape: tuple[int, ...]) -> None:
    if name.endswith(".exr"):
        pytest.importorskip("OpenEXR", reason="OpenEXR (extra `scene`) is not installed")
    picture = np.arange(np.prod(shape), dtype=np.float32).reshape(shape) / 16
    image_files.save(tmp_path / name, picture)
    back = image_files.load(tmp_path / name)
    assert back.dtype == np.float64
    assert back.tolist() == (picture[..., 0] if shape[2:] == (1,) else picture).tolist()


@pytest.mark.parametrize("shape", [(3,), (2, 3, 2), (2, 3, 4), (2, 3, 3, 1), (0, 3), (2, 0, 3)])
def test_what_has_no_channels_of_a_picture_is_refused(tmp_path: Path, shape: tuple[int, ...]) -> None:
    np.save(tmp_path / "a.npy", np.zeros(shape))
    with pytest.raises(InputError, match="a picture of shape"):
        image_files.load(tmp_path / "a.npy")
