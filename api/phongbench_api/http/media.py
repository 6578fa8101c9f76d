"""Bytes in, bytes out: media types, strict JSON, raw and npy arrays."""

import ast
import hashlib
import io
import math
import time
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import orjson
from starlette.requests import Request
from starlette.responses import Response

from phongbench.compiler.precisions import Array
from phongbench_api.http.problems import MalformedError, NotAcceptableError, RequestError, UnsupportedMediaError

JSON, OCTETS, NPY = "application/json", "application/octet-stream", "application/x-npy"
CSV, SVG, PARQUET, PNG = "text/csv", "image/svg+xml", "application/vnd.apache.parquet", "image/png"
HTML, TEXT, MULTIPART = "text/html", "text/plain", "multipart/form-data"
#: dtypes of binary bodies, by the name a query gives them
DTYPES: dict[str, np.dtype[Any]] = {"f4": np.dtype("<f4"), "f8": np.dtype("<f8")}
_NPY_MAGIC = b"\x93NUMPY"
_LONGEST_HEADER = 4096


class Spans:
    """How long the parts of an answer took; becomes the Server-Timing header."""

    def __init__(self) -> None:
        self._last, self._spent = time.perf_counter(), dict[str, float]()

    def mark(self, name: str) -> None:
        """The time since the last mark went into `name`."""
        now = time.perf_counter()
        self._spent[name] = self._spent.get(name, 0.0) + now - self._last
        self._last = now

    def header(self) -> dict[str, str]:
        """Milliseconds of parse, queue, kernel and encode, in that order."""
        names = ("parse", "queue", "kernel", "encode")
        return {"server-timing": ", ".join(f"{n};dur={1e3 * self._spent.get(n, 0.0):.3f}" for n in names)}


# media types


class _Wanted(NamedTuple):
    media: str
    quality: float


def media_type(header: str | None) -> str:
    """A content type without its parameters, lower case."""
    return (header or "").partition(";")[0].strip().lower()


def body_type(request: Request, readable: Sequence[str]) -> str:
    """The media type of a request's body; UnsupportedMediaError unless it is one of these."""
    kind = media_type(request.headers.get("content-type"))
    if kind not in readable:
        known = ", ".join(readable)
        headers = {"accept-post": known}
        raise UnsupportedMediaError("no such body is read here", "Content-Type", f"send {known}", headers=headers)
    return kind


def negotiate(accept: str | None, offered: Sequence[str]) -> str:
    """The offered media type that Accept likes best, the first of equals; NotAcceptableError lists what there is.

    The most specific range that fits a type decides its quality, as RFC 9110 12.5.1 has it.
    """
    if accept is None or not accept.strip():
        return offered[0]
    ranges = [one for part in accept.split(",")[:64] if (one := _range(part))]
    best = max(offered, key=lambda media: _quality(media, ranges))
    if _quality(best, ranges) <= 0.0:
        raise NotAcceptableError("nothing that Accept names can be made", "Accept", f"there is {', '.join(offered)}")
    return best


def _range(part: str) -> _Wanted | None:
    media, *parameters = (piece.strip().lower() for piece in part.split(";"))
    quality = 1.0
    for parameter in parameters:
        name, _, value = parameter.partition("=")
        if name.strip() == "q":
            try:
                quality = float(value)
            except ValueError:
                return None
    return _Wanted(media, quality) if "/" in media and 0.0 <= quality <= 1.0 else None


def _quality(media: str, ranges: Iterable[_Wanted]) -> float:
    forms = (media, f"{media.partition('/')[0]}/*", "*/*")
    fitting = [(forms.index(one.media), -one.quality) for one in ranges if one.media in forms]
    return -min(fitting)[1] if fitting else 0.0


# JSON


def parsed(body: bytes | memoryview) -> Any:
    """A JSON document; MalformedError for anything that RFC 8259 does not allow, NaN and Infinity among it."""
    try:
        return orjson.loads(body)
    except (orjson.JSONDecodeError, RecursionError) as problem:
        at = getattr(problem, "pos", None)
        raise MalformedError("the body is not JSON", "(body)", None if at is None else f"look at byte {at}") from None


def json(data: Any, spans: Spans | None = None, status: int = 200, headers: dict[str, str] | None = None) -> Response:
    """Data as strict JSON: arrays by their numbers, numbers that are not finite as strings."""
    body = orjson.dumps(strict(data), option=orjson.OPT_SERIALIZE_NUMPY)
    if spans:
        spans.mark("encode")
    return Response(body, status, (headers or {}) | (spans.header() if spans else {}), media_type=JSON)


def response(body: Any, media_type: str, spans: Spans, headers: dict[str, str] | None = None) -> Response:
    """A body that is encoded, with the times of its parts."""
    spans.mark("encode")
    return Response(body, headers=(headers or {}) | spans.header(), media_type=media_type)


def file(request: Request, headers: dict[str, str], content: tuple[bytes, str], spans: Spans | None = None) -> Response:
    """A file's bytes with their media type, or 304 where the client has them already."""
    body, media_type = content
    tag = f'"{hashlib.sha256(body).hexdigest()[:32]}"'
    headers = {"etag": tag, "cache-control": "no-cache"} | headers
    held = [one.strip().removeprefix("W/") for one in request.headers.get("if-none-match", "").split(",")]
    if tag in held:
        return Response(None, 304, headers)
    return response(body, media_type, spans or Spans(), headers)


