"""Lines as files and documents: intensities in CSV or npy, requests in JSON, tables out."""

import csv
import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.inverse.branches import PRIORS
from phongbench.inverse.line import LONGEST, RULES, STARTS, InverseLine, invert_line
from phongbench.inverse.line_model import LineModel
from phongbench.support.atomic_files import write_bytes
from phongbench.support.document_paths import DATA, Source
from phongbench.support.documents import FINITE, Table
from phongbench.support.user_paths import check_file, reading

_FORMS = "give one column, or the columns x,intensity, as CSV or .npy"
#: bytes of a CSV of the longest line, 24 digits a number
_MOST_BYTES = 64 << 20


@dataclass(frozen=True, eq=False)
class LineFile:
    """A line as a file holds it.

    x       (n,) | None  where its samples are
    values  (n,)         intensities, or what else the file is of
    place   index -> how an error names that sample
    """

    x: Array | None
    values: Array
    place: Callable[[int], str]


def read_line(path: Path, column: str = "intensity") -> LineFile:
    """A line of a .npy of shape (n,) or (n, 2), or of CSV: one column without a header, or columns x and `column`.

    Raises InputError naming the file and row.
    """
    with reading(path, "line", _FORMS), path.open("rb") as file:
        data = file.read(_MOST_BYTES + 1)
    if len(data) > _MOST_BYTES:
        raise InputError(f"a line has at most {_MOST_BYTES >> 20} MB", str(path), "give a part of it")
    return _of_npy(path, data) if path.suffix.lower() == ".npy" else _of_csv(path, data, column)


def _of_npy(path: Path, data: bytes) -> LineFile:
    try:
        array = np.load(io.BytesIO(data), allow_pickle=False)
    except (ValueError, EOFError, OSError, MemoryError) as problem:
        raise InputError(f"not a .npy file: {problem}", str(path), _FORMS) from problem
    if array.dtype.kind not in "fiu" or array.ndim not in (1, 2) or (array.ndim == 2 and array.shape[1] != 2):
        raise InputError(
            f"{array.dtype} of shape {array.shape}", str(path), "give numbers (n,), or (n, 2) with x first"
        )
    columns = array.astype(np.float64).reshape(len(array), -1)
    x = columns[:, 0] if array.ndim == 2 else None
    return LineFile(x, columns[:, -1], lambda i: f"{path}[{i}]")


def _of_csv(path: Path, data: bytes, column: str) -> LineFile:
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        line = data.count(b"\n", 0, problem.start) + 1
        raise InputError("not UTF-8", f"{path}:{line}", "save it as text in UTF-8") from problem
    try:
        rows = [(number, row) for number, row in enumerate(csv.reader(io.StringIO(text)), 1) if row]
    except csv.Error as problem:
        raise InputError(f"not CSV: {problem}", str(path), _FORMS) from problem
    names = [cell.strip().lower() for cell in rows[0][1]] if rows else []
    headed = bool(names) and not any(map(_is_number, names))
    wide = len(names)
    if headed and (column not in names or not set(names) <= {"x", column} or len(set(names)) < wide):
        raise InputError(f"columns {', '.join(names)[:60]}", f"{path}:{rows[0][0]}", f"name them x,{column}")
    if not 1 <= wide <= 2:
        raise InputError(f"{wide} columns" if rows else "an empty file", f"{path}:1", _FORMS)
    body = rows[headed:]
    if len(body) > LONGEST:
        raise InputError(f"more than {LONGEST} samples", str(path), "give a part of them")
    found = np.array([_numbers(row, wide, f"{path}:{line}") for line, row in body]).reshape(len(body), wide)
    order = [names.index("x"), names.index(column)] if headed and wide == 2 else list(range(wide))
    lines = [line for line, _ in body]
    x = found[:, order[0]] if wide == 2 else None
    return LineFile(x, found[:, order[-1]], lambda i: f"{path}:{lines[i]}")


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _numbers(row: list[str], wide: int, where: str) -> list[float]:
    if len(row) != wide or not all(map(_is_number, row)):
        raise InputError(f"not {wide} number{'s' if wide > 1 else ''}", where, _FORMS)
    return [float(cell) for cell in row]


