"""From a document to a scene: what it may hold, and what cannot be drawn."""

import math
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import Formula, Registry
from phongbench.formulas.registry import REGISTRY
from phongbench.inputs.mtl_files import OPENGL
from phongbench.inputs.mtl_files import Material as Named
from phongbench.scenes import mesh_objects
from phongbench.scenes.camera import check_camera
from phongbench.scenes.scene import (
    MOST_DEPTH,
    MOST_LIGHTS,
    MOST_OBJECTS,
    MOST_PIXELS,
    MOST_SUPERSAMPLING,
    MOST_TRIANGLES,
    SHORTEST,
    Camera,
    Chequerboard,
    Mesh,
    Object,
    Picture,
    Plane,
    Scene,
    Sphere,
    SurfaceMaterial,
)
from phongbench.shading.lighting import Light, Material
from phongbench.shading.requests import read_fresnel
from phongbench.shading.specular_term import EXACT, formula_for
from phongbench.support.documents import Table, load

#: brightest that a light's colour times its intensity may be
BRIGHTEST = 1e6
_CLASSIC = {m.name: m for m in OPENGL}
#: materials of the document by name: an index, or a pattern of two
Palette = dict[str, int | Chequerboard]


def examples() -> dict[str, str]:
    """The shipped scenes: name -> what the first line of the file says."""
    folder = resources.files(__package__) / "examples"
    texts = {item.name.removesuffix(".toml"): item.read_text("utf-8") for item in folder.iterdir()}
    return {name: texts[name].splitlines()[0].lstrip("# ") for name in sorted(texts)}


def read_scene(name: str | Path, registry: Registry = REGISTRY) -> Scene:
    """A scene from a TOML or JSON file, or a shipped one by its name.

    registry  the approximations that its materials may name
    Raises InputError, with file, line and key, for what is unknown, missing, malformed, or cannot be drawn.
    """
    path = Path(name)
    if path.suffix.lower() in (".toml", ".json"):
        return scene_of(load(path, "scene"), path.stem, path.parent, registry=registry)
    if str(name) not in examples():
        problem = UnknownNameError("scene", name, examples())
        problem.fix = f"{problem.fix}; or give a file whose name ends in .toml or .json"
        raise problem
    with resources.as_file(resources.files(__package__) / "examples" / f"{name}.toml") as shipped:
        top = load(shipped, "scene")
        return scene_of(replace(top, source=replace(top.source, name=f"{name}.toml")), str(name), shipped.parent)


def scene_of(
    top: Table,
    name: str,
    folder: Path | None = None,
    most_triangles: int = MOST_TRIANGLES,
    registry: Registry = REGISTRY,
) -> Scene:
    """A scene from a document.

    folder          where its mesh files lie; None forbids files: an untrusted document names none
    most_triangles  of all its meshes; what goes beyond is refused as soon as it is made
    registry        the approximations that its materials may name
    """
    materials, palette = _materials(top.named("materials"), registry)
    found: list[Object] = []
    for table in top.tables("objects", [], MOST_OBJECTS):
        found += _object(table, materials, palette, folder)
        table.finish()
        most_triangles -= sum(len(thing.faces) for thing in found[-1:] if isinstance(thing, Mesh))
        if most_triangles < 0:
            raise table.error("with this mesh the scene has too many triangles", None, "use fewer or coarser meshes")
    if not found:
        raise top.error("a scene needs an object", "objects", "add: [[objects]]")
    lights = tuple(_light(table) for table in top.tables("lights", [], MOST_LIGHTS))
    camera = _camera(top.table("camera", {}))
    scene = Scene(
        name,
        camera,
        tuple(materials),
        tuple(found),
        lights,
        top.colour("ambient_light", (0.1, 0.1, 0.1)),
        top.colour("background", (0.0, 0.0, 0.0), BRIGHTEST),
        _picture(top.table("picture", {})),
    )
    top.finish()
    with top.table("camera", {}).located("position"):
        check_camera(scene)
    return scene


def check_size(width: int, height: int) -> tuple[int, int]:
    """The size, if a picture may have it; InputError otherwise."""
    if width < 1 or height < 1 or width * height > MOST_PIXELS:
        fix = f"both at least 1, {MOST_PIXELS:,} pixels at most"
        raise InputError(f"a picture of {width}x{height} pixels", "size", fix)
    return width, height


def wanted_size(table: Table, default: tuple[int, int]) -> tuple[int, int]:
    """The `size` of a table, if a picture may have it."""
    width, height = table.numbers("size", 2, default, 1, MOST_PIXELS)
    if width % 1 or height % 1:
        raise table.error("a size is two whole numbers", "size", "write [width, height]")
    with table.located("size"):
        return check_size(int(width), int(height))


def _camera(table: Table) -> Camera:
    if not table.data:
        raise table.error("position and target of the camera are missing", None, "add: [camera]")
    position, target = table.vector("position"), table.vector("target")
    camera = Camera(
        position, target, table.direction("up", (0.0, 1.0, 0.0)), table.number("field_of_view", 45.0, 1, 170)
    )
    table.finish()
    view = [t - p for t, p in zip(target, position, strict=True)]
    length = math.hypot(*view)
    if length < SHORTEST:
        raise table.error("the camera looks at itself", "target", "position and target must differ")
    if abs(sum(v * u for v, u in zip(view, camera.up, strict=True))) > (1 - 1e-6) * length:
        raise table.error("the camera looks along up", "up" if table.has("up") else "target", "choose another up")
    return camera


