"""The shading request as a JSON document: what the command line and the service both read and write."""

import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import orjson

from phongbench.compiler.lowering import precision_named
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.formulas.formula import MODELS, Formula, Registry
from phongbench.formulas.fresnel.catalogue import KINDS
from phongbench.formulas.fresnel.reflectance import Fresnel
from phongbench.formulas.registry import REGISTRY
from phongbench.shading.lighting import BLACK, Light, Material, Viewer
from phongbench.shading.shade import Shaded, shade
from phongbench.shading.specular_term import EXACT, check_precision, formula_for
from phongbench.support.atomic_files import write_whole
from phongbench.support.document_paths import DATA, Source
from phongbench.support.documents import FINITE, Table

#: the precisions that points are shaded in
PRECISIONS = ("float32", "float64")
_NOT_FINITE = {"nan": "NaN", "inf": "Infinity", "-inf": "-Infinity"}
T = TypeVar("T")


@dataclass(frozen=True)
class ShadingRequest:
    """A request, checked: points and normals of shape (n, 3), and the arguments of `shade`."""

    points: Array
    normals: Array
    arguments: Mapping[str, Any]

    @property
    def pairs(self) -> int:
        """Points times lights: what the work grows with."""
        return len(self.points) * len(self.arguments["lights"])

    def shade(self, **options: Any) -> Shaded:
        """Shade; options are further arguments of `shade`, such as threads and cancelled."""
        return shade(self.points, self.normals, **self.arguments, **options)


def parse_json(text: bytes | str) -> Any:
    """The document in a JSON text; InputError saying where it breaks."""
    try:
        return orjson.loads(text)
    except orjson.JSONDecodeError as problem:
        where = f"line {problem.lineno} column {problem.colno}"
        raise InputError(f"not JSON: {problem.msg}", where, "NaN and Infinity are not JSON either") from None


def shading_request(
    document: Any, vectors: tuple[Array, Array] | None = None, registry: Registry = REGISTRY, source: Source = DATA
) -> ShadingRequest:
    """Read a shading request.

    document  what JSON gives: an object with material, lights, viewer and, unless `vectors` holds them, points and
              normals; optional are model, specular, ambient_light, normalise and precision ("float32" or "float64")
    vectors   points and normals of shape (n, 3), float32 or float64, where they came as binary; their type decides
    source    where the document came from
    Raises InputError or UnknownNameError naming the path of the field, such as lights[2].attenuation.
    """
    top = Table.of(document, source, "shading request")
    arguments: dict[str, Any] = {
        "material": _material(top.table("material")),
        "lights": tuple(_light(light) for light in top.tables("lights")),
        "viewer": _made(Viewer, top.table("viewer"), position=_vector, direction=_vector),
        "ambient_light": top.colour("ambient_light", BLACK, FINITE),
        "model": top.text("model", "phong", MODELS),
        "normalise": top.flag("normalise", True),
    }
    formula = read_formula(top, registry)
    points, normals = vectors or _points(top)
    top.finish()
    if points.shape != normals.shape:
        what = f"{len(normals)} normals for {len(points)} points"
        raise top.error(what, "normals", "give one normal for each point")
    with top.located():
        formula = formula_for(formula, arguments["material"], arguments["model"], registry)
        check_precision(formula, points.dtype.name)
    return ShadingRequest(points, normals, {**arguments, "specular": formula, "registry": registry})


def read_formula(top: Table, registry: Registry = REGISTRY) -> Formula:
    """The formula under `specular`: a spelling, or an object of approximation, lambda, gamma, beta, recipe and
    normalise; exact Phong.
    """
    if not top.has("specular"):
        return EXACT
    if isinstance(top.value("specular"), str):
        with top.located("specular"):
            return Formula.parse(top.text("specular"), registry)
    table = top.table("specular")
    parts = ("lambda", "gamma", "beta", "recipe", "normalise")
    given = {key for key in parts if table.has(key) and table.data[key] is not None}
    form = table.text("lambda") if "lambda" in given else None
    gamma = table.whole("gamma", low=1) if "gamma" in given else None
    slope: str | float | None = None
    if "beta" in given:
        slope = table.text("beta") if isinstance(table.value("beta"), str) else table.number("beta", None, 0.0, FINITE)
    name = table.text("approximation", "phong")
    raw = {key: table.text(key) for key in ("recipe", "normalise") if key in given}
    table.finish()
    with table.located():
        return Formula.of(name, form, gamma, slope, **raw, registry=registry)


