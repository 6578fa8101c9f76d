"""What happens to every request before any route sees it: host, encoding, deadlines, and the headers of the answer.

Plain ASGI: a wrapper per request, no task and no copy.
"""

import asyncio
from typing import Any

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from phongbench_api.http import problems
from phongbench_api.http.problems import (
    Cancelled,
    MalformedError,
    MisdirectedError,
    RequestError,
    UnsupportedMediaError,
)
from phongbench_api.settings import Settings

#: no outside host, nothing inline, no frames; the page's own files and nothing else
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; font-src 'self'; "
    "connect-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
#: figures carry their styles inside, and a stored report may be anyone's: styles, and no script at all
STORED_POLICY = "default-src 'none'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; sandbox"
HEADERS = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
}
#: seconds that what is left of a refused body is read and thrown away; a socket closed on unread bytes resets the
#: connection, and the client would never see why it was refused
LINGER_SECONDS = 2.0


class Guard:
    """Checks a request's head, puts deadlines on its body and answer, and gives every answer the security headers."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self.app, self.settings = app, settings

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """ASGI's entry. A client that left, or does not take its answer, ends it without an error."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        body = _Body(receive, self.settings, headers)
        answer = _Answer(send, self.settings.write_seconds, body, head=scope["method"] == "HEAD")
        # what answers GET answers HEAD: the same headers, and nothing after them
        scope = {**scope, "method": "GET"} if answer.head else scope
        try:
            self._check(headers)
            await self.app(scope, body.receive, answer.send)
        except RequestError as problem:
            await problems.of_error(problem)(scope, body.receive, answer.send)
        except (Cancelled, _StalledError):
            pass

    def _check(self, headers: Headers) -> None:
        hosts = self.settings.hosts
        if hosts is not None and _name(headers.get("host", "")) not in hosts:
            raise MisdirectedError("this server does not answer for that host", "Host", "serve --allowed-host NAME")
        if headers.get("content-encoding", "identity").strip().lower() != "identity":
            what = "compressed bodies are not read: raw floats do not compress"
            raise UnsupportedMediaError(what, "Content-Encoding", headers={"accept-encoding": "identity"})
        length = headers.get("content-length", "0")
        if not (length.isascii() and length.isdigit() and len(length) < 16):
            raise MalformedError("Content-Length is not a length", "Content-Length")


def _name(host: str) -> str:
    """The name in a Host header, without its port."""
    if host.startswith("["):
        return host[1:].partition("]")[0].lower()
    return host.partition(":")[0].lower().rstrip(".")


class _StalledError(Exception):
    """The client does not take its answer."""


class _Body:
    """Receives a body with one deadline for all of it, so that a byte a second does not hold a connection.

    done  the body is complete: the next message tells that the client left, and has no deadline
    """

    def __init__(self, receive: Receive, settings: Settings, headers: Headers) -> None:
        self._receive, self._settings = receive, settings
        self._until: float | None = None
        self.done = headers.get("content-length", "0") == "0" and "transfer-encoding" not in headers
        #: a client that waits for "100 Continue" has sent nothing, and what is far too large is not read to its end
        declared = headers.get("content-length", "0")
        modest = len(declared) < 16 and declared.isdigit() and int(declared) <= 2 * settings.max_body
        self._worth_reading = modest and "expect" not in headers

    async def receive(self) -> Message:
        """The next piece of the body."""
        if self.done:
            return await self._receive()
        self._until = self._until or asyncio.get_running_loop().time() + self._settings.read_seconds
        try:
            async with asyncio.timeout_at(self._until):
                message = await self._receive()
        except TimeoutError:
            self.done = True
            what = f"the body did not arrive within {self._settings.read_seconds:g} s"
            raise problems.TimeoutRequestError(what, headers={"connection": "close"}) from None
        self.done = not message.get("more_body", False)
        return message

    @property
    def unread(self) -> bool:
        """True if there is something left that is worth reading before the connection closes."""
        return not self.done and self._worth_reading

    async def throw_away(self) -> None:
        """Read what is left, within bounds of time and size."""
        left = self._settings.max_body
        try:
            async with asyncio.timeout(LINGER_SECONDS):
                while not self.done and left > 0:
                    message = await self._receive()
                    left -= len(message.get("body", b""))
                    self.done = not message.get("more_body", False)
        except TimeoutError:
            self.done = True


class _Answer:
    """Sends an answer with the security headers, each piece within its time."""

    def __init__(self, send: Send, seconds: float, body: _Body, *, head: bool) -> None:
        self._send, self._seconds, self._body, self.head = send, seconds, body, head

    async def send(self, message: Message) -> None:
        """One message of the answer; its last one waits until the request's body is in, or thrown away."""
        if message["type"] == "http.response.start":
            message["headers"] = [*message.get("headers", ()), *_missing(message.get("headers", ()))]
        elif self.head:
            message["body"] = b""
        if message["type"] == "http.response.body" and not message.get("more_body") and self._body.unread:
            await self._pass({**message, "more_body": True})
            await self._body.throw_away()
            message = {"type": "http.response.body", "body": b""}
        await self._pass(message)

    async def _pass(self, message: Message) -> None:
        try:
            async with asyncio.timeout(self._seconds):
                await self._send(message)
        except TimeoutError:
            raise _StalledError from None


def _missing(headers: Any) -> list[tuple[bytes, bytes]]:
    there = {name.lower() for name, _ in headers}
    return [(name.encode(), value.encode()) for name, value in HEADERS.items() if name.encode() not in there]
