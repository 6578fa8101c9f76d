"""Heights from normals: a plane exactly, smooth surfaces closely, parts of a mask each by itself."""

import numpy as np
import pytest

from phongbench.errors import InputError
from phongbench.inverse.surface_heights import integrate


def of_slopes(p: object, q: object) -> np.ndarray:
    """Normals of slopes over x to the right and y up."""
    p, q = np.broadcast_arrays(np.asarray(p, float), np.asarray(q, float))
    normals = np.dstack([-p, -q, np.ones_like(p)])
    return np.asarray(normals / np.linalg.norm(normals, axis=2)[..., None])


def test_a_plane_comes_back_with_x_right_and_y_up() -> None:
    row, column = np.mgrid[:6, :5]
    found = integrate(of_slopes(np.full((6, 5), 0.3), -0.7))
    plane = 0.3 * column - 0.7 * (5 - row)
    np.testing.assert_allclose(found, plane - plane.mean(), atol=1e-12)


def test_a_smooth_surface_comes_back_within_its_curvature() -> None:
    y, x = np.mgrid[30:-31:-1, -30:31]
    height = 8 * np.exp(-(x * x + y * y) / 200)
    found = integrate(of_slopes(-x / 100 * height, -y / 100 * height))
    assert np.abs(found - (height - height.mean())).max() < 0.01 * np.ptp(height)


def test_parts_that_do_not_touch_are_integrated_by_themselves() -> None:
    normals = of_slopes(np.full((4, 7), 0.5), 0.0)
    mask = np.ones((4, 7), bool)
    mask[:, 3] = False
    found = integrate(normals, mask)
    assert np.isnan(found[:, 3]).all()
    for part in (found[:, :3], found[:, 4:]):
        np.testing.assert_allclose(part, np.broadcast_to([-0.5, 0.0, 0.5], (4, 3)), atol=1e-12)
    normals[1, 1], normals[2, 5] = np.nan, (1.0, 0.0, 0.0)
    found = integrate(normals)
    assert np.isnan(found[[1, 2], [1, 5]]).all()
    assert np.isfinite(found).sum() == 26
    assert np.isnan(integrate(np.full((2, 2, 3), np.nan))).all()


def test_wrong_shapes_are_refused() -> None:
    with pytest.raises(InputError, match="normals of shape"):
        integrate(np.ones((3, 3)))
    with pytest.raises(InputError, match="a mask of shape"):
        integrate(of_slopes(np.zeros((3, 3)), 0.0), np.ones((2, 2)))
