"""`python -m load.server`: the service on a free port of loopback, with one route more.

`POST /echo?answer=BYTES` reads a body as every route does and answers its first bytes: what moving alone costs. The
service itself has no such route, and no switch for one.
"""

import sys
from pathlib import Path

from fastapi import FastAPI, Request
from starlette.responses import Response

from phongbench_api.app import create_app
from phongbench_api.http import media
from phongbench_api.serve import serve
from phongbench_api.service import service
from phongbench_api.settings import Settings
from phongbench_api.work import request_bodies


async def echo(request: Request) -> Response:
    """The first bytes of the body, as many as the query asks for."""
    here = service(request)
    body = await request_bodies.read(request, here.settings.max_body, here.admission)
    return Response(memoryview(body)[: int(request.query_params["answer"])], media_type=media.OCTETS)


def echoing(settings: Settings) -> FastAPI:
    """The application with the echo."""
    app = create_app(settings)
    app.add_api_route("/echo", echo, methods=["POST"], include_in_schema=False)
    return app


if __name__ == "__main__":
    chosen = Settings(port=0, runs=Path(sys.argv[1]))
    serve(chosen, echoing(chosen))
