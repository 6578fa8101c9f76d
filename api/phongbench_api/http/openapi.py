"""The OpenAPI document: what FastAPI cannot know by itself, said by the routes in the same words as the models."""

from collections.abc import Mapping
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel
from starlette.responses import Response

from phongbench import __version__
from phongbench_api.http import media
from phongbench_api.http.problems import KINDS, MEDIA

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


def described(example: Any, *problems: int, also: tuple[str, ...] = ()) -> dict[str, Any]:
    """Arguments of a route: its answer by example, the other media types it makes, and the problems it may answer.

    Every route may answer 421 (a foreign Host) and 415 (a compressed body) too.
    """
    content: dict[str, Any] = {kind: {"schema": {"type": "string", "format": "binary"}} for kind in also}
    if example is not None:
        content |= {media.JSON: {"schema": _shape(example), "example": example}}
    responses: dict[int | str, Any] = {200: {"description": "The answer", "content": content}}
    for status in sorted({*problems, 415, 421}):
        reference = {"schema": {"$ref": "#/components/schemas/Problem"}}
        responses[status] = {"description": KINDS[status].title, "content": {MEDIA: reference}}
    return {"responses": responses, "response_class": _Raw}


def _shape(example: Any) -> dict[str, Any]:
    """The schema that an example stands for, as far as its members go."""
    if isinstance(example, dict):
        return {"type": "object", "required": sorted(example), "properties": {k: {} for k in example}}
    return {}


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
    refused = operation["responses"].get("422")
    if refused:
        reference = {"schema": {"$ref": "#/components/schemas/Problem"}}
        operation["responses"]["422"] = {"description": KINDS[422].title, "content": {MEDIA: reference}}