def invert_file(
    path: Path, model: LineModel, *, scale: float = 1.0, prior: str = "convex", **options: Any
) -> InverseLine:
    """`invert_line` of a file; errors about a sample name its row.

    scale    what intensities are divided by; the model is of divided ones
    prior    one of PRIORS, or a file of the angles expected, in degrees
    options  of `invert_line`
    """
    line = read_line(path)
    wanted: Any = prior
    if prior not in PRIORS and Path(prior).suffix:
        wanted = _angles(Path(prior), len(line.values))
    with np.errstate(over="ignore"):
        values = line.values / scale
    return invert_line(values, model, x=line.x, prior=wanted, place=lambda name, i: line.place(i), **options)


def check_scale(scale: float) -> float:
    """What intensities can be divided by; InputError otherwise."""
    if not 1e-300 < scale < float("inf"):
        raise InputError(f"a scale of {scale:g}", "--scale", "give the largest possible intensity, e.g. 255")
    return scale


def _angles(path: Path, count: int) -> Array:
    """Expected angles of a file: as many as the line has samples."""
    given = read_line(path, "angle")
    bad = np.flatnonzero(~np.isfinite(given.values))
    if len(bad):
        raise InputError("not a finite angle", given.place(int(bad[0])), "give degrees from the viewer's direction")
    if len(given.values) != count:
        raise InputError(f"{len(given.values)} angles for {count} samples", str(path), "give one for each sample")
    return given.values


def line_request(document: Any, source: Source = DATA) -> tuple[int, Callable[[], InverseLine]]:
    """Read a request: how many samples it has, and the work that answers it.

    document  `intensity`, `ambient`, `diffuse`, `light`; optional are `x`, `prior`, `noise`, `rule`, `start`, `bridge`
              and `unit_light`
    Raises InputError naming the field; so does the work.
    """
    top = Table.of(document, source, "request")
    intensity = _list(top, "intensity")
    x = _list(top, "x") if top.has("x") and top.data["x"] is not None else None
    ambient, diffuse = (top.number(key, None, 0.0, FINITE) for key in ("ambient", "diffuse"))
    light, noise = top.numbers("light", 2, None, -FINITE, FINITE), top.number("noise", 0.0, 0.0, FINITE)
    options: dict[str, Any] = {"prior": top.text("prior", "convex", PRIORS)}
    options |= {"rule": top.text("rule", "simpson", RULES), "start": top.text("start", "left", STARTS)}
    options["bridge"], unit = top.flag("bridge", False), top.flag("unit_light", False)
    top.finish()
    with top.located():
        model = LineModel(ambient, diffuse, (light[0], light[1]), noise)
    return len(intensity), lambda: invert_line(intensity, model.unit() if unit else model, x=x, **options)


def _list(top: Table, key: str) -> list[Any]:
    """Numbers, looked at by a loop that runs in C."""
    values = top.members(key, most=LONGEST)
    if set(map(type, values)) - {int, float}:
        bad = next(i for i, value in enumerate(values) if type(value) not in (int, float))
        raise InputError("not a number", top.where(key, bad))
    return values


def save_line(line: InverseLine, path: Path) -> None:
    """Write a row for each sample: .csv, .parquet or .json by the name's end."""
    if path.suffix.lower() not in _WRITERS:
        raise InputError(
            f"a line is not written as {path.suffix or path.name}", str(path), f"use {', '.join(_WRITERS)}"
        )
    check_file(path)
    write_bytes(path, _WRITERS[path.suffix.lower()](line))


def _csv(line: InverseLine) -> bytes:
    return line.frame.to_csv(index=False, lineterminator="\n").encode("utf-8")


def _parquet(line: InverseLine) -> bytes:
    data = io.BytesIO()
    line.frame.to_parquet(data, index=False)
    return data.getvalue()


def _json(line: InverseLine) -> bytes:
    import orjson

    return orjson.dumps(line.as_dict())


_WRITERS: dict[str, Callable[[InverseLine], bytes]] = {".csv": _csv, ".parquet": _parquet, ".json": _json}
