"""What happens to every request before any route sees it: host, encoding, body limit, deadlines, headers of the answer.

Plain ASGI: a wrapper per request, no task and no copy.
"""

import asyncio
from typing import Any

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from phongbench_api import errors
from phongbench_api.errors import MisdirectedError, RequestError, UnsupportedMediaError
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


class Guard:
    """Checks a request's head, puts deadlines on its body and answer, and gives every answer the security headers."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self.app, self.settings = app, settings

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """ASGI's entry."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        answer = _Answer(send, self.settings.write_seconds)
        body = _Body(receive, self.settings.read_seconds)
        try:
            self._check(Headers(scope=scope))
        except RequestError as problem:
            await errors.of_error(problem)(scope, body.receive, answer.send)
            return
        await self.app(scope, body.receive, answer.send)

    def _check(self, headers: Headers) -> None:
        hosts, host = self.settings.hosts, _name(headers.get("host", ""))
        if hosts is not None and host not in hosts:
            raise MisdirectedError("this server does not answer for that host", "Host", "serve --allowed-host NAME")
        if headers.get("content-encoding", "identity").strip().lower() != "identity":
            what = "compressed bodies are not read: raw floats do not compress"
            raise UnsupportedMediaError(what, "Content-Encoding", headers={"accept-encoding": "identity"})


def _name(host: str) -> str:
    """The name in a Host header, without its port."""
    if host.startswith("["):
        return host[1:].partition("]")[0].lower()
    return host.partition(":")[0].lower().rstrip(".")


class _Body:
    """Receives a body with one deadline for all of it, so that a byte a second does not hold a connection."""

    def __init__(self, receive: Receive, seconds: float) -> None:
        self._receive, self._seconds = receive, seconds
        self._until: float | None = None
        self._done = False

    async def receive(self) -> Message:
        """The next piece; once the body is in, waiting for the client to leave has no deadline."""
        if self._done:
            return await self._receive()
        now = asyncio.get_running_loop().time()
        self._until = self._until or now + self._seconds
        try:
            async with asyncio.timeout_at(self._until):
                message = await self._receive()
        except TimeoutError:
            self._done = True
            raise errors.TimeoutRequestError(
                f"the body did not arrive within {self._seconds:g} s", headers={"connection": "close"}
            ) from None
        self._done = not message.get("more_body", False)
        return message


class _Answer:
    """Sends an answer with the security headers, each piece within its time."""

    def __init__(self, send: Send, seconds: float) -> None:
        self._send, self._seconds = send, seconds

    async def send(self, message: Message) -> None:
        """One message of the answer."""
        if message["type"] == "http.response.start":
            message["headers"] = [*message.get("headers", ()), *_missing(message.get("headers", ()))]
        async with asyncio.timeout(self._seconds):
            await self._send(message)


def _missing(given: Any) -> list[tuple[bytes, bytes]]:
    there = {name.lower() for name, _ in given}
    return [(name.encode(), value.encode()) for name, value in HEADERS.items() if name.encode() not in there]
