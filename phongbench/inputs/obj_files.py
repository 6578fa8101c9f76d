"""Triangle meshes from Wavefront OBJ files: what is odd in them is refused with its line, or repaired and told."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.inputs import polygons
from phongbench.inputs.meshes import Surface, area_weighted_normals, have_area, unit
from phongbench.inputs.obj_lines import EXAMPLE, FACE, NORMAL, VERTEX, Indices, ObjLines
from phongbench.inputs.wavefront_text import Notes, name
from phongbench.support.user_paths import reading

#: the largest coordinate may be this, or one over it: squares of areas stay finite
LARGEST = 1e60
#: keywords that change no picture here
_SILENT = set(b"g o mg lod maplib usemap shadow_obj trace_obj bevel c_interp d_interp".split())
_LOST = {b"l": "lines are not drawn", b"p": "points are not drawn"}
_CURVES = b"vp cstype deg bmat step curv curv2 surf parm trim hole scrv sp end con bzp bsp cdc cdp res"
_LOST |= dict.fromkeys(_CURVES.split(), "curves and curved surfaces are not drawn")


@dataclass(frozen=True, eq=False)
class ObjFile:
    """The triangles of an OBJ file, and the materials that it names for them.

    libraries  the text of each mtllib line: one MTL file's name, or several
    materials  the texts of usemtl lines, each once with its first line: a name, perhaps with a comment
    worn       int64 (m,)  which of these each triangle wears; -1 for none
    bare       line of the first face without a material; None if there is none
    """

    surface: Surface
    libraries: tuple[str, ...]
    materials: tuple[tuple[int, str], ...]
    worn: Indices
    bare: int | None


def load(path: str | Path) -> Surface:
    """The triangles of an OBJ file; see `load_obj`. Materials are not looked at."""
    return load_obj(path).surface


def load_obj(path: str | Path) -> ObjFile:
    """An OBJ file.

    Polygons are cut into triangles, degenerate ones left out. Normals of the file are made unit length; where it has
    none, or a zero one, the area-weighted mean of the triangles at that place is taken. What is changed or left out is
    told in the surface's notes, what the file leaves to its reader in its remarks.

    Raises InputError, naming the file, the line and how to fix it: absent or unreadable, no faces, faces that name
    vertices that are not there, coordinates that are not finite, only degenerate triangles.
    """
    path = Path(path)
    with reading(path, "mesh", EXAMPLE):
        facts = path.stat()
    return _load(path, facts.st_mtime_ns, facts.st_size)


@lru_cache(maxsize=8)
def _load(path: Path, changed: int, size: int) -> ObjFile:
    """`load_obj` of a file in this state: a study checks its meshes when it starts, and measures them later."""
    lines, notes, remarks = ObjLines(path), Notes(), Notes()
    points = _points(lines, notes)
    corners, named, owners = _triangles(lines, points, notes, remarks)
    solid = have_area(points, corners)
    if not solid.any():
        raise InputError("every triangle of the mesh is degenerate", str(path), "export it again, with an area")
    left_out = int((~solid).sum())
    notes.add("degenerate triangles left out", count=left_out)
    corners, named, owners = corners[solid], named[solid], owners[solid]
    vertices, normals, faces = _with_normals(lines, points, corners, named, notes, remarks)
    libraries, materials, worn = _statements(lines, owners, notes, creases=bool((named < 0).any()))
    bare = lines.number(int(owners[worn.argmin()])) if worn.min() < 0 else None
    surface = Surface(path.name, vertices, normals, faces, notes.sentences(), remarks.sentences(), left_out)
    return ObjFile(surface, libraries, materials, worn, bare)


def _points(lines: ObjLines, notes: Notes) -> Array:
    """The vertices, whose other numbers are noted."""
    points, counts = lines.vectors(VERTEX)
    for numbers, lost in ((counts >= 6, "vertex colours are not drawn"), (counts % 3 == 1, "weights of vertices")):
        if numbers.any():
            notes.add(lost, lines.number(int(lines.of(VERTEX)[numbers.argmax()])), int(numbers.sum()))
    if not len(lines.of(FACE)):
        what = "the mesh has no faces"
        raise InputError(what, str(lines.path), "export it with faces, not as a cloud of points")
    if len(points) and not 1 / LARGEST < (size := float(np.abs(points).max())) < LARGEST:
        raise InputError(f"the mesh's largest coordinate is {size:g}", str(lines.path), "scale it to about 1")
    return points


def _triangles(lines: ObjLines, points: Array, notes: Notes, remarks: Notes) -> tuple[Indices, Indices, Indices]:
    """(t, 3) vertices and normals (-1 for none) of all triangles, degenerate ones too, and the line of each one's face.

    Raises InputError for a face that names a vertex that is not there.
    """
    faces = lines.of(FACE)
    vertex, normal, sizes = lines.corners()
    corners, there = _resolved(lines, VERTEX, vertex, sizes)
    if not there.all():
        line = int(np.repeat(faces, sizes)[there.argmin()])
        lines.refuse(line, f"a face names its vertices by 1 to {len(points)}, or backwards from -1 those above it")
    named, there = _resolved(lines, NORMAL, normal, sizes)
    named[~there] = -1
    notes.add(
        "corners whose normal is not in the file get an area-weighted one", count=int((~there & (normal != 0)).sum())
    )
    corners, named, sizes = _without_repetitions(corners, named, sizes)
    remarks.add("polygons cut into triangles", count=int((sizes > 3).sum()))
    triangles, owners, crossing = polygons.triangles(points[corners], sizes)
    notes.add("faces that cross themselves, cut as fans around a corner", count=crossing)
    return corners[triangles], named[triangles], faces[owners]


def _resolved(lines: ObjLines, kind: int, numbers: Indices, sizes: Indices) -> tuple[Indices, NDArray[np.bool_]]:
    """Indices of what corners name by numbers from 1, or backwards from -1 at their face; and whether it is there."""
    defined = lines.kinds == kind
    above = np.repeat(np.cumsum(defined)[lines.of(FACE)], sizes)
    indices = np.where(numbers > 0, numbers - 1, above + numbers)
    return indices, (numbers != 0) & (indices >= 0) & (indices < defined.sum())


def _without_repetitions(corners: Indices, named: Indices, sizes: Indices) -> tuple[Indices, Indices, Indices]:
    """The corners of polygons without those that repeat the one before, as long as three are left."""
    first = np.cumsum(sizes) - sizes
    before = np.arange(len(corners)) - 1
    before[first] = first + sizes - 1
    kept = corners != corners[before]
    kept |= np.repeat((sizes == 3) | (np.add.reduceat(kept, first, dtype=np.int64) < 3), sizes)
    return corners[kept], named[kept], np.add.reduceat(kept, first, dtype=np.int64)


def _with_normals(
    lines: ObjLines, points: Array, corners: Indices, named: Indices, notes: Notes, remarks: Notes
) -> tuple[Array, Array, Indices]:
    """Vertices, their unit normals and (t, 3) faces: vertices are split where corners name several normals."""
    given, _ = lines.vectors(NORMAL)
    largest = np.abs(given).max(axis=1, initial=0.0)
    usable = np.isfinite(largest) & (largest > 0)
    bad = np.zeros(corners.shape, bool) if not len(given) else (named >= 0) & ~usable[named]
    notes.add("normals that are zero or not finite, replaced by area-weighted ones", count=len(np.unique(named[bad])))
    chosen = np.where(bad, -1, named)
    if (named < 0).all():
        left = "it has no normals" if not len(given) else "its faces name none of its normals"
        remarks.add(f"{left}: area-weighted ones are used")
    elif (named < 0).any():
        remarks.add("corners without a normal get an area-weighted one", count=int((named < 0).sum()))
    smooth = area_weighted_normals(points, corners) if (chosen < 0).any() else points
    if (chosen < 0).all():
        return points, smooth, corners
    keys, faces = np.unique(corners * (len(given) + 1) + chosen + 1, return_inverse=True)
    vertex, normal = keys // (len(given) + 1), keys % (len(given) + 1) - 1
    normals = smooth[vertex]
    normals[normal >= 0] = unit(given[normal[normal >= 0]] / largest[normal[normal >= 0], None])
    return points[vertex], normals, faces.reshape(-1, 3)


def _statements(
    lines: ObjLines, owners: Indices, notes: Notes, *, creases: bool
) -> tuple[tuple[str, ...], tuple[tuple[int, str], ...], Indices]:
    """The libraries, the materials and which of these the triangles of faces wear; what else is lost is noted.

    creases  whether smoothing groups would decide about normals
    """
    libraries, materials, groups = list[str](), dict[str, tuple[int, int]](), dict[str, int]()
    uses, used = [-1], [-1]
    for line, key, rest in lines.others():
        text = name(rest)
        if key == b"mtllib":
            libraries += [text] if text else []
        elif key == b"usemtl":
            uses.append(line)
            used.append(-1 if not text else materials.setdefault(text, (len(materials), lines.number(line)))[0])
        elif key == b"s":
            groups.setdefault(text, line)
        elif key not in _SILENT:
            lost = _LOST.get(key, "it is not understood")
            notes.add(f"{name(key)[:20]!r} is ignored: {lost}", lines.number(line))
    if creases and (len(groups) > 1 or "off" in groups or "0" in groups):
        notes.add("smoothing groups are ignored: normals are smooth everywhere", lines.number(min(groups.values())))
    named = tuple((line, text) for text, (_, line) in materials.items())
    return tuple(libraries), named, np.array(used)[np.searchsorted(uses, owners) - 1]
