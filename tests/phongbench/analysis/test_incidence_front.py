"""The front of reflectances: the worst channel against time, and no time told where identical code differs."""

from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest

from phongbench.analysis import incidence_front
from phongbench.analysis.rows import Rows
from phongbench.results.schema import INCIDENCE, INCIDENCE_TIMES

#: reflectance -> (largest errors of the channels, time over the exact one's)
MEASURED = {
    "constant": ((0.2, 0.5), 0.1),
    "schlick": ((0.01, 0.04), 0.2),
    "f82": ((0.01, 0.002), 0.3),
    "schlick-exp2": ((0.05, 0.01), 0.4),
    "conductor": ((1e-7, 2e-7), 1.0),
}


def rows_of(twin: float = 1.0, precision: str = "float32") -> Rows:
    errors = [
        {"material": material, "reflectance": name, "precision": precision, "channel": channel, "samples": 9}
        | {"max_abs": error, "worst_degrees": 80.0, "within_degrees": 40.0, "mean_abs": error / 4}
        for material in ("copper", "glass")
        for name, (both, _) in MEASURED.items()
        for channel, error in zip(("red", "blue"), both, strict=True)
    ]
    times: list[dict[str, Any]] = [
        {
            "reflectance": name,
            "precision": precision,
            "against": "conductor",
            "elements": 2048,
            "rounds": 9,
            "ns": ratio,
        }
        | {"ratio": ratio, "ratio_low": 0.95 * ratio, "ratio_high": 1.04 * ratio}
        for name, ratio in [(name, ratio) for name, (_, ratio) in MEASURED.items()] + [("conductor again", twin)]
    ]
    complete = pd.DataFrame(errors).reindex(columns=INCIDENCE.names), pd.DataFrame(times)
    run = SimpleNamespace(
        manifest={},
        accuracy=pd.DataFrame({"precision": ["float32"], "alpha": [50.0]}),
        incidence=complete[0],
        incidence_times=complete[1][INCIDENCE_TIMES.names],
    )
    return Rows(run)


def test_a_point_is_the_worst_channel_against_the_time_over_the_exact_one() -> None:
    points = incidence_front.points(rows_of(), "copper").set_index("reflectance")
    assert list(points.index) == ["constant", "schlick", "f82", "schlick-exp2", "conductor"]
    assert points["error"].tolist() == [0.5, 0.04, 0.01, 0.05, 2e-7]
    assert points["state"].to_dict() == {
        "constant": "on",
        "schlick": "on",
        "f82": "on",
        "schlick-exp2": "off",
        "conductor": "on",
    }


def test_a_material_is_compared_with_its_own_exact_formula() -> None:
    assert incidence_front.points(rows_of(), "glass").empty  # nothing here was timed against the dielectric


def test_a_twin_that_is_told_apart_is_noticed() -> None:
    assert not incidence_front.twin_differs(rows_of())
    assert incidence_front.twin_differs(rows_of(twin=1.2))


@pytest.mark.parametrize(("precision", "judged"), [("float32", "float32"), ("float64", "float32")])
def test_reflectances_are_judged_at_the_precision_of_the_others_or_float32(precision: str, judged: str) -> None:
    assert rows_of(precision=precision).incidence_precision == judged
