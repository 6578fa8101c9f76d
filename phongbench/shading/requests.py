"""The shading request as a JSON document: what the command line and the service both read and write.

Strict: a key that is not known, a number that is none, a list of another length are refused with the path of the field.
"""

import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from phongbench.compiler.lowering import precision_named
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import MODELS, Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.shading.lighting import Light, Material, Viewer
from phongbench.shading.shade import Shaded, shade
from phongbench.shading.specular_term import formula_for
from phongbench.support.atomic_files import write_whole
from phongbench.support.values import colour, number, three

#: the precisions that points are shaded in
PRECISIONS = ("float32", "float64")


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
    document: Any, vectors: tuple[Array, Array] | None = None, registry: Any = REGISTRY
) -> ShadingRequest:
    """Read a shading request.

    document  what JSON gives: an object with material, lights, viewer and, unless `vectors` holds them, points and
              normals; optional are model, specular, ambient_light, normalise and precision ("float32" or "float64")
    vectors   points and normals of shape (n, 3), float32 or float64, where they came as binary; their type decides
    Raises InputError or UnknownNameError naming the path of the field, such as lights[2].attenuation.
    """
    fields = _object(
        document, "", _REQUEST if vectors is None else {k: _REQUEST[k] for k in _REQUEST if k not in _BULK}
    )
    for needed in ("material", "lights", "viewer", *(_BULK[:2] if vectors is None else ())):
        if needed not in fields:
            raise InputError("missing", needed, "a shading request needs material, lights, viewer, points and normals")
    dtype = fields.pop("precision", np.dtype(np.float32))
    with np.errstate(over="ignore"):  # what float32 cannot hold becomes infinite, and shading names it
        points, normals = vectors or (fields.pop(name).astype(dtype) for name in ("points", "normals"))
    if points.shape != normals.shape:
        raise InputError(
            f"{len(normals)} normals for {len(points)} points", "normals", "give one normal for each point"
        )
    formula = Formula.of(*fields.get("specular", ()), registry=registry, where="specular.")
    fields["specular"] = formula_for(formula, fields["material"], fields.get("model", "phong"), registry)
    return ShadingRequest(points, normals, {**fields, "registry": registry})


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


_NOT_FINITE = {"nan": "NaN", "inf": "Infinity", "-inf": "-Infinity"}


def _object(value: Any, path: str, readers: Mapping[str, Callable[[Any, str], Any]]) -> dict[str, Any]:
    """The members of an object, each read by the reader of its name."""
    if not isinstance(value, dict):
        raise InputError(f"{_kind(value)} instead of an object", path or "request", f"known keys: {', '.join(readers)}")
    prefix = f"{path}." if path else ""
    for key in value:
        if key not in readers:
            raise UnknownNameError("key", key[:40], readers, path or "request")
    return {key: readers[key](member, prefix + key) for key, member in value.items()}


def _kind(value: Any) -> str:
    kinds = {dict: "an object", list: "a list", str: "a string", bool: "true or false", type(None): "null"}
    return kinds.get(type(value), "a number")


def _list(value: Any, path: str) -> list[Any]:
    if not isinstance(value, list):
        raise InputError(f"{_kind(value)} instead of a list", path)
    return value


def _numbers(check: Callable[[Any, str], Any]) -> Callable[[Any, str], Any]:
    """A reader of three numbers that refuses what Python would take for numbers."""

    def read(value: Any, path: str) -> Any:
        for k, member in enumerate(_list(value, path)):
            _number(member, f"{path}[{k}]", -np.inf)
        return check(value, path)

    return read


def _number(value: Any, path: str, low: float = 0.0) -> float:
    if type(value) not in (int, float):
        raise InputError(f"{_kind(value)} instead of a number", path)
    return number(value, path, low)


def _text(value: Any, path: str) -> str:
    if not isinstance(value, str):
        raise InputError(f"{_kind(value)} instead of a string", path)
    return value


