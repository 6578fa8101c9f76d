"""Pictures as people see them: sRGB codes, how far two pictures are apart, and files."""

import math
import os
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench import __version__
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError, StorageError
from phongbench.support.atomic_files import storage, write_bytes

#: light whose encoding is a straight line, and the weights of luminance (IEC 61966-2-1, ITU-R BT.709)
_LINEAR, _LUMINANCE = 0.0031308, np.array([0.2126, 0.7152, 0.0722])
#: gap between the pictures of a triple, in pixels, and its grey
_GAP, _GREY = 8, 128
#: of an EXR: what its numbers mean to who opens it, linear light of sRGB's primaries and white
_CHROMATICITIES = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
_INTEROP = "lin_rec709_scene"


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


def encoded(linear: Array) -> Array:
    """sRGB values of linear light, both 0 .. 1; what is outside is cut off."""
    light = np.clip(linear, 0.0, 1.0)
    low = 12.92 * light
    high = 1.055 * np.maximum(light, _LINEAR) ** (1 / 2.4) - 0.055
    return np.where(light <= _LINEAR, low, high).astype(np.asarray(linear).dtype)


def codes(linear: Array) -> NDArray[np.uint8]:
    """8-bit sRGB codes of linear light, rounded to the nearest."""
    return (255 * encoded(linear) + 0.5).astype(np.uint8)


def compare(exact: Array, other: Array, *, flip: bool = True) -> PictureError:
    """The error of a picture against the exact one; linear light, both (height, width, 3).

    flip  whether FLIP is asked for, which takes a second for a million pixels; None comes back without it
    Raises InputError for pictures of different shapes, and where one is not finite: then no error tells anything.
    """
    if exact.shape != other.shape or exact.ndim != 3 or exact.shape[2] != 3:
        raise InputError(f"pictures of shape {exact.shape} and {other.shape}", None, "both (height, width, 3)")
    for picture in (exact, other):
        _refuse(~np.isfinite(picture), "are not finite")
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


def _refuse(bad: NDArray[np.bool_], are: str) -> None:
    """Raise InputError, saying how many and which is the first, if some channel of some pixel is bad."""
    pixels = bad.any(axis=2)
    if pixels.any():
        row, column = (int(i) for i in np.argwhere(pixels)[0])
        what = f"{int(pixels.sum())} of {pixels.size} pixels {are}, the first in column {column} of row {row}"
        raise InputError(what, None, "a formula is not finite everywhere, or a light is brighter than any number")


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


def amplification(exact: Array, other: Array) -> float:
    """The power of two that makes the largest difference of shown values as bright as it can be without being cut."""
    largest = float(np.abs(encoded(other) - encoded(exact)).max())
    return 2.0 ** math.floor(-math.log2(largest)) if largest else 1.0


def triple(exact: Array, other: Array, factor: float | None = None) -> NDArray[np.uint8]:
    """Side by side: the exact picture, the other, and how far apart their shown values are, times `factor`.

    The difference is black where there is none; without a factor, `amplification` tells it.
    """
    factor = amplification(exact, other) if factor is None else factor
    difference = np.clip(factor * np.abs(encoded(other) - encoded(exact)), 0, 1)
    gap = np.full((exact.shape[0], _GAP, 3), _GREY, np.uint8)
    apart = (255 * difference + 0.5).astype(np.uint8)
    return np.concatenate([codes(exact), gap, codes(other), gap, apart], axis=1)


def check_writable(path: Path) -> None:
    """To be asked before a picture is drawn: raise what would keep it from being written.

    InputError for a suffix that no picture has, or an EXR without its library; StorageError for a folder's name, and
    for a place that cannot be written to.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        fix = f"use one of {', '.join(SUFFIXES)}"
        raise InputError(f"a picture is not written as {suffix or 'a file without suffix'}", str(path), fix)
    if suffix == ".exr" and find_spec("OpenEXR") is None:
        fix = "install it: pip install 'phongbench[scene]', or write .npy"
        raise InputError(".exr is written by OpenEXR, which is not installed", str(path), fix)
    with storage(path):
        if path.is_dir():
            raise StorageError("cannot write: it is a folder", str(path), "name a file in it")
        home = next(folder for folder in path.absolute().parents if folder.exists())
        if not (home.is_dir() and os.access(home, os.W_OK | os.X_OK)):
            raise StorageError(f"cannot write: nothing can be put into {home}", str(path), "choose another folder")


def save(path: Path, picture: Array) -> None:
    """Write a picture: .png as 8-bit sRGB, .npy and .exr as linear float32.

    picture  linear light, or codes (uint8), which .png takes as they are
    Raises InputError as `check_writable` does, and for pixels of a .png that are no numbers; StorageError if the disk
    refuses.
    """
    check_writable(path)
    data = _AS[path.suffix.lower()](picture)
    write_bytes(path, data)


def png(picture: Array) -> bytes:
    """A picture as the bytes of a PNG; linear light, or codes (uint8). InputError for light that is no number."""
    from PIL import Image

    _refuse(np.isnan(picture), "are no numbers")
    data = BytesIO()
    Image.fromarray(picture if picture.dtype == np.uint8 else codes(picture)).save(data, "PNG", optimize=False)
    return data.getvalue()


def exr(picture: Array) -> bytes:
    """A picture in linear light as the bytes of an OpenEXR file: channels R, G, B of float32, without loss.

    It is made in memory: the library's own writing to files tells a full disk by its words only.
    """
    import OpenEXR

    header = {
        "type": OpenEXR.scanlineimage,
        "compression": OpenEXR.ZIP_COMPRESSION,
        "chromaticities": _CHROMATICITIES,
        "colorInteropID": _INTEROP,
        "software": f"phongbench {__version__}",
    }
    data = BytesIO()
    with OpenEXR.File(header, {"RGB": np.ascontiguousarray(picture, np.float32)}) as file:
        file.write(data)
    return data.getvalue()


def npy(picture: Array) -> bytes:
    """A picture in linear light as the bytes of a .npy file of float32."""
    data = BytesIO()
    np.save(data, picture.astype(np.float32))
    return data.getvalue()


_AS = {".png": png, ".npy": npy, ".exr": exr}
#: what a picture may be written as
SUFFIXES = tuple(_AS)


def _highlight_area(exact: Array, other: Array) -> float:
    bright, others = exact @ _LUMINANCE, other @ _LUMINANCE
    half = bright.max() / 2
    return _ratio(float((others >= half).sum()), float((bright >= half).sum()))


def _ratio(above: float, below: float) -> float:
    if below == 0:
        return 1.0 if above == 0 else math.inf
    return float(above / below)
