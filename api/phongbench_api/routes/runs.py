"""The stored runs, and the rows of their tables."""

from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from phongbench.results.schema import TABLES
from phongbench_api.answers import COLUMNS, RUN, RUNS
from phongbench_api.http import media
from phongbench_api.http.openapi import ASK, described
from phongbench_api.http.problems import RequestError
from phongbench_api.http.shapes import rows as rows_of
from phongbench_api.models import ColumnsParameters, PageParameters
from phongbench_api.runs import row_query, table_columns
from phongbench_api.runs.run_store import RunStore
from phongbench_api.service import service

router = APIRouter(prefix="/v1/runs", tags=["runs"])
#: predicted seconds of reading manifests
READING = 0.01


@router.get("", summary="Every stored run, newest first", **described(RUNS, 422, 503, ask="/v1/runs?limit=2"))
async def runs(request: Request, parameters: Annotated[PageParameters, Query()]) -> Response:
    """Manifests; a run whose manifest cannot be read is listed with the state `corrupt`."""
    here = service(request)
    work = lambda cancelled: _page(here.store, parameters)  # noqa: E731
    return await here.admission.run(request, READING, work, media.json, media.Spans())


@router.get("/{run}", summary="One run", **described(RUN, 404, 409, 503, ask="/v1/runs/latest"))
async def run(request: Request, run: str) -> Response:
    """The manifest of a run, by its id or `latest`."""
    here = service(request)
    work = lambda cancelled: here.store.summary(here.store.find(run).path)  # noqa: E731
    return await here.admission.run(request, READING, work, media.json, media.Spans())


def _page(store: RunStore, parameters: PageParameters) -> dict[str, Any]:
    """`runs` from the newest on, their `total` number, and the cursor of the `next` page or None.

    The cursor is the name of the last folder listed, so that a run made meanwhile shifts nothing.
    """
    folders = store.folders()
    names = [path.name for path in folders]
    if parameters.cursor is not None and parameters.cursor not in names:
        raise RequestError("is not the `next` of an answer before", "cursor", "begin again without it")
    start = 0 if parameters.cursor is None else names.index(parameters.cursor) + 1
    end = start + parameters.limit
    following = names[end - 1] if end < len(folders) else None
    return {"runs": [store.summary(path) for path in folders[start:end]], "total": len(folders), "next": following}


def _add_rows(table: str) -> None:
    async def rows(request: Request, run: str) -> Response:
        spans, here = media.Spans(), service(request)
        query = row_query.requested(request, table, here.settings.max_rows)
        media_type = query.media_type or media.negotiate(request.headers.get("accept"), row_query.FAMILY)
        spans.mark("parse")
        work = lambda cancelled: row_query.page(here.store, here.tables, run, table, query)  # noqa: E731
        return await here.admission.run(
            request, row_query.cost(query), work, partial(row_query.answer, media_type), spans
        )

    router.add_api_route(
        f"/{{run}}/{table}",
        rows,
        name=table,
        operation_id=f"rows_{table}",
        summary=f"Rows of {table}.parquet",
        description="Filtered by any key column (repeatable), with chosen `columns`, `sort`ed (`-` before a name: "
        "descending), in pages: `next` is the `cursor` of the following one.",
        openapi_extra={"parameters": row_query.parameters(table), ASK: row_query.request(table)},
        **described(rows_of(table, TABLES[table]), 404, 406, 409, 422, 503, also=(media.CSV, media.PARQUET)),
    )


for name in row_query.KEYS:
    _add_rows(name)


@router.get(
    "/{run}/columns",
    summary="The columns of a table",
    **described(COLUMNS, 404, 409, 422, 503, ask="/v1/runs/latest/columns?table=timing"),
)
async def columns(request: Request, run: str, parameters: Annotated[ColumnsParameters, Query()]) -> Response:
    """What each column of a table means, and the values by which its rows can be filtered, where they are few."""
    here = service(request)
    work = lambda cancelled: table_columns.columns(here.store, here.tables, run, parameters.table)  # noqa: E731
    return await here.admission.run(request, row_query.PAGE, work, media.json, media.Spans())
