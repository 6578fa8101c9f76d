"""Pages of other origins that may read answers, such as notebooks: those that `serve --cors` names, and no others."""

import re
from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.middleware.cors import CORSMiddleware
from starlette.responses import Response
from starlette.types import ASGIApp

from phongbench.errors import InputError
from phongbench_api.http import problems
from phongbench_api.http.middleware import HEADERS

#: what a page may read beside the answer, and what it may send beside what is always allowed
EXPOSED = ("phongbench-total", "phongbench-next", "phongbench-skipped", "server-timing", "retry-after", "etag")
SENT = ("content-type", "if-none-match")
_DEFAULT_PORTS = {"http": 80, "https": 443}
_LABEL = r"[a-z0-9_]([a-z0-9_-]{0,61}[a-z0-9_])?"
_HOST = re.compile(rf"(?=.{{1,253}}$){_LABEL}(\.{_LABEL})*|\[[0-9a-f:.]+\]")
_FIX = "give scheme, host and port as the browser's address bar has them, e.g. http://localhost:8888"


def origin(text: str) -> str:
    """An origin as browsers send it: lower case, without the port that its scheme has anyway.

    Raises InputError for what no page's Origin header can be, and for `*` and `null`, which any page could be.
    """
    if text in ("*", "null"):
        what = f"{text} would let any page in any tab read what is served here"
        raise InputError(what, "--cors", "name each origin, e.g. --cors http://localhost:8888")
    try:
        parts = urlsplit(text)
        port, host = parts.port, parts.netloc.rpartition("@")[2].lower()
    except ValueError as problem:
        raise InputError(f"{text!r} is no origin: {problem}", "--cors", _FIX) from None
    name = host if port is None else host.removesuffix(f":{port}")
    if parts.scheme not in _DEFAULT_PORTS or not _HOST.fullmatch(name) or not text.isascii():
        raise InputError(f"{text!r} is no origin of a web page", "--cors", _FIX)
    if text.lower() != f"{parts.scheme}://{host}":
        raise InputError(f"{text!r} holds more than an origin", "--cors", f"give {parts.scheme}://{host}")
    return f"{parts.scheme}://{name}" + ("" if port in (None, _DEFAULT_PORTS[parts.scheme]) else f":{port}")


class CrossOrigin(CORSMiddleware):
    """Answers preflights and marks every answer, problems too, for these origins; never with credentials."""

    def __init__(self, app: ASGIApp, origins: tuple[str, ...]) -> None:
        super().__init__(
            app,
            allow_origins=origins,
            allow_methods=("GET", "HEAD", "POST"),
            allow_headers=SENT,
            allow_private_network=True,  # a page of the web that was named may ask a server of this machine
            expose_headers=EXPOSED,
        )

    def preflight_response(self, request_headers: Headers) -> Response:
        """What a browser asks before a request that is not simple; a refusal is a problem document as all are."""
        response = super().preflight_response(request_headers)
        if response.status_code != 200:
            kept = {name: value for name, value in response.headers.items() if not name.startswith("content-")}
            what = "a page of that origin, or with that method or header, may not ask here"
            response = problems.answer(problems.KINDS[400], what, kept, mend="phongbench serve --cors ORIGIN")
        response.headers.update(HEADERS)
        return response
