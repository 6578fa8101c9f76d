"""The table of predicted times: a line for each preset and number of cores, in units that people read."""

import pytest

from phongbench.inputs.plan import Plan
from phongbench.study.forecast import Forecast
from phongbench_reports.readme import scale_part


class MadeUpTrial:
    def on(self, jobs: int, cluster: int | None = None) -> Forecast:
        seconds = {"accuracy": 360_000.0 / (cluster or 1), "stability": 90.0, "timing": 30.0}
        return Forecast(1, 1, 1, 1, seconds, "measuring" if (cluster or 1) < 4096 else "probes")


def test_each_preset_has_a_line_for_each_number_of_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    def tried(plan: Plan) -> MadeUpTrial:
        asked.append(plan.preset)
        return MadeUpTrial()

    monkeypatch.setattr(scale_part.forecast, "tried", tried)
    lines = [line.strip("| ").split(" | ") for line in scale_part.predicted().splitlines()[2:10]]
    assert asked == ["standard", "full"]
    assert [line[:2] for line in lines] == [[name, n] for name in asked for n in ("1", "16", "256", "4096")]
    assert lines[0][2:] == ["4.2 d", "1.5 min", "30 s", "4.2 d", "measuring"]
    assert lines[3][2:] == ["1.5 min", "1.5 min", "30 s", "3.5 min", "probes"]
