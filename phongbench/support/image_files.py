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
from phongbench.support.user_paths import check_file, reading

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


def decoded(values: Array) -> Array:
    """Linear light of sRGB values, both 0 .. 1."""
    steep = ((np.maximum(values, 12.92 * _LINEAR) + 0.055) / 1.055) ** 2.4
    return np.where(values <= 12.92 * _LINEAR, values / 12.92, steep)


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


def load(path: Path, *, linear: bool = False) -> Array:
    """A picture as linear light: (h, w) or (h, w, 3) in float64; of a .png 0 .. 1, its alpha left out.

    linear  whether the codes of a .png are linear already, not sRGB
    Raises InputError naming the file for what is no picture, or none of these kinds.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"a picture is not read from {suffix or 'a file without suffix'}", str(path), _KINDS)
    with reading(path, "picture", _KINDS):
        data = path.read_bytes()
    picture = {".png": _of_png, ".npy": _of_npy, ".exr": _of_exr}[suffix](path, data)
    if picture.size == 0 or picture.ndim not in (2, 3) or (picture.ndim == 3 and picture.shape[2] not in (1, 3)):
        raise InputError(f"a picture of shape {picture.shape}", str(path), "give (h, w), or (h, w, 3)")
    picture = picture[..., 0] if picture.ndim == 3 and picture.shape[2] == 1 else picture
    return decoded(picture) if suffix == ".png" and not linear else picture


def _of_png(path: Path, data: bytes) -> Array:
    """Codes over the largest one: 8 or 16 bits."""
    from PIL import Image

    try:
        with Image.open(BytesIO(data), formats=("PNG",)) as file:
            deep = file.mode.startswith("I")
            grey = file.mode in ("1", "L", "LA")
            picture = np.asarray(file if deep else file.convert("L" if grey else "RGB"))
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as problem:
        raise InputError(f"not a .png file: {problem}", str(path), "save it again") from problem
    return picture.astype(np.float64) / (65535 if deep else 255)


def _of_npy(path: Path, data: bytes) -> Array:
    try:
        array = np.load(BytesIO(data), allow_pickle=False)
    except (ValueError, EOFError, OSError, MemoryError) as problem:
        raise InputError(f"not a .npy file: {problem}", str(path), "write it by numpy.save") from problem
    if not isinstance(array, np.ndarray) or array.dtype.kind not in "fiu":
        raise InputError("not an array of numbers", str(path), "give float32 or float64")
    return array.astype(np.float64)


def _of_exr(path: Path, data: bytes) -> Array:
    """The channels RGB, or Y alone."""
    if find_spec("OpenEXR") is None:
        fix = "install it: pip install 'phongbench[scene]', or give .npy"
        raise InputError(".exr is read by OpenEXR, which is not installed", str(path), fix)
    import OpenEXR

    try:
        with OpenEXR.File(str(path)) as file:
            channels = {name: np.asarray(channel.pixels) for name, channel in file.channels().items()}
    except (RuntimeError, ValueError, OSError, TypeError) as problem:
        raise InputError(f"not an .exr file: {problem}", str(path), "save it again") from problem
    for name in ("RGB", "RGBA", "Y"):
        if name in channels:
            picture = channels[name].astype(np.float64)
            return picture[..., :3] if picture.ndim == 3 else picture
    raise InputError(f"channels {', '.join(channels)}", str(path), "give RGB, or Y")


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
#: what a picture may be written as, and read from
SUFFIXES = tuple(_AS)
_KINDS = f"use one of {', '.join(SUFFIXES)}"
