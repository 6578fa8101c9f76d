"""Pictures as files: linear light as sRGB codes in PNG, or as it is in npy and OpenEXR."""

from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench import __version__
from phongbench.errors import InputError
from phongbench.support.atomic_files import write_bytes
from phongbench.support.user_paths import check_file

Array = NDArray[Any]

#: light up to which the encoding is a straight line (IEC 61966-2-1)
_LINEAR = 0.0031308
#: of an EXR: what its numbers mean to who opens it, linear light of sRGB's primaries and white
_CHROMATICITIES = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
_INTEROP = "lin_rec709_scene"


def encoded(linear: Array) -> Array:
    """sRGB values of linear light, both 0 .. 1; what is outside is cut off."""
    light = np.clip(linear, 0.0, 1.0)
    low = 12.92 * light
    high = 1.055 * np.maximum(light, _LINEAR) ** (1 / 2.4) - 0.055
    return np.where(light <= _LINEAR, low, high).astype(np.asarray(linear).dtype)


def codes(linear: Array) -> NDArray[np.uint8]:
    """8-bit sRGB codes of linear light, rounded to the nearest."""
    return (255 * encoded(linear) + 0.5).astype(np.uint8)


def refuse_pixels(bad: NDArray[np.bool_], are: str) -> None:
    """Raise InputError, saying how many and which is the first, if some channel of some pixel is bad."""
    pixels = bad.any(axis=2)
    if pixels.any():
        row, column = (int(i) for i in np.argwhere(pixels)[0])
        what = f"{int(pixels.sum())} of {pixels.size} pixels {are}, the first in column {column} of row {row}"
        raise InputError(what, None, "a formula is not finite everywhere, or a light is brighter than any number")


def check_writable(path: Path) -> None:
    """To be asked before a picture is drawn: raise what would keep it from being written.

    InputError for a suffix that no picture has, an EXR without its library, and a name that no file can have;
    StorageError for a place that cannot be written to.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        fix = f"use one of {', '.join(SUFFIXES)}"
        raise InputError(f"a picture is not written as {suffix or 'a file without suffix'}", str(path), fix)
    if suffix == ".exr" and find_spec("OpenEXR") is None:
        fix = "install it: pip install 'phongbench[scene]', or write .npy"
        raise InputError(".exr is written by OpenEXR, which is not installed", str(path), fix)
    check_file(path)


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

    refuse_pixels(np.isnan(picture), "are no numbers")
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
