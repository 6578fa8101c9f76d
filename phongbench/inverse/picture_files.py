"""Pictures, lights and masks of photometric stereo as files; normals and heights as files.

Normals are written as .npy and .exr (h, w, 3), NaN outside the mask, and as the usual normal map in .png: x right, y up
and z to the viewer as red, green and blue, -1 .. 1 as 0 .. 255, grey where nothing is known.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.inverse.photometric import Normals, invert_pictures
from phongbench.inverse.surface_model import PhotometricLight, SurfaceModel
from phongbench.support import image_files
from phongbench.support.atomic_files import write_text, write_whole
from phongbench.support.documents import load
from phongbench.support.user_paths import check_file

_EXAMPLE = 'e.g. {"lights": [{"direction": [0.3, 0, 1]}, ..]}'


def read_lights(path: Path) -> tuple[PhotometricLight, ...]:
    """The lights of a JSON file: {"lights": [{"direction": [x, y, z], "intensity": 1}, ..]}, towards each light.

    Directions are made unit. InputError naming the light.
    """
    top = load(path, "file of lights", _EXAMPLE)
    lights = []
    for one in top.tables("lights"):
        towards, intensity = one.numbers("direction", 3), one.number("intensity", 1.0)
        one.finish()
        lights.append(PhotometricLight.of(towards, intensity, one.where()))
    top.finish()
    return tuple(lights)


def read_grey(path: Path, linear: bool = False) -> Array:
    """A picture as one intensity a pixel (h, w): the mean of its channels in linear light."""
    picture = image_files.load(path, linear=linear)
    return np.asarray(picture.mean(axis=2)) if picture.ndim == 3 else picture


def read_mask(path: Path) -> Array:
    """A mask (h, w): True where the picture is not black."""
    return read_grey(path, linear=True) > 0


def invert_files(
    paths: Sequence[Path],
    lights: Path,
    model: SurfaceModel,
    *,
    mask: Path | None = None,
    linear: bool = False,
    **options: Any,
) -> Normals:
    """`invert_pictures` of files; errors name them.

    linear   whether .png holds linear codes; else sRGB
    options  of `invert_pictures`; `saturation` is the largest code of .png, unless it is given
    """
    known = read_lights(lights)
    if len(paths) < 3:
        raise InputError(f"{len(paths)} pictures", ", ".join(map(str, paths)) or None, "a normal needs 3 or more")
    if len(known) != len(paths):
        raise InputError(f"{len(known)} lights for {len(paths)} pictures", str(lights), "give one for each, in order")
    pictures = [read_grey(path, linear) for path in paths]
    for path, picture in zip(paths, pictures, strict=True):
        if picture.shape != pictures[0].shape:
            (h, w), (rows, columns) = picture.shape, pictures[0].shape
            raise InputError(f"{w} x {h} pixels, but {paths[0]} has {columns} x {rows}", str(path), "give one size")
    inside = None if mask is None else read_mask(mask)
    if inside is not None and inside.shape != pictures[0].shape:
        (h, w), (rows, columns) = inside.shape, pictures[0].shape
        raise InputError(f"{w} x {h} pixels, but the pictures have {columns} x {rows}", str(mask), "give their size")
    if options.get("saturation") is None:
        options["saturation"] = 1.0 if all(path.suffix.lower() == ".png" for path in paths) else np.inf
    try:
        return invert_pictures(np.stack(pictures), known, model, mask=inside, **options)
    except InputError as problem:
        problem.where = _named(problem.where, paths, lights)
        raise


def _named(where: str | None, paths: Sequence[Path], lights: Path) -> str | None:
    """pictures[2] as that file, lights[2] with theirs."""
    if where is not None and where.startswith("pictures["):
        return str(paths[int(where.removeprefix("pictures[").rstrip("]"))])
    return f"{lights}: {where}" if where is not None and where.startswith("lights") else where


def save_normals(normals: Array, path: Path) -> None:
    """Write normals as .npy, .exr, or a normal map in .png."""
    image_files.save(path, normal_map(normals) if path.suffix.lower() == ".png" else normals)


def normal_map(normals: Array) -> Array:
    """Codes (h, w, 3) of normals: -1 .. 1 as 0 .. 255; 128, 128, 128 where they are NaN."""
    known = np.nan_to_num(normals, nan=0.0)
    return np.asarray(np.floor(np.clip(known, -1, 1) * 127.5 + 128).clip(0, 255), np.uint8)


def check_heights(path: Path) -> None:
    """To be asked before long work: InputError unless heights can be written there, as .npy or .obj."""
    if path.suffix.lower() not in (".npy", ".obj"):
        raise InputError(f"heights are not written as {path.suffix or path.name}", str(path), "use .npy or .obj")
    check_file(path)


def save_heights(heights: Array, path: Path) -> None:
    """Write heights (h, w): .npy with NaN where there are none, or .obj with a vertex a pixel."""
    check_heights(path)
    if path.suffix.lower() == ".npy":
        image_files.save(path, heights)
    else:
        write_whole(path, lambda temporary: write_text(temporary, obj_of(heights)))


def obj_of(heights: Array) -> str:
    """Heights as an OBJ: x right in columns, y up, z the height; two triangles where four neighbours are known."""
    known = np.isfinite(heights)
    numbers = np.zeros(heights.shape, np.int64)
    numbers[known] = np.arange(1, known.sum() + 1)
    row, column = np.nonzero(known)
    points = np.column_stack([column, heights.shape[0] - 1 - row, heights[known]])
    a, b, c, d = numbers[:-1, :-1], numbers[1:, :-1], numbers[1:, 1:], numbers[:-1, 1:]
    whole = (a > 0) & (b > 0) & (c > 0) & (d > 0)
    faces = np.stack([np.stack([a, b, c], -1)[whole], np.stack([a, c, d], -1)[whole]], axis=1).reshape(-1, 3)
    lines = ["# heights from normals: x right, y up, z to the viewer; a pixel is 1"]
    lines += [f"v {x:g} {y:g} {z:.9g}" for x, y, z in points.tolist()]
    lines += [f"f {one} {two} {three}" for one, two, three in faces.tolist()]
    return "\n".join(lines) + "\n"
