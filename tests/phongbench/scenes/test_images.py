"""How far two pictures are apart, as people see them."""

import io
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from phongbench.errors import InputError
from phongbench.scenes import images
from phongbench.support import image_files


def grey(*levels: float) -> np.ndarray:
    """A picture of one row of greys."""
    return np.repeat(np.array(levels, np.float32)[None, :, None], 3, axis=2)


@given(st.floats(0, 1))
def test_encoding_is_undone_by_the_standards_formula(light: float) -> None:
    shown = float(image_files.encoded(np.array([light]))[0])
    back = shown / 12.92 if shown <= 0.04045 else ((shown + 0.055) / 1.055) ** 2.4
    assert back == pytest.approx(light, abs=1e-7)


def test_known_codes() -> None:
    assert image_files.codes(grey(-1, 0, 0.0031308, 0.2158605, 0.5, 1, 7))[0, :, 0].tolist() == [
        0,
        0,
        10,
        128,
        188,
        255,
        255,
    ]


def test_equal_pictures_are_not_apart() -> None:
    error = images.compare(grey(0, 0.5, 2), grey(0, 0.5, 2))
    assert (error.max_abs, error.mean_abs, error.max_codes, error.visible) == (0, 0, 0, 0)
    assert math.isinf(error.psnr)
    assert error.as_dict()["psnr"] is None
    assert error.flip in (None, 0)
    assert (error.energy, error.highlight_area) == (1, 1)


def test_the_numbers_of_a_picture_that_is_off() -> None:
    exact, other = grey(0.0, 0.2158605, 0.8, 1.0), grey(0.0, 0.2199, 0.8, 0.45)
    error = images.compare(exact, other, flip=False)
    assert error.max_abs == pytest.approx(0.55)
    assert error.mean_abs == pytest.approx((0.0040395 + 0.55) / 4, rel=1e-5)
    assert error.visible == 0.5
    assert error.max_codes == 255 - int(image_files.codes(grey(0.45))[0, 0, 0])
    assert error.energy == pytest.approx(other.sum() / exact.sum())
    assert error.highlight_area == 0.5  # of two pixels above half the brightest, one is left
    assert error.flip is None
    shown = (image_files.encoded(exact.astype(float)) - image_files.encoded(other.astype(float))) ** 2
    assert error.psnr == pytest.approx(10 * math.log10(1 / shown.mean()))


def test_light_where_there_was_none_has_no_ratio() -> None:
    told = images.compare(grey(0, 0), grey(0, 0.5), flip=False).as_dict()
    assert told["energy"] is None


def test_flip_sees_what_people_see() -> None:
    pytest.importorskip("flip_evaluator")
    rng = np.random.default_rng(3)
    exact = rng.random((40, 40, 3), np.float32)
    little, much = (images.flip_error(exact, np.clip(exact + e, 0, 1)) for e in (0.01, 0.2))
    assert little is not None
    assert much is not None
    assert 0 < little < much < 1


def test_pictures_of_different_size_are_refused() -> None:
    with pytest.raises(InputError, match="shape"):
        images.compare(grey(0, 1), grey(0, 1, 1))


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
    with pytest.raises(InputError, match="not finite"):
        images.compare(grey(0, 1), grey(0, np.inf))
