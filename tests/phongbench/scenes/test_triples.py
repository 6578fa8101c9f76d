"""Comparisons side by side: pictures as they are, differences on one scale, captions that are whole."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from PIL import Image

from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.scenes import triples
from phongbench.scenes.scene_files import read_scene
from phongbench.support import image_files

RNG = np.random.default_rng(5)
EXACT = RNG.random((30, 300, 3), np.float32)
OTHER = np.clip(EXACT + RNG.normal(0, 0.05, EXACT.shape), 0, 1).astype(np.float32)
PAPER = 255


def place_of(picture: np.ndarray, sheet: np.ndarray) -> tuple[int, int]:
    """Row and column where a picture stands in a larger one; the first where its top row matches."""
    tall, wide = picture.shape[:2]
    for row in range(sheet.shape[0] - tall + 1):
        for column in range(sheet.shape[1] - wide + 1):
            if np.array_equal(sheet[row, column : column + wide], picture[0]):
                return row, column
    raise AssertionError("the picture is not there")


def test_both_pictures_and_their_difference_stand_there_pixel_by_pixel() -> None:
    sheet = triples.triple(EXACT, OTHER, ("one", "two"))
    shown = [image_files.codes(EXACT), image_files.codes(OTHER), triples.shades(triples.difference(EXACT, OTHER))]
    places = [place_of(picture, sheet) for picture in shown]
    for (row, column), picture in zip(places, shown, strict=True):
        assert np.array_equal(sheet[row : row + 30, column : column + 300], picture)
    assert len({row for row, _ in places}) == 1
    assert [column for _, column in places] == sorted({column for _, column in places})


def test_a_difference_is_that_of_the_codes_shown_before_they_are_rounded() -> None:
    apart = triples.difference(EXACT, OTHER)
    rounded = np.abs(image_files.codes(EXACT).astype(int) - image_files.codes(OTHER)).max(axis=2)
    assert np.abs(apart - rounded).max() <= 1
    assert triples.difference(EXACT, EXACT).max() == 0


def test_one_difference_has_one_colour_in_every_picture_and_more_is_lighter() -> None:
    codes = np.geomspace(*triples.SCALE, 500)
    weights = np.array([0.2126, 0.7152, 0.0722])
    light = image_files.decoded(triples.shades(codes) / 255) @ weights
    assert (np.diff(light) >= -1e-3).all()  # rounding to codes may take one back
    assert light[-1] > 0.9
    assert triples.shades(np.array([0.0, triples.SCALE[0]])).max() == 0
    assert np.array_equal(triples.shades(codes)[7], triples.shades(codes[7:8])[0])


def test_the_ticks_stand_where_their_codes_are() -> None:
    at = np.array([float(Fraction(text)) for text in triples.TICKS])
    low, high = triples.SCALE
    places = np.log(at / low) / np.log(high / low)
    assert places.tolist() == pytest.approx(np.linspace(0, 1, len(at)).tolist())
    bar = triples.bar(601)[0]
    assert np.abs(bar[(600 * places).round().astype(int)].astype(int) - triples.shades(at)).max() <= 1


@pytest.mark.parametrize("size", [(1, 1), (3, 50), (40, 400)], ids=str)
def test_nothing_is_cut_however_small_the_pictures(size: tuple[int, int]) -> None:
    names = ("exact Phong", "a-name-that-is-longer-than-most:difference:32:minimax@lengthwise/once")
    sheet = triples.triple(np.zeros((*size, 3), np.float32), np.ones((*size, 3), np.float32), names)
    border = [sheet[0], sheet[-1], sheet[:, 0], sheet[:, -1]]
    assert all((edge == PAPER).all() for edge in border)


def test_the_caption_is_the_largest_difference_as_told(monkeypatch: pytest.MonkeyPatch) -> None:
    black, grey = np.zeros((2, 2, 3)), np.full((2, 2, 3), 0.2158605)
    said = [
        triples._told(image_files.codes(black), image_files.codes(other), triples.difference(black, other))
        for other in (black, black + 1e-5, black + 3.1e-4, grey)
    ]
    assert said == ["none", "less than one code", "at most 1 code of 255", "at most 128 codes of 255"]


def test_pictures_are_called_by_all_the_formulas_that_are_drawn() -> None:
    card, lyon = read_scene("test-card"), Formula.parse("lyon:dot:8")
    assert triples.names(card, lyon, "phong") == ("exact Phong", "lyon:dot:8")
    assert triples.names(card, Formula(), "blinn-phong") == ("exact Blinn-Phong", "phong")
    first, *others = card.materials
    for count, called in ((1, "gaussian:dot, lyon:dot:8"), (2, "3 formulas")):
        own = [replace(one, specular=Formula.parse(f"lyon:dot:{16 * n}")) for n, one in enumerate(others[1:count], 1)]
        mixed = replace(first, specular=Formula.parse("gaussian:dot")), *own, *others[count:]
        assert triples.names(replace(card, materials=tuple(mixed)), lyon, "phong")[1] == called


def test_light_that_is_no_number_is_refused_and_not_drawn() -> None:
    bad = EXACT.copy()
    bad[2, 3, 1] = np.nan
    for pair in ((bad, OTHER), (EXACT, bad)):
        with pytest.raises(InputError, match="1 of 9000 pixels are no numbers, the first in column 3 of row 2"):
            triples.triple(*pair, ("a", "b"))


def test_the_sheet_is_a_picture_that_a_png_takes() -> None:
    sheet = triples.triple(EXACT, OTHER, ("a", "b"))
    assert Image.fromarray(sheet).mode == "RGB"
