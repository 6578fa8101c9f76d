"""Triangle meshes of a scene: tessellated surfaces and OBJ files, transformed, with their materials."""

import itertools
import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.inputs import meshes, obj_files
from phongbench.inputs.mtl_files import Material as Named
from phongbench.inputs.mtl_files import mtl_paths, read_mtl
from phongbench.inputs.wavefront_text import printable
from phongbench.scenes.scene import MOST_TRIANGLES, Mesh, SurfaceMaterial
from phongbench.shading.lighting import Material
from phongbench.shading.specular_term import EXACT, formula_for
from phongbench.support.documents import Table

SMOOTH = ("normals", "colours", "none")
#: widest edges of a tessellation, in degrees: below, it would have more triangles than a scene may
FINEST, COARSEST = 0.2, 120.0
#: the same for a scene from afar, whose triangles are made before anyone can count them: half a million at most
FINEST_AFAR = 1.0
#: names that a message shows of a list
_SHOWN = 10
#: a transform whose smallest stretch is below this share of its largest flattens what it transforms
_SINGULAR = 1e-6


def read_mesh(table: Table, materials: list[SurfaceMaterial], material: int | None, folder: Path | None) -> Mesh:
    """The mesh that a document's object describes.

    materials  those of the scene; the ones of the OBJ's MTL are appended
    material   index of the one it wears; None takes those of the OBJ's MTL
    folder     where its file lies; None refuses files
    Raises InputError, naming the place in the document, for a file that is no mesh and for a transform that flattens.
    """
    if table.has("file") == table.has("surface"):
        raise table.fault("a mesh has either a file or a surface", "file", f"surface is {_known()}")
    if table.has("file"):
        surface, worn, notes = _from_file(table, materials, material, folder)
    else:
        form = meshes.TESSELLATIONS[table.text("surface", among=meshes.TESSELLATIONS)]
        surface, notes = form(table.number("degrees", 10.0, FINEST if folder else FINEST_AFAR, COARSEST)), ()
        worn = np.full(len(surface.faces), material, np.int32)
    if (count := len(surface.faces)) > MOST_TRIANGLES:
        raise table.fault(f"{count:,} triangles are more than {MOST_TRIANGLES:,}", "file", "use a coarser mesh")
    linear, shift = _transform(table)
    turned = surface.normals @ np.linalg.inv(linear)  # normals are turned by the inverse's transpose
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    return Mesh(
        surface.vertices @ linear.T + shift,
        surface.faces.astype(np.int32),
        turned,
        worn,
        table.text("normals", "unit", ("unit", "raw")) == "unit",
        table.text("smooth", "normals", SMOOTH),
        notes,
    )


def _known() -> str:
    return ", ".join(meshes.TESSELLATIONS)


def _transform(table: Table) -> tuple[Array, Array]:
    """The 3 x 3 part and the shift: `matrix`, or scale, rotate (degrees around x, y, z in turn), then translate."""
    if table.has("matrix"):
        whole = np.array(table.rows("matrix", (3, 4), 4))
        if len(whole) == 4 and tuple(whole[3]) != (0.0, 0.0, 0.0, 1.0):
            raise table.fault("the last row of matrix is not 0, 0, 0, 1", "matrix", "perspective belongs to the camera")
        linear, shift = whole[:3, :3], whole[:3, 3]
    else:
        scale = table.value("scale", 1.0)
        factors = table.numbers("scale", 3) if isinstance(scale, list) else (table.number("scale", 1.0),) * 3
        linear = _rotation(table.numbers("rotate", 3, (0.0, 0.0, 0.0))) @ np.diag(factors)
        shift = np.array(table.vector("translate", (0.0, 0.0, 0.0)))
    stretches = np.linalg.svd(linear, compute_uv=False)
    if stretches[-1] <= _SINGULAR * stretches[0] or stretches[0] == 0:
        key = "matrix" if table.has("matrix") else "scale"
        raise table.fault("the transform is singular: it flattens the mesh", key, "no factor may be 0")
    return linear, shift


def _rotation(degrees: Iterable[float]) -> Array:
    turned = np.eye(3)
    for axis, angle in enumerate(degrees):
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        one, two = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[one, one], turn[one, two], turn[two, one], turn[two, two] = c, -s, s, c
        turned = turn @ turned
    return turned


def _from_file(
    table: Table, materials: list[SurfaceMaterial], material: int | None, folder: Path | None
) -> tuple[meshes.Surface, Array, tuple[str, ...]]:
    """The surface of an OBJ, each face's material, and what is not drawn as the files say."""
    name = table.text("file")
    if folder is None:
        raise table.fault("a scene from afar cannot name files", "file", f"use a surface: {_known()}")
    if "\0" in name:
        raise table.fault("no file has such a name", "file", "give the path of an OBJ file")
    path = folder / name
    with table.blamed("file"):
        obj = obj_files.load_obj(path)
        notes = tuple(f"{path}: {note}" for note in obj.surface.notes)
        if material is not None:
            return obj.surface, np.full(len(obj.surface.faces), material, np.int32), notes
        worn, more = _worn(path, obj, materials)
        return obj.surface, worn, notes + more


def _worn(path: Path, obj: obj_files.ObjFile, materials: list[SurfaceMaterial]) -> tuple[Array, tuple[str, ...]]:
    """Each face's material of the MTL files that an OBJ names, which are appended, and notes on these files."""
    if not obj.libraries:
        fix = "add a line like: mtllib scene.mtl, or give the object a material"
        raise InputError("the OBJ file names no MTL file", str(path), fix)
    paths, missing = mtl_paths(path.parent, obj.libraries)
    if not paths:
        fix = "put it beside the OBJ file, or give the object a material"
        raise InputError("cannot read the MTL file: it is not there", str(path.parent / _shown(missing)), fix)
    if obj.bare:
        fix = "write usemtl before the first face, or give the object a material"
        raise InputError("some faces have no material", f"{path}:{obj.bare}", fix)
    read, absent = read_mtl(*paths), f"; not there: {_shown(missing)}" if missing else ""
    places = np.zeros(len(obj.materials), np.int32)
    for use in np.unique(obj.worn).tolist():
        number, text = obj.materials[use]
        if (found := read.find(text)) is None:
            fix = f"define it there, or give the object a material; known: {_shown(m.name for m in read.materials)}"
            raise InputError(f"the material {text!r} is not in the MTL file{absent}", f"{path}:{number}", fix)
        places[use] = _index(found, materials)
    notes = read.notes + tuple(f"{path}: the MTL file {name!r} is not there" for name in missing)
    return places[obj.worn], notes


def _shown(names: Iterable[str]) -> str:
    """The first names, as a message can show them."""
    first = list(map(printable, itertools.islice(names, _SHOWN + 1)))
    return ", ".join([*first[:_SHOWN], *(["..."] if len(first) > _SHOWN else [])])


def _index(named: Named, materials: list[SurfaceMaterial]) -> int:
    """Where the material stands in the scene's list, which it is appended to if it is new."""
    new = SurfaceMaterial(named.name, Material.of(named))
    if new not in materials:
        try:
            formula_for(EXACT, new.reflection)
        except InputError as problem:  # a shininess near 0
            raise InputError(f"material {named.name!r}: {problem.what}", None, problem.fix) from problem
        materials.append(new)
    return materials.index(new)
