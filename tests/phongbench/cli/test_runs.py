"""Two runs beside one another, as people read them."""

import pytest

from phongbench.cli.runs import _times

KERNEL = {"name": "lyon:dot:8", "precision": "float32", "working_set": "l1", "before": 0.5, "after": 0.25}
KERNEL |= {"ratio": 0.5, "ratio_low": 0.49, "ratio_high": 0.51}


@pytest.mark.parametrize(("verdict", "changed"), [("faster", 1), ("unresolved", 0)])
def test_only_kernels_whose_times_changed_make_a_table(
    capsys: pytest.CaptureFixture[str], verdict: str, changed: int
) -> None:
    _times({"why_not": None, "rows": [KERNEL | {"verdict": verdict}]})
    said = capsys.readouterr().out
    assert ("lyon:dot:8" in said) == ("98 % interval  " in said) == bool(changed)
    assert f"times: {changed} of 1 kernels changed" in said


def test_times_that_are_not_compared_say_why(capsys: pytest.CaptureFixture[str]) -> None:
    _times({"why_not": "other machines", "rows": []})
    assert capsys.readouterr().out == "times are not compared: other machines\n"
