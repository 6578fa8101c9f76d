"""Sections on pictures: absent without scenes, and true to the rows with them."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from phongbench.analysis.rows import Rows
from phongbench.results.schema import TABLES
from phongbench_reports.figures.pictures import SECTIONS, errors, lobe_law, saved
from phongbench_reports.plots import Plate, ink
from phongbench_reports.table import Absent, Table


def frame(name: str, rows: list[dict[str, Any]]) -> pd.DataFrame:
    return pd.DataFrame(rows).reindex(columns=TABLES[name].names)


def picture(scene: str, gamma: int, error: float, law: float, **more: Any) -> dict[str, Any]:
    return {
        "scene": scene,
        "width": 64,
        "height": 36,
        "depth": 3,
        "approximation": "lyon",
        "lambda_form": "dot",
        "beta_policy": "taylor",
        "gamma": gamma,
        "max_abs": error,
        "max_codes": np.round(255 * error),
        "visible": 0.25,
        "psnr": 50.0,
        "energy": 1.0,
        "highlight_area": 1.0,
        "lobe_max": law,
        **more,
    }


def skip(name: str, kind: str, skipped: int, change: float) -> dict[str, Any]:
    return {
        "scene": "card",
        "width": 64,
        "height": 36,
        "depth": 3,
        "name": name,
        "setting": np.nan,
        "kind": kind,
        "unit": "rays",
        "of": 100,
        "skipped": skipped,
        "bound": 2 * change,
        "same_bits": change == 0,
        "largest_change": change,
    }


def time(kind: str, name: str, ratio: float) -> dict[str, Any]:
    return {
        "scene": "card",
        "kind": kind,
        "name": name,
        "formula": name,
        "setting": np.nan,
        "against": "phong",
        "depth": 3,
        "elements": 2304,
        "rounds": 8,
        "seconds": 1.0,
        "ratio": ratio,
        "ratio_low": 0.9 * ratio,
        "ratio_high": 1.25 * ratio,
    }


@pytest.fixture
def study(made_up: Callable[..., Any], tmp_path: Path) -> Rows:
    bare = made_up(tmp_path, alphas=(50.0,), gammas=(8,), precisions=("float32",))
    rows = [
        picture("card", 8, 0.02, 0.02),
        picture("card", 16, 0.001, 0.01),
        picture("card", 4, np.nan, np.nan, left_out="materials.steel: alpha does not fit"),
    ]
    found = frame("scenes", rows).astype({"gamma": "Int64"})
    skips = frame(
        "skips",
        [
            skip("background", "exact", 40, 0.0),
            skip("dark_tail", "bounded", 10, 1e-3),
            skip("objects", "exact", 0, 0.0),
        ],
    )
    times = frame("scene_times", [time("formula", "lyon:dot:8", 0.5), time("skip", "background", 2.0)])
    return Rows(replace(bare, scenes=found, skips=skips, scene_times=times))


def test_without_scenes_every_section_says_how_to_get_them(made_up: Callable[..., Any], tmp_path: Path) -> None:
    bare = Rows(made_up(tmp_path, alphas=(50.0,), gammas=(8,), precisions=("float32",)))
    for part in SECTIONS:
        found = part.make(bare)
        assert isinstance(found, Absent)
        assert "--scenes" in found.fix


def test_the_law_is_drawn_for_every_picture_and_told_in_numbers(study: Rows) -> None:
    with ink():
        found = lobe_law(study)
    assert isinstance(found, Plate)
    assert list(found.data["share"]) == [0.1, 1.0]
    assert "No picture errs by more" in found.takeaway
    assert "1 of 2 pictures (card)" in found.takeaway


def test_a_formula_of_half_vectors_is_outside_the_law_whoever_wrote_it(study: Rows) -> None:
    """By the run's rows: lyon is measured in both spaces there, the user's own in half space only."""
    rows = pd.concat([study.run.scenes, frame("scenes", [picture("card", 8, 0.3, 0.1, approximation="halfway")])])
    swept = study.run.accuracy
    own = swept.iloc[:1].assign(approximation="halfway", space="half")
    run = replace(study.run, scenes=rows.astype({"gamma": "Int64"}), accuracy=pd.concat([swept, own]))  # type: ignore[type-var]
    with ink():
        found = lobe_law(Rows(run))
    assert isinstance(found, Plate)
    assert "No picture but those by halfway errs by more" in found.takeaway
    assert "1 of 2 pictures (card)" in found.takeaway


def test_a_picture_beyond_the_law_is_told(study: Rows) -> None:
    rows = study.run.scenes.assign(max_abs=[0.03, 0.001, np.nan])
    with ink():
        found = lobe_law(Rows(replace(study.run, scenes=rows)))  # type: ignore[type-var]
    assert isinstance(found, Plate)
    assert "1 of 2 pictures err by more" in found.takeaway


def test_a_row_a_picture_with_its_time_where_it_was_taken(study: Rows) -> None:
    found = errors(study)
    assert isinstance(found, Table)
    assert [row[1] for row in found.rows] == ["lyon:dot:16", "lyon:dot:8"]
    assert [row[-1] for row in found.rows] == ["–", "0.500 (0.450 to 0.625)"]
    assert "Of 2 pictures 1 are off by one 8-bit code at most" in found.takeaway


def test_skips_that_left_something_out_are_shown_and_times_are_turned(study: Rows) -> None:
    found = saved(study)
    assert isinstance(found, Table)
    assert [row[1] for row in found.rows] == ["background", "dark tail"]
    assert [row[4] for row in found.rows] == ["exact", "0.00200"]
    assert found.rows[0][-1] == "0.500 (0.400 to 0.556)"
    assert "2 of 2 exact skips" in found.takeaway
    assert len(found.data) == 3
