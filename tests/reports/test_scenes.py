"""Figures made of pictures."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from phongbench_reports import scenes


@pytest.mark.parametrize("draw", scenes.FIGURES.values(), ids=scenes.FIGURES)
def test_every_figure_is_a_picture(draw: object) -> None:
    assert callable(draw)
    with Image.open(io.BytesIO(scenes.png(draw()))) as picture:
        assert picture.format == "PNG"
        assert picture.size[0] == round(9.2 * scenes.DPI)
        assert len(picture.convert("L").getcolors() or []) > 50


def test_the_same_pictures_give_the_same_bytes() -> None:
    assert scenes.png(scenes.interpolation((44.0,))) == scenes.png(scenes.interpolation((44.0,)))


def test_figures_are_written_where_asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = scenes.Sheet([np.zeros((2, 3, 3), np.uint8)], ["black"], 1, "nothing")
    monkeypatch.setattr(scenes, "FIGURES", {"one.png": lambda: one})
    assert scenes.write(tmp_path / "new") == [tmp_path / "new" / "one.png"]
    assert (tmp_path / "new" / "one.png").read_bytes() == scenes.png(one)
