"""Copper between the wavelengths at which it was measured."""

import numpy as np
import pytest

from phongbench.inputs import optical_constants
from phongbench.inputs.optical_constants import COPPER, WAVELENGTHS


def test_constants_lie_on_the_lines_between_what_was_measured() -> None:
    measured = np.array(sorted(optical_constants._COPPER))
    assert COPPER.n == pytest.approx([np.interp(w, measured[:, 0], measured[:, 1]) for w in WAVELENGTHS], rel=1e-12)
    assert COPPER.k == pytest.approx([np.interp(w, measured[:, 0], measured[:, 2]) for w in WAVELENGTHS], rel=1e-12)


def test_head_on_copper_reflects_as_published() -> None:
    n, k = np.array(COPPER.n), np.array(COPPER.k)
    head_on = ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2)
    assert head_on == pytest.approx(
        [0.955, 0.638, 0.538], abs=0.02
    )  # linear red, green, blue of physically based tables


def test_at_its_ends_the_table_stands_as_published() -> None:
    assert optical_constants._between(659.5) == (0.22, 3.747)
    assert optical_constants._between(430.5) == (1.25, 2.305)


def test_a_wavelength_outside_is_refused() -> None:
    with pytest.raises(ValueError, match="700"):
        optical_constants._between(700.0)
