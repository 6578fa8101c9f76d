"""Reading a request's body, within its limit and the server's room for bodies."""

from starlette.requests import Request

from phongbench_api.http import media
from phongbench_api.http.problems import TooLargeError
from phongbench_api.settings import Settings
from phongbench_api.work.admission import Admission


async def read(request: Request, limit: int, admission: Admission) -> bytes:
    """The whole body; TooLargeError beyond `limit` bytes, whether they were declared or only come."""
    declared = request.headers.get("content-length")
    if declared is not None and int(declared) > limit:
        raise _too_large(limit)
    pieces, size = [], 0
    async with admission.receiving(limit if declared is None else int(declared)):
        async for piece in request.stream():
            size += len(piece)
            if size > limit:
                raise _too_large(limit)
            pieces.append(piece)
    return b"".join(pieces)


def check_count(count: int, field: str, answer_type: str, settings: Settings) -> None:
    """TooLargeError for more vectors than a request may hold, or than an answer in JSON may."""
    if count > settings.max_points:
        raise TooLargeError(f"more than {settings.max_points} vectors", field, "ask in parts")
    if answer_type == media.JSON and count > settings.max_json_points:
        what = f"more than {settings.max_json_points} vectors, which is too much JSON"
        raise TooLargeError(what, field, f"ask for bytes: Accept: {media.OCTETS}")


def _too_large(limit: int) -> TooLargeError:
    fix = "ask in parts, or send binary vectors; GET /v1/meta tells the limits"
    return TooLargeError(f"the body is larger than {limit} bytes", "(body)", fix, headers={"connection": "close"})
