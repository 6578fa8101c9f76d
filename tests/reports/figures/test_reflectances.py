"""The figures of reflectance: the front, and copper's colour."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from phongbench.analysis.rows import Rows
from phongbench.results.schema import TABLES
from phongbench_reports.figures import copper, incidence
from phongbench_reports.plots import Plate, ink
from phongbench_reports.table import Absent


def drawn(figure: Any, run: Any) -> Plate:
    with ink():
        plate = figure.draw(Rows(run))
    assert isinstance(plate, Plate)
    return plate


def test_coppers_curves_are_those_of_the_table(run: Any) -> None:
    plate = drawn(copper, run)
    exact = plate.data[plate.data["reflectance"] == "conductor"].set_index("incidence_degrees")
    for degrees, wanted in (
        (0, (0.9352, 0.6235, 0.5383)),
        (60, (0.9282, 0.6254, 0.5477)),
        (85, (0.9595, 0.8318, 0.7967)),
    ):
        assert exact.loc[degrees, ["red", "green", "blue"]].tolist() == pytest.approx(wanted, abs=1e-4)
    assert "0.576" in plate.takeaway  # .5383 / .9352
    assert "0.830" in plate.takeaway  # .7967 / .9595
    assert "118 codes" in plate.takeaway  # (1 - .5383) * 255


def test_a_strip_shows_what_white_light_becomes(run: Any) -> None:
    strips = drawn(copper, run).figure.axes[1].images[0].get_array()
    assert strips is not None
    assert strips.shape == (4, copper.ANGLES, 3)
    assert (strips[:3, -1] == 255).all()  # a mirror at 90 degrees
    assert (np.asarray(strips[3]) == np.asarray(strips[3][0])).all()  # but for the constant


def test_the_front_has_every_formula_that_can_tell_the_material(run: Any) -> None:
    plate = drawn(incidence, run)
    counts = plate.data.groupby("material")["reflectance"].nunique()
    assert counts.to_dict() == {"copper": 4, "glass": 5}
    assert "f82 (" in plate.takeaway
    assert len(plate.alt) > 80


def test_without_rows_it_says_what_would_give_them(run: Any) -> None:
    for name, fix in (("incidence", "probe incidence"), ("incidence_times", "--no-timing")):
        absent = incidence.draw(Rows(replace(run, **{name: TABLES[name].frame()})))
        assert isinstance(absent, Absent)
        assert fix in absent.fix


def test_no_speed_is_told_where_identical_code_differs(run: Any) -> None:
    twin = run.incidence_times[run.incidence_times["reflectance"] == "conductor"].assign(
        reflectance="conductor again", ratio_low=1.1, ratio_high=1.2
    )
    times = TABLES["incidence_times"].frame([*run.incidence_times.to_dict("records"), *twin.to_dict("records")])
    assert "no speed claim" in drawn(incidence, replace(run, incidence_times=times)).takeaway
