"""Media types, strict JSON, and responses that say what they took."""

import hashlib
import time
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import orjson
from starlette.requests import Request
from starlette.responses import Response

from phongbench.support.strict_json import strict
from phongbench_api.http.problems import MalformedError, NotAcceptableError, UnsupportedMediaError

JSON, OCTETS, NPY = "application/json", "application/octet-stream", "application/x-npy"
CSV, SVG, PARQUET, PNG = "text/csv", "image/svg+xml", "application/vnd.apache.parquet", "image/png"
HTML, TEXT, MULTIPART = "text/html", "text/plain", "multipart/form-data"


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
