"""How far two pictures are apart, as people see them."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

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


def test_a_picture_that_is_not_finite_has_no_error() -> None:
    with pytest.raises(InputError, match="not finite"):
        images.compare(grey(0, 1), grey(0, np.inf))
