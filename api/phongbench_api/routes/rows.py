"""The rows of a run's tables."""

from functools import partial

from fastapi import APIRouter, Request
from starlette.responses import Response

from phongbench_api.http import media as wire
from phongbench_api.http.openapi import described
from phongbench_api.runs import row_query
from phongbench_api.service import service

router = APIRouter(prefix="/v1/runs/{run}", tags=["runs"])


async def _rows(request: Request, run: str, table: str) -> Response:
    spans, home = wire.Spans(), service(request)
    media = wire.negotiate(request.headers.get("accept"), row_query.FAMILY)
    ask = row_query.asked(request, table, home.settings.max_rows)
    spans.mark("parse")
    work, encode = partial(row_query.page, home, run, table, ask), partial(row_query.answer, media)
    return await home.office.do(request, row_query.cost(ask), work, encode, spans)


def _add(table: str) -> None:
    async def rows(request: Request, run: str) -> Response:
        return await _rows(request, run, table)

    router.add_api_route(
        f"/{table}",
        rows,
        name=table,
        operation_id=f"rows_{table}",
        summary=f"Rows of {table}.parquet",
        description="Filtered by any key column (repeatable), with chosen `columns`, `sort`ed (`-` before a name: "
        "descending), in pages: `next` is the `cursor` of the following one.",
        openapi_extra={"parameters": row_query.parameters(table)},
        **described(row_query.EXAMPLE, 404, 406, 409, 422, 503, also=(wire.CSV, wire.PARQUET)),
    )


for name in row_query.KEYS:
    _add(name)
