"""How a run's rows are cut: which times count, and which value is near."""

import math

import pandas as pd
import pytest

from phongbench.analysis import rows


def test_times_without_an_interval_do_not_count() -> None:
    """An end is missing, infinite or 0 where there were too few rounds."""
    times = pd.DataFrame(
        {
            "threads": 1,
            "ratio": 1.0,
            "ratio_low": [0.9, 0.0, 0.9, None, 0.9],
            "ratio_high": [1.1, 1.1, math.inf, 1.1, 1.1],
        }
        | {"lit": [math.nan] * 4 + [0.5]}
    )
    assert rows._certain(times)[["ratio_low", "ratio_high"]].to_numpy().tolist() == [[0.9, 1.1]]
    assert rows._certain(times.assign(threads=2)).empty
    assert len(rows._certain(times.drop(columns="lit"))) == 2


@pytest.mark.parametrize(("wanted", "found"), [(1.0, 4.0), (20.0, 16.0), (9.0, 16.0), (8.0, 4.0)])
def test_the_nearest_value_is_so_by_factors_and_the_smaller_of_two(wanted: float, found: float) -> None:
    assert rows.nearest([16.0, 4.0], wanted) == found


def test_of_two_gammas_equally_near_the_smaller_is_taken_and_without_any_all_rows() -> None:
    table = pd.DataFrame({"gamma": [4, 8, None]}).astype({"gamma": "Int64"})
    assert rows.near_gamma(table, 6)["gamma"].tolist() == [4]
    assert len(rows.near_gamma(table.iloc[2:], 6)) == 1
