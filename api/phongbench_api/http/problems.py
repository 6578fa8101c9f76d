"""Every error of the service as a problem document (RFC 9457), by one table. Nothing of the request is ever echoed."""

import logging
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import orjson
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from pydantic import ValidationError
from starlette.exceptions import HTTPException
from starlette.responses import Response

from phongbench.errors import CorruptRunError, InputError, PhongbenchError, UnknownNameError

log = logging.getLogger("phongbench.api")
#: fields that are entries of a list, whose index is named
_ENTRY = re.compile(r"(?:points|normals|scene\.(?:objects|lights|materials))\[(\d+)\]")
MEDIA = "application/problem+json"


class RequestError(InputError):
    """A request that cannot be answered.

    field    the parameter, key or header it is about
    index    the first bad element of an array
    headers  that the answer carries
    """

    def __init__(
        self,
        what: str,
        field: str | None = None,
        fix: str | None = None,
        *,
        index: int | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(what, field, fix)
        self.field, self.index, self.headers = field, index, dict(headers or {})


class MalformedError(RequestError):
    """Bytes that are not what their media type says."""


class NotFoundError(RequestError):
    """Nothing is stored under that name."""


class NotAcceptableError(RequestError):
    """None of the media types that Accept names can be made."""


class TimeoutRequestError(RequestError):
    """The body did not arrive in time."""


class TooLargeError(RequestError):
    """More bytes, points or work than the server takes."""


class UnsupportedMediaError(RequestError):
    """A media type or encoding that the server does not read."""


class MisdirectedError(RequestError):
    """A Host that this server does not answer for."""


class BusyError(RequestError):
    """The server has enough to do; the answer says when to come back."""


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of problem: its slug (the end of `type`, an anchor of /docs), status and title."""

    slug: str
    status: int
    title: str


#: the one table from errors to statuses; the first that fits counts
STATUS: tuple[tuple[type[Exception], Kind], ...] = (
    (MalformedError, Kind("malformed", 400, "The body or query is not what it claims to be")),
    (NotFoundError, Kind("not-found", 404, "There is no such thing here")),
    (NotAcceptableError, Kind("not-acceptable", 406, "No acceptable form of this exists")),
    (TimeoutRequestError, Kind("timeout", 408, "The request did not arrive in time")),
    (CorruptRunError, Kind("corrupt-result", 409, "The stored run is not what was written")),
    (TooLargeError, Kind("too-large", 413, "The request is too large")),
    (UnsupportedMediaError, Kind("unsupported-media", 415, "The service does not read this media type")),
    (MisdirectedError, Kind("misdirected", 421, "The service does not answer for this host")),
    (BusyError, Kind("busy", 503, "The service is busy")),
    (InputError, Kind("invalid", 422, "The request asks for something that cannot be")),
    (PhongbenchError, Kind("failed", 500, "The service failed")),
)
KINDS: dict[int, Kind] = {kind.status: kind for _, kind in STATUS} | {
    405: Kind("method-not-allowed", 405, "This method is not allowed here"),
    416: Kind("range", 416, "This range cannot be satisfied"),
}


def kind_of(problem: Exception) -> Kind:
    """The kind of problem an error is."""
    return next(kind for error, kind in STATUS if isinstance(problem, error))


def document(kind: Kind, detail: str, **more: Any) -> dict[str, Any]:
    """A problem document; `more` are its own members, those that are None left out."""
    members = {"type": f"/docs#{kind.slug}", "title": kind.title, "status": kind.status, "detail": detail}
    return members | {name: value for name, value in more.items() if value is not None}


def answer(kind: Kind, detail: str, headers: Mapping[str, str] | None = None, **more: Any) -> Response:
    """The problem document as a response."""
    body = orjson.dumps(document(kind, detail, **more))
    return Response(body, kind.status, dict(headers or {}) | {"cache-control": "no-store"}, media_type=MEDIA)


def of_error(problem: PhongbenchError) -> Response:
    """The response to a deliberate error: what, where and how to fix it, and nothing that the client sent."""
    detail, fix = problem.what, problem.fix
    if isinstance(problem, UnknownNameError):
        detail, fix = f"unknown {problem.kind}", f"known: {', '.join(problem.known)}"
    if isinstance(problem, CorruptRunError):
        detail, fix = "the files of this run do not match its manifest", "restore it from a copy; other runs work"
    where = problem.where if isinstance(problem, RequestError) else None
    headers = problem.headers if isinstance(problem, RequestError) else {}
    index = problem.index if isinstance(problem, RequestError) else None
    named = [{"field": where, "detail": detail} | ({"index": index} if index is not None else {})] if where else None
    return answer(kind_of(problem), detail, headers, mend=fix, errors=named)


def of_validation(details: Sequence[Mapping[str, Any]]) -> Response:
    """The response to values that a model refused: which fields, and what they must be."""
    errors = [{"field": _field(error), "detail": str(error["msg"])} for error in details[:20]]
    return answer(KINDS[422], f"{errors[0]['field']}: {errors[0]['detail']}", errors=errors)


def _field(error: Mapping[str, Any]) -> str:
    """Where the value stands, as a dotted path; a name that no model knows came from the client and stays there."""
    path = [part for part in error["loc"] if part not in ("query", "body", "path", "header")]
    if error["type"] == "extra_forbidden":
        path = [*path[:-1], "(unknown)"]
    return ".".join(map(str, path)) or "(body)"


@contextmanager
def request_errors(field: str | None = None) -> Iterator[None]:
    """The library's errors inside become RequestErrors that name their field and repeat nothing of what was sent.

    field  the field to name, instead of the one that the library names
    """
    try:
        yield
    except RequestError:
        raise
    except InputError as problem:
        what, fix = problem.what, problem.fix
        if isinstance(problem, UnknownNameError):
            what, fix = f"unknown {problem.kind}", f"known: {', '.join(problem.known)}"
        entry = _ENTRY.match(problem.where or "")
        raise RequestError(what, field or problem.where, fix, index=int(entry[1]) if entry else None) from None


def install(app: FastAPI) -> None:
    """Make every error of this app a problem document."""

    async def deliberate(_: Request, problem: Exception) -> Response:
        assert isinstance(problem, PhongbenchError)
        return of_error(problem)

    async def refused(_: Request, problem: Exception) -> Response:
        assert isinstance(problem, RequestValidationError | ValidationError)
        return of_validation(problem.errors())

    async def http(_: Request, problem: Exception) -> Response:
        assert isinstance(problem, HTTPException)
        kind = KINDS.get(problem.status_code, Kind("http", problem.status_code, "The request cannot be answered"))
        return answer(kind, kind.title, problem.headers)

    async def unforeseen(_: Request, problem: Exception) -> Response:
        # Starlette raises it again after the answer, so that the server logs the traceback.
        return answer(KINDS[500], "a fault of the service; its log has more")

    app.add_exception_handler(PhongbenchError, deliberate)
    app.add_exception_handler(RequestValidationError, refused)
    app.add_exception_handler(ValidationError, refused)
    app.add_exception_handler(HTTPException, http)
    app.add_exception_handler(Exception, unforeseen)


class Cancelled(Exception):  # noqa: N818  not an error: the client is gone
    """The client is gone; nobody wants the result."""