def _vector(table: Table, key: str) -> Any:
    return table.vector(key, None, FINITE)


def _colour(table: Table, key: str) -> Any:
    return table.colour(key, None, FINITE)


def _not_negative(table: Table, key: str) -> Any:
    return table.number(key, None, 0.0, FINITE)


def _made(make: Callable[..., T], table: Table, **readers: Callable[[Table, str], Any]) -> T:
    """An object of those members that the table has; what it refuses is located there."""
    members = {key: read(table, key) for key, read in readers.items() if table.has(key)}
    table.finish()
    with table.located():
        return make(**members)


def read_fresnel(table: Table, key: str = "fresnel") -> Fresnel:
    """The reflectance under a key: an object of kind and what that takes, three numbers each of f0, f82, n, k."""
    inside = table.table(key)
    kind = inside.text("kind", among=KINDS)
    return _made(partial(Fresnel, kind), inside, f0=_vector, f82=_vector, n=_vector, k=_vector)


def _material(table: Table) -> Material:
    for key in ("ambient", "diffuse", "specular", "shininess"):
        table.value(key)  # a material has no default
    colours = dict.fromkeys(("ambient", "diffuse", "specular"), _colour)
    return _made(Material, table, **colours, shininess=_not_negative, fresnel=read_fresnel)


def _light(table: Table) -> Light:
    return _made(
        Light,
        table,
        direction=_vector,
        position=_vector,
        attenuation=_vector,
        diffuse=_colour,
        specular=_colour,
        ambient=_colour,
        reach=_not_negative,
    )


def _points(top: Table) -> tuple[Array, Array]:
    dtype = precision_named(top.text("precision", "float32", PRECISIONS)).dtype
    with np.errstate(over="ignore"):  # what float32 cannot hold becomes infinite, and shading names it
        points, normals = (_rows(top, key).astype(dtype) for key in ("points", "normals"))
    return points, normals


def _rows(top: Table, key: str) -> Array:
    """Rows of three numbers as float64, looked at by loops that run in C: a million numbers take some 30 ms."""
    rows = top.members(key)
    bad = None
    if set(map(type, rows)) - {list} or set(map(len, rows)) - {3}:
        bad = next(k for k, row in enumerate(rows) if type(row) is not list or len(row) != 3)
    elif set(map(type, chain.from_iterable(rows))) - {int, float}:
        bad = next(k for k, row in enumerate(rows) if set(map(type, row)) - {int, float})
    if bad is not None:
        raise InputError("not three numbers", top.where(key, bad), "give [x, y, z]")
    try:
        flat = np.fromiter(chain.from_iterable(rows), np.float64, 3 * len(rows))
    except OverflowError:
        raise top.error("a number beyond float64", key) from None
    return flat.reshape(-1, 3)


def shaded_json(shaded: Shaded) -> bytes:
    """`{"colours": [[r, g, b], ..], "skipped": {..}}`; what is not finite as the strings NaN, Infinity, -Infinity."""
    colours: Any = shaded.colours
    if not np.isfinite(colours).all():
        colours = [[c if np.isfinite(c) else _NOT_FINITE[str(c)] for c in row] for row in colours.tolist()]
    return orjson.dumps({"colours": colours, "skipped": shaded.ledger.as_dict()}, option=orjson.OPT_SERIALIZE_NUMPY)


def save_shaded(shaded: Shaded, path: Path) -> None:
    """Write the colours as .npy, or all of the answer as JSON, by the file's suffix; whole, or StorageError."""
    data = io.BytesIO()
    if path.suffix == ".npy":
        np.save(data, shaded.colours)
    else:
        data.write(shaded_json(shaded))

    def write(temporary: Path) -> None:
        temporary.write_bytes(data.getbuffer())

    write_whole(path, write)
