"""The OpenAPI document: what FastAPI cannot derive, added by the routes from the models."""

from collections.abc import Mapping
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel
from starlette.responses import Response

from phongbench import __version__
from phongbench_api.http import media
from phongbench_api.http.problems import KINDS, MEDIA
from phongbench_api.http.shapes import Answer

#: the member of an operation that holds a request for it
ASK = "x-request"
#: stands for None in examples, of which FastAPI leaves that out
_NONE = "\0none"
_PROBLEM = {
    "type": "object",
    "required": ["type", "title", "status", "detail"],
    "properties": {
        "type": {"type": "string", "format": "uri-reference"},
        "title": {"type": "string"},
        "status": {"type": "integer"},
        "detail": {"type": "string"},
        "mend": {"type": "string"},
        "errors": {
            "type": "array",
            "items": {
                "type": "object",
                "required": ["field", "detail"],
                "properties": {
                    "field": {"type": "string"},
                    "detail": {"type": "string"},
                    "index": {"type": "integer", "minimum": 0},
                },
            },
        },
    },
}
_ABOUT = "Shading on request, stored runs and finished reports. Nothing here writes, and nothing starts a measurement."


def described(made: Answer | None, *problems: int, also: tuple[str, ...] = (), ask: str = "") -> dict[str, Any]:
    """Arguments of a route: its answer as JSON, the other media types it makes, and the problems it may answer.

    ask  a request that is answered, as path and query, for /docs; left out: the path alone
    Every route may answer 421 (a foreign Host) and 415 (a compressed body) too.
    """
    content: dict[str, Any] = {kind: {"schema": {"type": "string", "format": "binary"}} for kind in also}
    if made is not None:
        content = {media.JSON: {"schema": made.schema, "example": _with(made.example, None, _NONE)}} | content
    responses: dict[int | str, Any] = {200: {"description": "The answer", "content": content}}
    for status in sorted({*problems, 415, 421}):
        reference = {"schema": {"$ref": "#/components/schemas/Problem"}}
        responses[status] = {"description": KINDS[status].title, "content": {MEDIA: reference}}
    return {"responses": responses, "response_class": _Raw} | ({"openapi_extra": {ASK: ask}} if ask else {})


def object_schema(properties: dict[str, Any], *required: str) -> dict[str, Any]:
    """The schema of an object that has these members and no others."""
    members: dict[str, Any] = {"type": "object", "additionalProperties": False, "properties": properties}
    return members | ({"required": list(required)} if required else {})


def query(model: type[BaseModel], *, optional: bool = False) -> list[dict[str, Any]]:
    """The parameters of a model as those of a query, for routes that read it themselves."""
    schema = model.model_json_schema(by_alias=True)
    required = () if optional else schema.get("required", ())
    return [
        {"name": name, "in": "query", "required": name in required, "description": about.pop("description", "")}
        | {"schema": about}
        for name, about in schema["properties"].items()
    ]


class _Raw(Response):
    """FastAPI shall add no content type of its own to the documentation."""

    media_type = None


def install(app: FastAPI) -> None:
    """Give the app its document, made once."""

    def document() -> dict[str, Any]:
        if app.openapi_schema is None:
            made = get_openapi(title="phongbench", version=__version__, description=_ABOUT, routes=app.routes)
            schemas = made.setdefault("components", {}).setdefault("schemas", {})
            schemas["Problem"] = _PROBLEM
            for name in ("HTTPValidationError", "ValidationError"):
                schemas.pop(name, None)
            for operation in _operations(made):
                _ours(operation)
            app.openapi_schema = made
        return app.openapi_schema

    app.openapi = document  # type: ignore[method-assign]  # FastAPI names this way of replacing it


def _operations(document: Mapping[str, Any]) -> list[dict[str, Any]]:
    return [operation for path in document["paths"].values() for operation in path.values()]


def _ours(operation: dict[str, Any]) -> None:
    """FastAPI documents its own form of a 422; ours is a problem document like all others."""
    answer = operation["responses"]["200"].get("content", {}).get(media.JSON, {})
    if "example" in answer:
        answer["example"] = _with(answer["example"], _NONE, None)
    refused = operation["responses"].get("422")
    if refused:
        reference = {"schema": {"$ref": "#/components/schemas/Problem"}}
        operation["responses"]["422"] = {"description": KINDS[422].title, "content": {MEDIA: reference}}


def _with(value: Any, old: str | None, new: str | None) -> Any:
    """The value with everything in it that is `old` replaced."""
    if isinstance(value, dict):
        return {name: _with(one, old, new) for name, one in value.items()}
    if isinstance(value, list):
        return [_with(one, old, new) for one in value]
    return new if value == old else value
