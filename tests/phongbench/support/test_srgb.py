"""The encoding of pictures: IEC 61966-2-1."""

import numpy as np
import pytest

from phongbench.support.image_files import codes, decoded, encoded


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
