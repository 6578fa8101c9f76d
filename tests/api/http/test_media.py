"""Bytes in and out: media types, strict JSON, and binary vectors that are exactly what they say."""

import contextlib
import io
import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from phongbench_api.http import arrays, media
from phongbench_api.http.problems import MalformedError, NotAcceptableError, RequestError

OFFERED = (media.JSON, media.CSV, media.PARQUET)


@pytest.mark.parametrize(
    ("accept", "expected"),
    [
        (None, media.JSON),
        ("", media.JSON),
        ("*/*", media.JSON),
        ("text/csv", media.CSV),
        ("TEXT/CSV", media.CSV),
        ("text/*", media.CSV),
        ("application/json;q=0.5, text/csv;q=0.6", media.CSV),
        ("application/json;q=0.5, text/csv;q=0.5", media.JSON),
        ("text/csv;q=0, */*", media.JSON),
        ("application/json;q=0, application/*;q=0.3, text/csv;q=0.2", media.PARQUET),
        ("text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8", media.JSON),
        ("nonsense, text/csv; q=0.1", media.CSV),
        ("text/csv;q=banana, application/json;q=0.1", media.JSON),
    ],
)
def test_accept_chooses_by_quality_then_by_our_order(accept: str | None, expected: str) -> None:
    assert media.negotiate(accept, OFFERED) == expected


@pytest.mark.parametrize("accept", ["image/png", "application/json;q=0", "*/*;q=0", "rubbish"])
def test_what_cannot_be_made_is_refused_with_what_can(accept: str) -> None:
    with pytest.raises(NotAcceptableError, match="Accept") as problem:
        media.negotiate(accept, OFFERED[:1])
    assert media.JSON in str(problem.value.fix)


@given(st.text(max_size=60))
def test_no_accept_header_breaks_the_negotiation(accept: str) -> None:
    with contextlib.suppress(NotAcceptableError):
        assert media.negotiate(accept, OFFERED) in OFFERED


@given(hnp.arrays(st.sampled_from([np.float32, np.float64]), st.integers(0, 20), elements={"allow_nan": True}))
def test_numbers_survive_strict_json(values: np.ndarray) -> None:
    def refuse(word: str) -> None:
        raise AssertionError(word)

    told = json.loads(media.json({"values": values}).body, parse_constant=refuse)["values"]
    assert np.array_equal(np.array([float(x) for x in told], values.dtype), values, equal_nan=True)
    assert [isinstance(x, str) for x in told] == [not math.isfinite(x) for x in values]


@pytest.mark.parametrize("body", [b"NaN", b"[1e999x]", b'{"a": Infinity}', b"", b"\xff", b'"\\ud800"', b"[" * 100000])
def test_what_is_no_json_is_malformed(body: bytes) -> None:
    with pytest.raises(MalformedError):
        media.parsed(body)


@pytest.mark.parametrize("number", ["1e999", "-1e999", "1" + "0" * 5000])
def test_numbers_too_large_for_a_double_are_refused_by_index(number: str) -> None:
    try:
        data = media.parsed(f"[[0, 0, 1], [0, {number}, 1]]".encode())
    except MalformedError:
        return
    with pytest.raises(RequestError) as problem:
        arrays.vectors(data, "a")
    assert problem.value.index == 1


@pytest.mark.parametrize(
    "bad", ["1.5", None, True, [0], [0, 0], [0, 0, 0, 0], [0, 0, None], [0, 0, "1"], [0, 0, True], {}, 7]
)
def test_the_first_entry_that_is_no_vector_is_named(bad: object) -> None:
    with pytest.raises(RequestError) as problem:
        arrays.vectors([[0, 0, 1], bad, [0, 0], [1, 2, 3]], "b")
    assert (problem.value.field, problem.value.index) == ("b", 1)


