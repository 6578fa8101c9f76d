"""Triangle meshes of a scene: tessellated surfaces and OBJ files, transformed, with their materials."""

import math
import warnings
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.inputs import meshes, obj_files
from phongbench.inputs.mtl_files import Material as Named
from phongbench.inputs.mtl_files import read_mtl
from phongbench.scenes.scene import MOST_TRIANGLES, Mesh, SurfaceMaterial
from phongbench.shading.lighting import Material
from phongbench.shading.specular_term import EXACT, formula_for
from phongbench.support.documents import Table

SMOOTH = ("normals", "colours", "none")
#: widest edges of a tessellation, in degrees: below, it would have more triangles than a scene may
FINEST, COARSEST = 0.2, 120.0
#: the same for a scene from afar, whose triangles are made before anyone can count them: half a million at most
FINEST_AFAR = 1.0
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
        vertices, faces, normals, worn = _from_file(table, materials, material, folder)
    else:
        form = meshes.TESSELLATIONS[table.text("surface", among=meshes.TESSELLATIONS)]
        made = form(table.number("degrees", 10.0, FINEST if folder else FINEST_AFAR, COARSEST))
        vertices, faces, normals = made.vertices, made.faces, made.normals
        worn = np.full(len(faces), material, np.int32)
    if len(faces) > MOST_TRIANGLES:
        raise table.fault(f"{len(faces):,} triangles are more than {MOST_TRIANGLES:,}", "file", "use a coarser mesh")
    linear, shift = _transform(table)
    turned = normals @ np.linalg.inv(linear)  # normals are turned by the inverse's transpose
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    return Mesh(
        vertices @ linear.T + shift,
        faces.astype(np.int32),
        turned,
        worn,
        table.text("normals", "unit", ("unit", "raw")) == "unit",
        table.text("smooth", "normals", SMOOTH),
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
) -> tuple[Array, Array, Array, Array]:
    """Vertices, faces, normals and each face's material, of an OBJ."""
    name = table.text("file")
    if folder is None:
        raise table.fault("a scene from afar cannot name files", "file", f"use a surface: {_known()}")
    if "\0" in name:
        raise table.fault("no file has such a name", "file", "give the path of an OBJ file")
    path = folder / name
    with table.blamed("file"):
        checked = obj_files.load(path)
        if material is not None:
            return checked.vertices, checked.faces, checked.normals, np.full(len(checked.faces), material, np.int32)
        return _with_materials(path, materials)


def _with_materials(path: Path, materials: list[SurfaceMaterial]) -> tuple[Array, Array, Array, Array]:
    """As `_from_file`, by trimesh, which sorts the faces by material; the numbers come from the MTL itself.

    trimesh keeps colours in 8 bits.
    """
    import trimesh

    lines = path.read_text(encoding="utf-8-sig").splitlines()
    library, has_normals = _library(path, lines), any(line.startswith("vn ") for line in lines)
    with warnings.catch_warnings():
        # faces with and without normals side by side make trimesh take the median of nothing
        warnings.simplefilter("ignore", RuntimeWarning)
        found = trimesh.load_scene(path, process=False, group_material=True, split_objects=False, maintain_order=True)
    vertices, faces, normals, worn = [], [], [], []
    shift = 0
    for part in found.geometry.values():
        name = _name(getattr(getattr(part.visual, "material", None), "name", None) or "")
        if name not in library:
            fix = "write usemtl before the first face, or give the object a material"
            raise InputError("some faces have no material", str(path), fix)
        vertices.append(np.asarray(part.vertices, float))
        faces.append(np.asarray(part.faces, np.int64) + shift)
        normals.append(np.asarray(part.vertex_normals, float))
        worn.append(np.full(len(part.faces), _index(library[name], materials), np.int32))
        shift += len(part.vertices)
    corners, triangles, given = (np.concatenate(parts) for parts in (vertices, faces, normals))
    # those of a file without normals are trimesh's own, of each material alone: creases where two of them meet
    smooth = meshes.area_weighted_normals(corners, triangles)
    lengths = np.linalg.norm(given, axis=1, keepdims=True)
    if has_normals:
        smooth = np.where(lengths > 0.5, given / np.maximum(lengths, 0.5), smooth)  # 0 where a vertex has none
    return corners, triangles, smooth, np.concatenate(worn)


def _library(path: Path, lines: list[str]) -> dict[str, Named]:
    """The materials of the MTL files that an OBJ names; InputError for a line that uses another."""
    names = [line.split(maxsplit=1)[1].strip() for line in lines if line.startswith("mtllib ")]
    if not names:
        fix = "add a line like: mtllib scene.mtl, or give the object a material"
        raise InputError("the OBJ file names no MTL file", str(path), fix)
    found = {m.name: m for name in names for m in read_mtl(path.parent / name)}
    for number, line in enumerate(lines, 1):
        if line.startswith("usemtl ") and _name(line[7:]) not in found:
            fix = f"define it there, or give the object a material; known: {', '.join(found)}"
            raise InputError(f"the material {line[7:].strip()!r} is not in the MTL file", f"{path}:{number}", fix)
    return found


def _name(text: str) -> str:
    """A material's name as `read_mtl` gives it."""
    return "-".join(text.split())


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
