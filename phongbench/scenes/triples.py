"""Two pictures and how far they are apart, side by side, with captions: what `--compare` writes.

Differences of all pictures share one scale, so that two of them can be laid beside each other: a colour for codes of
255 between SCALE's ends, by their logarithm.
"""

import math
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler.precisions import Array
from phongbench.formulas.formula import Formula, Registry
from phongbench.formulas.registry import REGISTRY
from phongbench.scenes.scene import Scene
from phongbench.support.image_files import codes, encoded, refuse_pixels

#: codes of 255 from which on a difference is shown, and those that are shown brightest; ticks of the scale
SCALE, TICKS = (1 / 16, 256.0), ("1/16", "1/4", "1", "4", "16", "64", "256")
#: sRGB codes along the scale, in equal steps: ever lighter, so that it is read without seeing hues too
_ANCHORS = np.array(
    [(0, 0, 0), (34, 18, 84), (92, 26, 120), (160, 44, 104), (219, 83, 62), (250, 155, 40), (252, 255, 200)]
)
#: in pixels: between pictures and around text, the height of a letter, of the scale's bar; paper and ink
_GAP, _LETTER, _BAR, _PAPER, _INK = 8, 12, 10, 255, 27

Codes = NDArray[np.uint8]


def difference(exact: Array, other: Array) -> Array:
    """How far the shown values of two pictures are apart: codes of 255, the worst channel; (height, width)."""
    return np.asarray(255.0 * np.abs(encoded(other).astype(float) - encoded(exact)).max(axis=2))


def shades(apart: Array) -> Codes:
    """The colours of differences, in codes of 255; black up to the scale's lower end; (..., 3)."""
    low, high = SCALE
    place = np.log(np.clip(apart, low, high) / low) / math.log(high / low) * (len(_ANCHORS) - 1)
    steps = np.arange(len(_ANCHORS))
    return np.stack([np.interp(place, steps, _ANCHORS[:, k]) + 0.5 for k in range(3)], axis=-1).astype(np.uint8)


def bar(width: int, height: int = 1) -> Codes:
    """The scale from its lower to its upper end, (height, width, 3)."""
    low, high = SCALE
    return np.broadcast_to(shades(low * (high / low) ** np.linspace(0, 1, width)), (height, width, 3)).copy()


def names(scene: Scene, formula: Formula, model: str, registry: Registry = REGISTRY) -> tuple[str, str]:
    """What the two pictures of a comparison show: exact Phong, or exact Blinn-Phong, and the formulas drawn beside it.

    formula  that of materials that name none
    """
    drawn = dict.fromkeys((material.specular or formula).spelled(registry) for material in scene.materials)
    exact = "exact Phong" if model == "phong" else "exact Blinn-Phong"
    return exact, ", ".join(drawn) if 0 < len(drawn) <= 2 else f"{len(drawn)} formulas"


def triple(exact: Array, other: Array, names: Sequence[str]) -> Codes:
    """The exact picture, the other and their difference in a row, a caption above each and the scale below the last.

    names  what the first and the second show
    A column is as wide as its picture or, if that is wider, its caption. InputError where light is no number.
    """
    from PIL import Image, ImageDraw

    for picture in (exact, other):
        refuse_pixels(np.isnan(picture), "are no numbers")
    first, second, apart = codes(exact), codes(other), difference(exact, other)
    pictures = [first, second, shades(apart)]
    captions = [*names, f"difference: {_told(first, second, apart)}"]
    tall, wide = apart.shape
    least = _least_bar()
    widths = [max(wide, math.ceil(_font().getlength(text)), least * (k == 2)) for k, text in enumerate(captions)]
    above, below = 2 * _GAP + _LETTER, 3 * _GAP + _BAR + _LETTER
    sheet = Image.new("RGB", (sum(widths) + 4 * _GAP, above + tall + below), (_PAPER,) * 3)
    pen, left = ImageDraw.Draw(sheet), _GAP
    for picture, caption, width in zip(pictures, captions, widths, strict=True):
        pen.text((left, _GAP), caption, fill=(_INK,) * 3, font=_font())
        sheet.paste(Image.fromarray(picture), (left, above))
        left += width + _GAP
    _scale(sheet, pen, left - widths[2] - _GAP, above + tall + _GAP, max(wide, least))
    return np.asarray(sheet)


def _scale(sheet: Any, pen: Any, left: int, top: int, width: int) -> None:
    """Draw the scale with its ticks; the first and the last stay within it."""
    from PIL import Image

    sheet.paste(Image.fromarray(bar(width, _BAR)), (left, top))
    for number, text in enumerate(TICKS):
        share, long = number / (len(TICKS) - 1), _font().getlength(text)
        pen.text((left + share * (width - long), top + _BAR + _GAP // 2), text, fill=(_INK,) * 3, font=_font())


def _least_bar() -> int:
    """The least width of the scale at which its ticks stand apart."""
    return int(np.ceil(sum(_font().getlength(text) + _GAP for text in TICKS))) + 4 * _GAP


@cache
def _font() -> Any:
    from PIL import ImageFont

    return ImageFont.load_default(_LETTER)


def _told(exact: Codes, other: Codes, apart: Array) -> str:
    """How far two pictures are apart at most, in the whole codes that a screen is sent, as `compare` tells it."""
    most = int(np.abs(exact.astype(int) - other).max(initial=0))
    if most == 0:
        return "less than one code" if apart.any() else "none"
    return f"at most {most} code{'s' * (most > 1)} of 255"