def test_vectors_that_are_not_finite_are_named_even_where_their_squares_overflow() -> None:
    arrays.check_finite(np.full((10, 3), 1e30, np.float32), "a")
    for value in (np.nan, np.inf, -np.inf):
        found = np.full((10, 3), 1e30, np.float32)
        found[7, 1] = value
        with pytest.raises(RequestError) as problem:
            arrays.check_finite(found, "a")
        assert problem.value.index == 7


@given(st.sampled_from(["<f4", "<f8"]), st.integers(0, 9), st.sampled_from([(1, 0), (2, 0), (3, 0)]))
def test_npy_is_read_as_numpy_reads_it_and_without_a_copy(dtype: str, n: int, version: tuple[int, int]) -> None:
    array = np.arange(6 * n, dtype=dtype).reshape(2, n, 3)
    out = io.BytesIO()
    np.lib.format.write_array(out, array, version)
    body = out.getvalue()
    found = arrays.npy(body)
    assert found.dtype == array.dtype
    assert np.array_equal(found, array)
    assert np.shares_memory(found, np.frombuffer(body, np.uint8)) or n == 0
    assert not found.flags.writeable


def _npy(descr: object = "<f4", shape: object = (2, 1, 3), order: object = False, data: bytes = b"\0" * 24) -> bytes:
    header = repr({"descr": descr, "fortran_order": order, "shape": shape}).encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + data


HOSTILE = {
    "four tebibytes": _npy(shape=(2, 1 << 38, 3)),
    "a bomb of dimensions": _npy(shape=(2, 10**30, 3)),
    "negative": _npy(shape=(2, -1, 3)),
    "trailing": _npy(data=b"\0" * 25),
    "short": _npy(data=b"\0" * 23),
    "big-endian": _npy(descr=">f4"),
    "complex": _npy(descr="<c8", shape=(2, 1, 3), data=b"\0" * 48),
    "text": _npy(descr="<U1"),
    "objects": _npy(descr="|O"),
    "structured": _npy(descr=[("x", "<f4")]),
    "fortran": _npy(order=True),
    "flags that only look false": _npy(order=0),
    "shape of booleans": _npy(shape=(2, True, 3)),
    "one row": _npy(shape=(1, 1, 3)),
    "flat": _npy(shape=(6,)),
    "empty": b"",
    "magic only": b"\x93NUMPY",
    "version 9": b"\x93NUMPY\x09\x00" + b"\0" * 100,
    "header beyond the body": b"\x93NUMPY\x01\x00\xff\xff{}",
    "code": b"\x93NUMPY\x01\x00\x20\x00" + b"__import__('os').system('true') ",
    "deep": b"\x93NUMPY\x01\x00\xd0\x07" + b"(" * 2000,
    "not a dict": b"\x93NUMPY\x01\x00\x02\x00[]" + b"\0" * 24,
}


@pytest.mark.parametrize("body", HOSTILE.values(), ids=HOSTILE.keys())
def test_a_hostile_npy_is_refused_before_anything_is_made(body: bytes) -> None:
    with pytest.raises(RequestError):
        arrays.npy(body)


@given(st.binary(max_size=200), st.integers(0, 150))
def test_no_npy_breaks_the_reader(noise: bytes, at: int) -> None:
    good = _npy()
    body = good[:at] + noise + good[at + len(noise) :]
    with contextlib.suppress(RequestError):
        assert arrays.npy(body).shape[0] == 2


@pytest.mark.parametrize(("dtype", "size"), [("f4", 24), ("f8", 48)])
def test_raw_pairs_are_views_and_must_be_whole(dtype: str, size: int) -> None:
    body = np.arange(5 * 6, dtype=arrays.DTYPES[dtype]).tobytes()
    a, b = arrays.raw_pairs(body, dtype)
    assert a.shape == b.shape == (5, 3)
    assert b[0, 0] == 15
    assert np.shares_memory(a, np.frombuffer(body, np.uint8))
    with pytest.raises(MalformedError):
        arrays.raw_pairs(body[: size - 1], dtype)
