"""Figures made of pictures."""

import io
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from phongbench_reports.figures import scene_images

#: as they are drawn, but for one whose four pictures would take a sixth of all tests of reports
FIGURES = {**scene_images.FIGURES, "depths.png": partial(scene_images.depths, size=(96, 54))}


@pytest.mark.parametrize("draw", FIGURES.values(), ids=FIGURES)
def test_every_figure_is_a_picture(draw: object) -> None:
    assert callable(draw)
    with Image.open(io.BytesIO(scene_images.png(draw()))) as picture:
        assert picture.format == "PNG"
        assert picture.size[0] == round(9.2 * scene_images.DPI)
        assert len(picture.convert("L").getcolors() or []) > 50


def test_the_same_pictures_give_the_same_bytes() -> None:
    assert scene_images.png(scene_images.interpolation((44.0,))) == scene_images.png(
        scene_images.interpolation((44.0,))
    )


def test_figures_are_written_where_asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = scene_images.Sheet([np.zeros((2, 3, 3), np.uint8)], ["black"], 1, "nothing")
    monkeypatch.setattr(scene_images, "FIGURES", {"one.png": lambda: one})
    assert scene_images.write(tmp_path / "new") == [tmp_path / "new" / "one.png"]
    assert (tmp_path / "new" / "one.png").read_bytes() == scene_images.png(one)