def _one_of(kind: str, known: tuple[str, ...]) -> Callable[[Any, str], Any]:
    def read(value: Any, path: str) -> Any:
        if _text(value, path) not in known:
            raise UnknownNameError(kind, value[:40], known, path)
        return value

    return read


def _precision(value: Any, path: str) -> Any:
    return precision_named(_one_of("precision", PRECISIONS)(value, path)).dtype


def _flag(value: Any, path: str) -> bool:
    if not isinstance(value, bool):
        raise InputError(f"{_kind(value)} instead of true or false", path)
    return value


def _gamma(value: Any, path: str) -> int | None:
    if value is not None and type(value) is not int:
        raise InputError(f"{_kind(value)} instead of a whole number", path, "gamma is a power of two, e.g. 8")
    return value


def _beta(value: Any, path: str) -> str | float | None:
    return value if value is None or isinstance(value, str) else _number(value, path)


def _form(value: Any, path: str) -> str | None:
    return None if value is None else _text(value, path)


def _made(make: Callable[..., Any], path: str, members: dict[str, Any]) -> Any:
    """An object of ours; its complaints get the path."""
    try:
        return make(**members)
    except InputError as problem:
        problem.where = f"{path}.{problem.where}" if problem.where else path
        raise


def _of(make: Callable[..., Any], readers: Mapping[str, Callable[[Any, str], Any]]) -> Callable[[Any, str], Any]:
    return lambda value, path: _made(make, path, _object(value, path, readers))


def _material(**members: Any) -> Material:
    for needed in ("ambient", "diffuse", "specular", "shininess"):
        if needed not in members:
            raise InputError("missing", needed, "a material needs ambient, diffuse, specular and shininess")
    return Material(**members)


def _specular(approximation: str = "phong", gamma: int | None = None, beta: Any = None, **form: Any) -> tuple[Any, ...]:
    """The parts of a formula, as `Formula.of` takes them."""
    return approximation, form.get("lambda"), gamma, beta


def _lights(value: Any, path: str) -> tuple[Light, ...]:
    return tuple(_light(member, f"{path}[{k}]") for k, member in enumerate(_list(value, path)))


def _vectors(value: Any, path: str) -> Array:
    """Rows of three numbers as float64, looked at by loops that run in C: a million numbers take some 30 ms."""
    rows = _list(value, path)
    if set(map(type, rows)) - {list} or set(map(len, rows)) - {3}:
        bad = next(k for k, row in enumerate(rows) if type(row) is not list or len(row) != 3)
        raise InputError("not three numbers", f"{path}[{bad}]", "give [x, y, z]")
    if set(map(type, chain.from_iterable(rows))) - {int, float}:
        bad = next(k for k, row in enumerate(rows) if set(map(type, row)) - {int, float})
        raise InputError("not three numbers", f"{path}[{bad}]", "give [x, y, z]")
    try:
        flat = np.fromiter(chain.from_iterable(rows), np.float64, 3 * len(rows))
    except OverflowError:
        raise InputError("a number beyond float64", path) from None
    return flat.reshape(-1, 3)


_colour, _three = _numbers(colour), _numbers(three)
_light = _of(
    Light,
    {
        "direction": _three,
        "position": _three,
        "attenuation": _three,
        "diffuse": _colour,
        "specular": _colour,
        "reach": _number,
    },
)
_REQUEST: Mapping[str, Callable[[Any, str], Any]] = {
    "model": _one_of("model", MODELS),
    "specular": _of(_specular, {"approximation": _text, "lambda": _form, "gamma": _gamma, "beta": _beta}),
    "material": _of(_material, {"ambient": _colour, "diffuse": _colour, "specular": _colour, "shininess": _number}),
    "ambient_light": _colour,
    "lights": _lights,
    "viewer": _of(Viewer, {"position": _three, "direction": _three}),
    "points": _vectors,
    "normals": _vectors,
    "normalise": _flag,
    "precision": _precision,
}
_BULK = ("points", "normals", "precision")
