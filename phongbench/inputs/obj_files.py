"""Triangle meshes from Wavefront OBJ files: what is odd in them is refused or repaired, and counted."""

import io
import math
import warnings
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.inputs.meshes import Surface, area_weighted_normals, solid, unit

#: the largest coordinate may be this, or one over it: squares of areas stay finite
LARGEST = 1e60
_EXAMPLE = "give a Wavefront OBJ file with vertices (v) and faces (f)"


def load(path: str | Path) -> Surface:
    """The triangles of an OBJ file.

    Polygons are cut into triangles, degenerate ones left out. Normals of the file are made unit length; where it has
    none, or a zero one, the area-weighted mean of the triangles at that place is taken. All of this is counted, and
    told in `notes`. Materials and textures are not looked at.

    Raises InputError, naming the file and how to fix it: absent or unreadable, no faces, faces that name vertices that
    are not there, coordinates that are not finite, only degenerate triangles; or trimesh (extra `scene`) is missing.
    """
    path = Path(path)
    try:
        facts = path.stat()
    except OSError as problem:
        raise InputError(f"cannot read the mesh: {problem.strerror}", str(path), _EXAMPLE) from problem
    return _load(path, facts.st_mtime_ns, facts.st_size)


@lru_cache(maxsize=8)
def _load(path: Path, changed: int, size: int) -> Surface:
    """`load` of a file in this state: a study checks its meshes when it starts, and measures them later."""
    lines = _read(path)
    corners = _checked(path, lines)
    vertices, faces, given = _parsed(path, lines)
    if len(faces) != sum(corners) - 2 * len(corners):
        what = f"trimesh made {len(faces)} triangles of {len(corners)} faces, which cannot be"
        raise InputError(what, str(path), "export the mesh again")
    notes = []
    if polygons := sum(n > 3 for n in corners):
        notes.append(f"polygons cut into triangles: {polygons}")
    kept = solid(vertices, faces)
    if not len(kept):
        raise InputError("every triangle of the mesh is degenerate", str(path), "export it again, with an area")
    if left_out := len(faces) - len(kept):
        notes.append(f"degenerate triangles left out: {left_out}")
    normals = area_weighted_normals(vertices, kept)
    if given is None:
        some = any(line.startswith("vn ") for line in lines)
        told = "its normals do not fit its faces" if some else "it has no normals"
        notes.append(f"{told}: area-weighted ones are used")
    else:
        usable = np.isfinite(given).all(axis=1) & (np.abs(given).max(axis=1) > 0)
        normals[usable] = unit(given[usable] / np.abs(given[usable]).max(axis=1, keepdims=True))
        if missing := int((~usable[np.unique(kept)]).sum()):
            notes.append(f"normals that are zero or not finite, replaced by area-weighted ones: {missing}")
    return Surface(path.name, vertices, normals, kept, tuple(notes), left_out)


def _read(path: Path) -> list[str]:
    """The lines of an OBJ without comments, one blank between words; a continued line is joined to its first."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as problem:
        raise InputError(f"cannot read the mesh: {problem.strerror}", str(path), _EXAMPLE) from problem
    except UnicodeDecodeError as problem:
        raise InputError("the mesh is not a text file", str(path), _EXAMPLE) from problem
    return [" ".join(line.split("#", 1)[0].split()) for line in text.replace("\\\n", " ").splitlines()]


def _checked(path: Path, lines: list[str]) -> list[int]:
    """Corners of each face; InputError names the first line that trimesh would misread, or give up on."""
    points, seen, corners = sum(line.startswith("v ") for line in lines), 0, []
    for number, line in enumerate(lines, 1):
        kind, *words = line.split(" ")
        wrong = None
        if kind == "v":
            seen += 1
            wrong = None if _finite(words) else "a vertex is three finite numbers"
        elif kind == "f":
            corners.append(len(words))
            wrong = "a face has three corners or more" if len(words) < 3 else _stray(words, points, seen)
        if wrong:
            raise InputError(f"{wrong}, not {line!r}", f"{path}:{number}", "repair the line, or export the mesh again")
    if not corners:
        raise InputError("the mesh has no faces", str(path), "export it with faces, not as a cloud of points")
    return corners


def _finite(words: list[str]) -> bool:
    try:
        return len(words) >= 3 and all(math.isfinite(float(word)) for word in words[:3])
    except ValueError:
        return False


def _stray(words: list[str], points: int, seen: int) -> str | None:
    """What is wrong with the corners of a face, of which `seen` of all vertices have been defined so far."""
    try:
        indices = [int(word.split("/", 1)[0]) for word in words]
    except ValueError:
        return "a corner is the number of a vertex"
    if not all(1 <= abs(index) <= points for index in indices):
        return f"a face names its vertices by 1 to {points}"
    if seen < points and min(indices) < 0:
        return "only after the last vertex are numbers counted from the end understood"
    return None


def _parsed(path: Path, lines: list[str]) -> tuple[Array, NDArray[np.int64], Array | None]:
    """Vertices, triangles and normals (None without) of an OBJ, by trimesh; vertices are split where normals differ."""
    try:
        from trimesh.exchange.obj import load_obj
    except ImportError as problem:
        fix = "install it: pip install 'phongbench[scene]'"
        raise InputError("meshes are read by trimesh, which is not installed", str(path), fix) from problem
    vertices, faces, normals, shift = [], [], [], 0
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # NumPy only warns of what is not a number
            found = load_obj(io.StringIO("\n".join(lines)), skip_materials=True, group_material=False)
        for part in found["geometry"].values():
            vertices.append(np.asarray(part["vertices"], np.float64).reshape(-1, 3))
            faces.append(_fans(np.asarray(part["faces"], np.int64)) + shift)
            normals.append(part.get("vertex_normals"))
            shift += len(vertices[-1])
        points, triangles = np.concatenate(vertices), np.concatenate(faces)
    except Exception as problem:  # whatever a parser raises on a broken file
        what = f"trimesh cannot read the mesh: {type(problem).__name__}: {problem}"
        raise InputError(what, str(path), _EXAMPLE) from problem
    if not 1 / LARGEST < (size := float(np.abs(points).max())) < LARGEST:
        raise InputError(f"the mesh's largest coordinate is {size:g}", str(path), "scale it to about 1")
    given = [
        np.full_like(v, np.nan) if n is None else np.asarray(n, np.float64)
        for v, n in zip(vertices, normals, strict=True)
    ]
    return points, triangles, None if all(n is None for n in normals) else np.concatenate(given)


def _fans(polygons: NDArray[np.int64]) -> NDArray[np.int64]:
    """(m, k) polygons as (m (k - 2), 3) triangles around their first corner."""
    triangles = [polygons[:, [0, i, i + 1]] for i in range(1, polygons.shape[1] - 1)]
    return np.stack(triangles, axis=1).reshape(-1, 3)
