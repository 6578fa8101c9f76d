"""Manifests, in pages."""

from typing import Any

from phongbench_api.http.problems import RequestError
from phongbench_api.models import PageAsk
from phongbench_api.runs.run_store import Store

#: predicted seconds of reading manifests
LISTING = 0.01
EXAMPLE_RUN: dict[str, Any] = {"run": "20260101-000000-0123abcd", "state": "complete"}
EXAMPLE: dict[str, Any] = {"runs": [EXAMPLE_RUN], "total": 1, "next": None}


def page(store: Store, ask: PageAsk) -> dict[str, Any]:
    """`runs` from the newest on, their `total` number, and the cursor of the `next` page or None.

    The cursor is the name of the last folder told, so that a run made meanwhile shifts nothing.
    """
    folders = store.folders()
    names = [path.name for path in folders]
    if ask.cursor is not None and ask.cursor not in names:
        raise RequestError("is not the `next` of an answer before", "cursor", "begin again without it")
    start = 0 if ask.cursor is None else names.index(ask.cursor) + 1
    chosen = folders[start : start + ask.limit]
    last = start + ask.limit
    following = names[last - 1] if last < len(folders) else None
    return {"runs": [store.told(path) for path in chosen], "total": len(folders), "next": following}