def strict(data: Any) -> Any:
    """The data with "NaN", "Infinity" and "-Infinity" for what JSON has no number for (orjson would write null)."""
    if isinstance(data, float | np.floating):
        return float(data) if math.isfinite(data) else _word(float(data))
    if isinstance(data, np.ndarray):
        floating = data.dtype.kind == "f"
        return data if not floating or np.isfinite(data).all() else strict(data.tolist())
    if isinstance(data, dict):
        return {str(key): strict(value) for key, value in data.items()}
    return [strict(value) for value in data] if isinstance(data, list | tuple) else data


def _word(value: float) -> str:
    return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"


def vectors(values: Any, field: str) -> Array:
    """A JSON list of [x, y, z] as float64 of shape (n, 3); RequestError names the first entry that is not one."""
    if not isinstance(values, list):
        raise RequestError("must be a list of [x, y, z]", field)
    try:
        array = np.array(values, dtype=np.float64) if values else np.empty((0, 3))
    except (ValueError, TypeError, OverflowError):
        array = np.empty(0)
    # NumPy would take "1.5", true and null too; a look at the types costs as much as the conversion did
    if array.ndim != 2 or array.shape[1] != 3 or not _all_numbers(values):
        index = next(i for i, value in enumerate(values) if not _is_vector(value))
        raise RequestError(f"entry {index} is not three numbers", field, "each is [x, y, z]", index=index)
    check_finite(array, field)
    return array


def _all_numbers(values: list[list[Any]]) -> bool:
    kinds = {kind for x, y, z in values for kind in (type(x), type(y), type(z))}
    return kinds <= {float, int}


def _is_vector(value: Any) -> bool:
    return (
        isinstance(value, list) and len(value) == 3 and all(type(c) in (float, int) and abs(c) < 2**1024 for c in value)
    )


def check_finite(array: Array, field: str, first: int = 0) -> None:
    """RequestError names the first vector of an (n, 3) array that holds a NaN or an infinity, counted from `first`.

    The dot product with itself is finite only if all are; it costs half of looking at each, and an overflow is looked
    at again.
    """
    flat = array.reshape(-1)
    with np.errstate(over="ignore", invalid="ignore"):
        total = np.dot(flat, flat)
    if not np.isfinite(total):
        bad = ~np.isfinite(array).all(axis=1)
        if bad.any():
            index = first + int(bad.argmax())
            raise RequestError(f"vector {index} is not finite", field, "give finite numbers", index=index)


# binary


def raw_pairs(body: bytes | memoryview, dtype: str) -> tuple[Array, Array]:
    """All of a, then all of b, little-endian: two read-only views of shape (n, 3), nothing copied."""
    kind = DTYPES[dtype]
    if len(body) % (6 * kind.itemsize):
        fix = f"all of a, then all of b, {3 * kind.itemsize} bytes a vector; dtype says f4 or f8"
        raise MalformedError(f"{len(body)} bytes are no whole number of pairs of {dtype}", "(body)", fix)
    both = np.frombuffer(body, kind).reshape(2, -1, 3)
    return both[0], both[1]


def npy(body: bytes | memoryview, field: str = "(body)") -> Array:
    """The array of a version 1 to 3 .npy file of shape (2, n, 3), as a read-only view.

    numpy.load would believe a header that asks for terabytes, and take text, complex numbers, pickles and trailing
    bytes; here dtype, order, shape and length must be exactly right before anything is made.
    """
    data = memoryview(body)
    if bytes(data[:6]) != _NPY_MAGIC or len(data) < 10 or data[6] not in (1, 2, 3):
        raise MalformedError("this is no .npy file", field, "numpy.save makes one")
    width = 2 if data[6] == 1 else 4
    start = 8 + width
    length = int.from_bytes(data[8:start], "little")
    if length > min(_LONGEST_HEADER, len(data) - start):
        raise MalformedError("the .npy header is longer than it may be", field)
    kind, shape = _npy_header(bytes(data[start : start + length]), field)
    wanted = math.prod(shape) * kind.itemsize
    if len(data) - start - length != wanted:
        what = f"the .npy holds {len(data) - start - length} bytes of data, its header says {wanted}"
        raise MalformedError(what, field)
    return np.frombuffer(data, kind, offset=start + length).reshape(shape)


def _npy_header(text: bytes, field: str) -> tuple[np.dtype[Any], tuple[int, ...]]:
    try:
        header = ast.literal_eval(text.decode("latin-1").strip())
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        raise MalformedError("the .npy header cannot be read", field) from None
    if not isinstance(header, dict) or set(header) != {"descr", "fortran_order", "shape"}:
        raise MalformedError("the .npy header must have descr, fortran_order and shape", field)
    shape, descr = header["shape"], header["descr"]
    if descr not in ("<f4", "<f8") or header["fortran_order"] is not False:
        raise RequestError("the array must be little-endian float32 or float64 in C order", field)
    whole = isinstance(shape, tuple) and all(type(n) is int and 0 <= n < 1 << 48 for n in shape)
    if not whole or len(shape) != 3 or shape[0] != 2 or shape[2] != 3:
        raise RequestError("the array must have shape (2, n, 3)", field)
    return np.dtype(descr), shape


def npy_bytes(values: Array) -> bytes:
    """The array as a .npy file."""
    out = io.BytesIO()
    np.lib.format.write_array(out, np.ascontiguousarray(values), allow_pickle=False)
    return out.getvalue()


def binary(values: Array, media_type: str, spans: Spans) -> Response:
    """Values as little-endian octets or as .npy."""
    plain = values.astype(values.dtype.newbyteorder("<"), copy=False)
    body: Any = npy_bytes(plain) if media_type == NPY else np.ascontiguousarray(plain).data.cast("B")
    return response(body, media_type, spans, {"phongbench-dtype": f"f{plain.dtype.itemsize}"})
