"""Random lines and pictures never crash, and every refusal names row, pixel or light."""

from pathlib import Path

import pytest
from soaking.inverse import Case, judged, soak

from phongbench.errors import InputError

#: `PYTHONPATH=tests/soak python -m soaking inverse` tries more
CASES = 400


def test_random_lines_and_pictures_are_answered_or_refused_by_their_place(tmp_path: Path) -> None:
    found = soak(CASES, 1, tmp_path)
    assert found.faults == []
    assert found.counts.total() == CASES
    kinds = {name.split(",")[0] for name in found.counts}
    assert kinds == {"line", "line file", "line request", "pictures", "shape", "surface"}
    assert found.counts == soak(CASES, 1, tmp_path).counts


def _raises(problem: Exception) -> None:
    raise problem


@pytest.mark.parametrize(
    ("problem", "place", "fault"),
    [
        (None, None, None),
        (None, "x[3]", "was answered"),
        (InputError("no", "x[3]"), "x[3]", None),
        (InputError("no", "x[2]"), "x[3]", "does not name x[3]"),
        (InputError("no"), "x[3]", "names no place"),
        (InputError("no", "x[3]"), None, "what can be was refused"),
        (ZeroDivisionError("no"), "x[3]", "ZeroDivisionError"),
    ],
)
def test_the_judge_sees_every_fault(problem: Exception | None, place: str | None, fault: str | None) -> None:
    case = Case("line", lambda: None if problem is None else _raises(problem), place)
    told = judged(case)[1]
    assert told is None if fault is None else fault in str(told)
