"""A lobe's error is what its picture shows."""

import pytest

from phongbench.formulas.formula import Formula
from phongbench.scenes import picture_errors
from phongbench.scenes.scene_files import read_scene

LYON = [Formula.of("lyon", form, gamma) for form in ("dot", "cross") for gamma in (4, 16)]


@pytest.mark.parametrize("name", ["test-card", "chequerboard", "many-lights"])
def test_a_picture_is_off_by_no_more_than_its_lobes_promise(name: str) -> None:
    rows = picture_errors.compare(read_scene(name), [*LYON, Formula.of("gaussian", "dot")], size=(96, 54))
    for row in rows:
        assert row["left_out"] is None
        assert 0 < row["max_abs"] <= row["lobe_error"] * (1 + 1e-4) + 1e-5


def test_the_test_card_shows_the_lobes_error_itself() -> None:
    """One far light and no reflections: some pixel of some sphere sees the lobe at its worst angle."""
    rows = picture_errors.compare(read_scene("test-card"), LYON, size=(640, 360))
    for row in rows:
        assert row["max_abs"] == pytest.approx(row["lobe_error"], rel=0.01)
        assert row["visible"] > 0
        assert row["max_codes"] > 10


def test_a_formula_that_does_not_fit_the_scene_is_left_out_and_told() -> None:
    (row,) = picture_errors.compare(read_scene("chequerboard"), [Formula.of("integer-power")], size=(16, 9))
    assert "materials." in row["left_out"]
    assert "max_abs" not in row
