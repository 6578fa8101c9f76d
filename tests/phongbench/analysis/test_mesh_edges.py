"""How coarse a mesh may be: crossings of one code, read from rows."""

import numpy as np
import pandas as pd
import pytest

from phongbench.analysis.mesh_edges import CODE, in_words, reaches, widest_edge
from phongbench.results.records import Records


def test_a_crossing_lies_on_the_power_law_between_two_edges():
    edges = np.array([1.0, 2.0, 5.0, 10.0, 20.0])
    for power, scale in ((1, 0.3), (2, 0.05), (4, 0.001)):
        found, relation = widest_edge(edges.tolist(), (CODE * scale * edges**power).tolist())
        assert relation == "="
        assert found == pytest.approx(scale ** (-1 / power))


def test_the_first_crossing_counts_on_whatever_mesh():
    assert widest_edge([5.0, 2.0, 10.0], [2.0, 0.5, 0.1], 1.0)[0] == pytest.approx(2 * 2.5**0.5)
    assert widest_edge([5.0, 5.0, 2.0, 2.0], [0.5, 2.0, 0.1, 0.1], 1.0)[0] <= 5.0


def test_beyond_what_was_measured_only_bounds_are_told():
    assert widest_edge([2.0, 5.0], [2.0, 3.0], 1.0) == (2.0, "<")
    assert widest_edge([2.0, 5.0], [0.2, 1.0], 1.0) == (5.0, ">")  # at the limit is within it
    assert widest_edge([2.0, 5.0], [0.0, 10.0], 1.0)[1] == "="
    assert [in_words(2.0, "<"), in_words(5.04, ">"), in_words(9.161, "=")] == ["< 2°", "> 5°", "9.2°"]


def test_reaches_are_read_from_raw_lyon_rows_at_the_gamma_nearest_to_8():
    usual = {
        "approximation": "lyon",
        "truth": "interpolated",
        "normals": "raw",
        "alpha": 50.0,
        "lambda_form": "cross",
        "pair": "half",
        "gamma": 16,
        "edge_degrees": 1.0,
        "length_max": 0.1 * CODE,
    }
    others = [{"normals": "renormalised"}, {"truth": "surface"}, {"approximation": "gaussian"}, {"gamma": 64}]
    rows = [usual, usual | {"edge_degrees": 100.0, "length_max": 10 * CODE}]
    rows += [usual | other | {"length_max": 99.0} for other in others]
    found = reaches(Records.of(pd.DataFrame(rows)))
    assert len(found) == 1
    assert found[0]["degrees"] == pytest.approx(10.0)
    assert found[0]["gamma"] == 16
    assert reaches(Records.of(pd.DataFrame(rows[2:3]))) == []
