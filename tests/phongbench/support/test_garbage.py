"""Looking for cyclic garbage: seldom while it lasts, as before afterwards."""

import gc

import pytest

from phongbench.support.process import RARELY, seldom_collected


@seldom_collected()
def _failing() -> None:
    assert gc.get_threshold() == RARELY
    raise ZeroDivisionError


def test_thresholds_come_back_whatever_happens():
    before = gc.get_threshold()
    with pytest.raises(ZeroDivisionError):
        _failing()
    assert gc.get_threshold() == before


def test_a_decorated_function_runs_so_and_can_be_called_again():
    @seldom_collected()
    def inside() -> tuple[int, int, int]:
        return gc.get_threshold()

    before = gc.get_threshold()
    assert [inside(), inside()] == [RARELY, RARELY]
    assert gc.get_threshold() == before
