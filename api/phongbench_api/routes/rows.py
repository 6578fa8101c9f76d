"""The rows of a run's tables."""

from fastapi import APIRouter, Request
from starlette.responses import Response

from phongbench_api import tables, wire
from phongbench_api.openapi import described
from phongbench_api.service import service

router = APIRouter(prefix="/v1/runs/{run}", tags=["runs"])


async def _rows(request: Request, run: str, table: str) -> Response:
    spans, home = wire.Spans(), service(request)
    media = wire.negotiate(request.headers.get("accept"), tables.FAMILY)
    ask = tables.asked(request, table, home.settings.max_rows)
    spans.mark("parse")
    found = await home.office.do(request, tables.PAGE, lambda gone: tables.page(home, run, table, ask), spans)
    return tables.answer(found, media, spans)


def _add(table: str) -> None:
    async def rows(request: Request, run: str) -> Response:
        return await _rows(request, run, table)

    router.add_api_route(
        f"/{table}", rows, name=table, operation_id=f"rows_{table}", summary=f"Rows of {table}.parquet",
        description="Filtered by any key column (repeatable), with chosen `columns`, `sort`ed (`-` before a name: "
        "descending), in pages: `next` is the `cursor` of the following one.",
        openapi_extra={"parameters": tables.parameters(table)},
        **described(tables.EXAMPLE, 404, 406, 409, 422, 503, also=(wire.CSV, wire.PARQUET)),
    )  # fmt: skip


for name in tables.KEYS:
    _add(name)
