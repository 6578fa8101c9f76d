"""Reading a request's body, within its limit and the server's room for bodies."""

from starlette.requests import Request

from phongbench_api.errors import MalformedError, TooLargeError
from phongbench_api.work import Office


async def read(request: Request, limit: int, office: Office) -> bytes:
    """The whole body; TooLargeError beyond `limit` bytes, whether they were declared or only come."""
    declared = _declared(request)
    if declared is not None and declared > limit:
        raise _too_large(limit)
    async with office.room(limit if declared is None else declared):
        pieces, size = [], 0
        async for piece in request.stream():
            size += len(piece)
            if size > limit:
                raise _too_large(limit)
            pieces.append(piece)
    return b"".join(pieces)


def _declared(request: Request) -> int | None:
    text = request.headers.get("content-length")
    if text is None:
        return None
    if not (text.isascii() and text.isdigit()) or len(text) > 15:
        raise MalformedError("Content-Length is not a length", "Content-Length")
    return int(text)


def _too_large(limit: int) -> TooLargeError:
    mend = "ask in parts" if limit > 1 << 25 else "ask in parts, or send binary vectors"
    return TooLargeError(f"the body is larger than {limit} bytes", "(body)", mend, headers={"connection": "close"})
