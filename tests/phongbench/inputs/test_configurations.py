"""Configurations of N, L and V: addressable, over all incidences, V around the mirror direction, lengths as asked."""

import numpy as np
import pytest

from phongbench.compiler.lowering import FLOAT32, FLOAT64, precision_named
from phongbench.inputs.configurations import STEEPEST, configurations, normals_and_lights
from phongbench.inputs.pairs import pairs
from phongbench.inputs.strata import STRATA

BY_NAME = {(s.perturbation, s.length_error): s for s in STRATA if s.name == "configurations"}
UNIT = BY_NAME["none", 0.0]
HIGHLIGHT = next(s for s in STRATA if s.name == "highlight")


def drawn(stratum=UNIT, precision=FLOAT64, seed=1, start=0, count=4000, scale=1 / 50):
    n, vl = configurations(stratum, precision, seed=seed, start=start, count=count, scale=scale)
    return n, vl[3:], vl[:3]


def length(v):
    return np.sqrt((v.astype(np.float64) ** 2).sum(axis=0))


def test_the_mirror_direction_and_the_viewer_are_a_pair_of_the_highlight():
    n, light, view = drawn()
    mirror = 2 * (n * light).sum(axis=0) * n - light
    a, b = pairs(HIGHLIGHT, FLOAT64, seed=1, start=0, count=4000, scale=1 / 50)
    assert np.abs(mirror - a).max() < 1e-14
    assert np.array_equal(view, b)


def test_incidences_fill_their_range_at_all_azimuths():
    n, light, view = drawn()
    incidence = np.degrees(np.arccos(np.clip((n * light).sum(axis=0), -1, 1)))
    assert incidence.max() <= STEEPEST + 1e-6
    assert np.histogram(incidence, 8, (0, STEEPEST))[0].min() > 4000 / 8 / 2
    across = np.cross(n, light, axis=0)
    assert abs(np.mean((across * view).sum(axis=0) > 0) - 0.5) < 0.05  # the viewer is on either side of the plane


def test_a_seed_means_the_same_configurations_in_every_version():
    """As the rows of old runs were drawn: equal plans give equal rows, bit for bit."""
    mirror = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 1.0]])
    normals, lights = normals_and_lights(mirror, 1, 0)
    known = [
        [-0.7635550300265452, 0.5576974895985507, 0.3255107159781936],
        [0.8276858742920082, 0.5052911004018447, 0.2441659217666685],
    ]
    np.testing.assert_allclose(normals.T, known, rtol=1e-12)
    assert np.abs(2 * (normals * lights).sum(axis=0) * normals - lights - mirror).max() < 1e-15


@pytest.mark.parametrize("precision", ["float16", "float32"])
def test_any_part_can_be_drawn_alone(precision):
    precision, stratum = precision_named(precision), BY_NAME["any", 0.0]
    whole = drawn(stratum, precision, count=300)
    part = drawn(stratum, precision, start=100, count=50)
    assert all(np.array_equal(v[:, 100:150], w) for v, w in zip(whole, part, strict=True))


@pytest.mark.parametrize("key", [key for key in BY_NAME if key[0] != "any"], ids=str)
def test_lengths_are_as_wrong_as_the_stratum_says(key):
    for v in drawn(BY_NAME[key]):
        assert np.allclose(length(v), 1 + key[1], rtol=1e-12)


def test_any_length_is_from_a_thousandth_to_a_thousand():
    for v in drawn(BY_NAME["any", 0.0], FLOAT32):
        size = length(v)
        assert 0.99e-3 < size.min() < 2e-3
        assert 500 < size.max() < 1010
        assert abs(np.median(np.log10(size))) < 0.2
