"""Figures of lobes, what they send where and where they are cut off, and of the normals got back with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from phongbench.analysis.rows import Rows, at
from phongbench.results.schema import TABLES
from phongbench_reports.figures import FIGURES, cut, spheres
from phongbench_reports.plots import Plate
from phongbench_reports.table import Absent
from phongbench_reports.text import number


def test_the_moments_of_lobes_are_told_with_what_the_horizon_leaves(plates: dict[str, Plate], study: Rows) -> None:
    plate = plates["moments"]
    assert set(plate.data["approximation"]) == {"phong", "lyon", "gaussian", "blinn", "schlick"}
    assert set(plate.data["gamma"].dropna()) == {8}
    assert "lyon:dot:8 0.8" in plate.takeaway or "lyon:dot:8 0.9" in plate.takeaway
    # made up: the horizon takes the cosine of the incidence from every lobe
    assert plate.takeaway.endswith("the horizon leaves 1.75\xa0% of phong's and 1.75\xa0% of blinn's.")


def test_the_cut_is_told_at_the_first_and_last_exponent_where_it_shows(plates: dict[str, Plate]) -> None:
    takeaway = plates["cut"].takeaway
    assert "170 codes at α\xa0=\xa00.1" in takeaway
    assert "4.46 at α\xa0=\xa01" in takeaway
    assert "gaussian:dot is cut visibly up to α\xa0=\xa05" in takeaway


def test_the_sphere_of_phong_is_dark_where_that_of_the_half_vector_fades() -> None:
    by_angle, by_half = (spheres.sphere(make(cut.ALPHA)) for make in (cut.phong, cut.half_vector))
    middle, edge = spheres.ACROSS // 2, int(spheres.ACROSS * (1 + 0.8 * spheres.RADIUS) / 2)
    np.testing.assert_allclose(by_angle[middle, middle], by_half[middle, middle], atol=0.01)
    without = spheres.sphere(np.zeros_like)
    np.testing.assert_array_equal(by_angle[middle, edge], without[middle, edge])
    assert (by_half[middle, edge] > without[middle, edge] + 0.2).all()


def test_normals_are_told_with_their_mean_and_largest_error(plates: dict[str, Plate], study: Rows) -> None:
    plate = plates["inverse"]
    row = at(study.inverse, approximation="schlick", alpha=50.0).iloc[0]
    assert f"schlick {number(row['mean_degrees'])}° ({number(row['max_degrees'])}°)" in plate.takeaway
    assert "no highlight" in plate.takeaway
    assert len(plate.data) == 5 * study.inverse["alpha"].nunique()
    bare = Rows(replace(study.run, inverse=TABLES["inverse"].frame()))
    absent = next(part for part in FIGURES if part.name == "inverse").make(bare)
    assert isinstance(absent, Absent)
    assert "--probe inverse" in absent.fix


@pytest.mark.parametrize("name", ["moments", "cut"])
def test_a_run_without_lobes_says_which_probe_gives_them(name: str, study: Rows) -> None:
    bare = Rows(replace(study.run, moments=TABLES["moments"].frame(), cuts=TABLES["cuts"].frame()))
    [part] = [figure for figure in FIGURES if figure.name == name]
    absent = part.make(bare)
    assert isinstance(absent, Absent)
    assert "--probe lobes" in absent.fix