def _picture(table: Table) -> Picture:
    picture = Picture(
        wanted_size(table, (640, 360)),
        table.whole("depth", 3, 0, MOST_DEPTH),
        table.whole("supersampling", 1, 1, MOST_SUPERSAMPLING),
        table.flag("shadows", False),
    )
    table.finish()
    return picture


def _light(table: Table) -> Light:
    colour = table.colour("colour", (1.0, 1.0, 1.0))
    highlight = table.colour("highlight", colour)
    intensity = table.number("intensity", 1.0, 0.0, BRIGHTEST)
    around = table.colour("ambient", (0.0, 0.0, 0.0))
    kinds = {"diffuse": colour, "specular": highlight, "ambient": around}
    colours: dict[str, Any] = {name: tuple(intensity * c for c in of) for name, of in kinds.items()}
    if table.has("direction") == table.has("position"):
        raise table.error("a light has either a direction or a position", "position", "remove one, or add one")
    if table.has("direction"):
        for key in ("attenuation", "reach"):
            if table.has(key):
                raise table.error(f"a light from everywhere far away has no {key}", key, "give it a position")
        light = Light(direction=table.direction("direction"), **colours)
    else:
        reach = table.number("reach", None, SHORTEST) if table.has("reach") else None
        position, attenuation = table.vector("position"), table.numbers("attenuation", 3, (1.0, 0.0, 0.0), 0.0)
        with table.located("attenuation"):
            light = Light(position=position, attenuation=attenuation, reach=reach, **colours)
    table.finish()
    return light


def _materials(tables: dict[str, Table], registry: Registry) -> tuple[list[SurfaceMaterial], Palette]:
    """The plain materials and, by name, what an object may ask for."""
    materials: list[SurfaceMaterial] = []
    palette: Palette = {}
    for name, table in tables.items():
        if not table.has("chequerboard"):
            palette[name] = len(materials)
            materials.append(_material(name, table, registry))
            table.finish()
    for name, table in tables.items():
        if table.has("chequerboard"):
            palette[name] = _chequerboard(table, palette)
            table.finish()
    return materials, palette


def _material(name: str, table: Table, registry: Registry) -> SurfaceMaterial:
    base = _CLASSIC[table.text("like", among=_CLASSIC)] if table.has("like") else Named(name)
    specular = None
    if table.has("approximation"):
        text = table.text("approximation")
        with table.located("approximation"):
            specular = Formula.parse(text, registry)
    reflection = Material(
        table.colour("ambient", base.ambient),
        table.colour("diffuse", base.diffuse),
        table.colour("specular", base.specular),
        table.number("shininess", base.shininess, 0.0, 1e5),
        read_fresnel(table) if table.has("fresnel") else None,
    )
    if max(reflection.specular) > 0 and reflection.shininess == 0 and not table.has("shininess"):
        raise table.error("a highlight needs a shininess", "specular", "add e.g.: shininess = 50")
    made = SurfaceMaterial(name, reflection, table.number("reflectivity", 0.0, 0.0, 1.0), specular)
    _check_formula(made, table, registry)
    return made


def _check_formula(material: SurfaceMaterial, table: Table, registry: Registry) -> None:
    """Raise InputError, naming the line, for a formula that is unknown or does not take the material's shininess."""
    with table.located():
        try:
            formula_for(material.specular or EXACT, material.reflection, registry=registry)
        except InputError as problem:
            problem.where = "shininess" if problem.where == "material.shininess" else "approximation"
            raise


def _chequerboard(table: Table, palette: Palette) -> Chequerboard:
    names = table.members("chequerboard")
    if len(names) != 2 or not all(isinstance(name, str) for name in names):
        raise table.error("a chequerboard has two materials", "chequerboard", 'write ["white", "black"]')
    known = {name: index for name, index in palette.items() if isinstance(index, int)}
    for name in names:
        if name not in known:
            raise table.unknown("material", name, known, "chequerboard")
    return Chequerboard(known[names[0]], known[names[1]], table.number("side", 1.0, SHORTEST))


def _object(table: Table, materials: list[SurfaceMaterial], palette: Palette, folder: Path | None) -> list[Object]:
    shape = table.text("shape", among=("sphere", "plane", "mesh"))
    if shape == "mesh":
        material = _plain(table, palette) if table.has("material") or not table.has("file") else None
        return [mesh_objects.read_mesh(table, materials, material, folder)]
    name = _named(table, palette)
    if shape == "sphere":
        return [Sphere(table.vector("centre"), table.number("radius", None, SHORTEST), _plain(table, palette))]
    chosen = palette[name]
    point, normal = table.vector("point", (0.0, 0.0, 0.0)), table.direction("normal", (0.0, 1.0, 0.0))
    if isinstance(chosen, Chequerboard):
        return [Plane(point, normal, chosen.even, chosen)]
    return [Plane(point, normal, chosen)]


def _named(table: Table, palette: Palette) -> str:
    name = table.text("material")
    if name not in palette:
        raise table.unknown("material", name, palette, "material")
    return name


def _plain(table: Table, palette: Palette) -> int:
    chosen = palette[_named(table, palette)]
    if isinstance(chosen, Chequerboard):
        raise table.error("only a plane wears a chequerboard", "material", "name a plain material")
    return chosen
