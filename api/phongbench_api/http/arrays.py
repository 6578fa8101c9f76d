"""Vectors in requests and answers: of JSON, as little-endian octets, and as .npy files."""

import ast
import io
import math
from typing import Any

import numpy as np
from starlette.responses import Response

from phongbench.compiler.precisions import Array
from phongbench_api.http import media
from phongbench_api.http.media import Spans
from phongbench_api.http.problems import MalformedError, RequestError

#: dtypes of binary bodies, by the name a query gives them
DTYPES: dict[str, np.dtype[Any]] = {"f4": np.dtype("<f4"), "f8": np.dtype("<f8")}
_NPY_MAGIC = b"\x93NUMPY"
_LONGEST_HEADER = 4096


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
    body: Any = npy_bytes(plain) if media_type == media.NPY else np.ascontiguousarray(plain).data.cast("B")
    return media.response(body, media_type, spans, {"phongbench-dtype": f"f{plain.dtype.itemsize}"})
