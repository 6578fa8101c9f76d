"""Pictures as people see them: how far two pictures are apart."""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.support.image_files import codes, encoded, refuse_pixels

#: weights of luminance (ITU-R BT.709)
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True, slots=True)
class PictureError:
    """How far a picture is from another.

    max_abs, mean_abs  linear light, the worst channel of the worst pixel, and the mean over all; nothing limited to 1
    rms                linear light, root of the mean square
    psnr               decibels, of sRGB values as shown, 0 .. 1; infinity for equal pictures
    max_codes          8-bit sRGB codes, the worst channel
    visible            share of pixels of which some channel is off by a code or more
    flip               mean of FLIP, 0 .. 1, or None where flip-evaluator is not installed
    energy             ratio of the light in both, approximation over exact
    highlight_area     ratio of the pixels at least half as bright as the exact picture's brightest
    """

    max_abs: float
    mean_abs: float
    rms: float
    psnr: float
    max_codes: int
    visible: float
    flip: float | None
    energy: float
    highlight_area: float

    def as_dict(self) -> dict[str, Any]:
        """For JSON, where what is infinite is None: the PSNR of equal pictures, a ratio to nothing at all."""
        return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in asdict(self).items()}


def compare(exact: Array, other: Array, *, flip: bool = True) -> PictureError:
    """The error of a picture against the exact one; linear light, both (height, width, 3).

    flip  whether FLIP is asked for, which takes a second for a million pixels; None comes back without it
    Raises InputError for pictures of different shapes, and where one is not finite: then no error tells anything.
    """
    if exact.shape != other.shape or exact.ndim != 3 or exact.shape[2] != 3:
        raise InputError(f"pictures of shape {exact.shape} and {other.shape}", None, "both (height, width, 3)")
    for picture in (exact, other):
        refuse_pixels(~np.isfinite(picture), "are not finite")
    difference = np.abs(other.astype(np.float64) - exact)
    shown = (encoded(other.astype(np.float64)) - encoded(exact.astype(np.float64))) ** 2
    off = np.abs(codes(other).astype(np.int16) - codes(exact))
    mean_square = float(shown.mean())
    return PictureError(
        float(difference.max()),
        float(difference.mean()),
        math.sqrt(float((difference**2).mean())),
        -10 * math.log10(mean_square) if mean_square else math.inf,
        int(off.max()),
        float(off.any(axis=2).mean()),
        flip_error(exact, other) if flip else None,
        _ratio(other.sum(dtype=float), exact.sum(dtype=float)),
        _highlight_area(exact, other),
    )


def flip_error(exact: Array, other: Array) -> float | None:
    """The mean of FLIP (LDR, its own viewing conditions: 0.7 m from a 0.7 m wide 4K screen).

    None if flip-evaluator, extra `flip`, is not installed.
    """
    try:
        import flip_evaluator
    except ImportError:
        return None
    shown = [np.ascontiguousarray(encoded(picture), np.float32) for picture in (exact, other)]
    _, mean, _ = flip_evaluator.evaluate(*shown, "LDR", applyMagma=False)
    return float(mean)


def _highlight_area(exact: Array, other: Array) -> float:
    bright, others = exact @ _LUMINANCE, other @ _LUMINANCE
    half = bright.max() / 2
    return _ratio(float((others >= half).sum()), float((bright >= half).sum()))


def _ratio(above: float, below: float) -> float:
    if below == 0:
        return 1.0 if above == 0 else math.inf
    return float(above / below)
