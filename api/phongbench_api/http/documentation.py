"""The OpenAPI document as a page without scripts: requests for curl, examples, and what the members of answers mean."""

import json
import re
import shlex
from collections.abc import Iterator, Mapping
from typing import Any

from jinja2 import Environment, PackageLoader
from markupsafe import Markup, escape

from phongbench import __version__
from phongbench_api.http import media, problems
from phongbench_api.http.openapi import ASK
from phongbench_api.http.shapes import NOT_FINITE

ORIGIN = "http://localhost:8000"
_CODE = re.compile(r"`([^`]+)`")
_WIDTH = 100


def page(api: Mapping[str, Any]) -> str:
    """The page of an OpenAPI document."""
    loader = PackageLoader("phongbench_api")
    templates = Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    templates.filters |= {"prose": prose, "laid_out": laid_out, "members": members}
    kinds = {kind for _, kind in problems.STATUS} | set(problems.KINDS.values())
    refused = problems.document(problems.KINDS[422], "must be at most 100000", errors=[{"field": "alpha"}])
    return templates.get_template("docs.html.j2").render(
        api=api, curl=curl, kinds=sorted(kinds, key=lambda kind: kind.status), refused=refused, version=__version__
    )


def prose(text: str) -> Markup:
    """Text with what stands between backticks as code."""
    return Markup(_CODE.sub(r"<code>\1</code>", str(escape(text))))


def laid_out(value: Any, indent: str = "") -> str:
    """JSON of which a list of plain values, and whatever is short, stands on one line."""
    flat, inner = json.dumps(value, ensure_ascii=False), indent + "  "
    nested = isinstance(value, dict) or (isinstance(value, list) and any(isinstance(one, dict) for one in value))
    if not value or not nested or len(indent + flat) <= _WIDTH:
        return flat
    if isinstance(value, dict):
        parts = [f"{inner}{json.dumps(name)}: {laid_out(one, inner)}" for name, one in value.items()]
        return "{\n" + ",\n".join(parts) + f"\n{indent}}}"
    return "[\n" + ",\n".join(inner + laid_out(one, inner) for one in value) + f"\n{indent}]"


def curl(method: str, path: str, operation: Mapping[str, Any]) -> str:
    """The command that sends the documented request and prints its answer, or stores a picture."""
    address = operation.get(ASK, path)
    words = ["curl", shlex.quote(ORIGIN + address)]
    answers = operation["responses"]["200"]["content"]
    if media.JSON in answers and len(answers) > 1:
        words.append(f"-H 'Accept: {media.JSON}'")
    if method == "post":
        body = operation["requestBody"]["content"][media.JSON]["example"]
        words += [f"-H 'Content-Type: {media.JSON}'", f"-d {shlex.quote(json.dumps(body, ensure_ascii=False))}"]
    if address.endswith(".svg"):
        words.append(f"-o {address.rpartition('/')[2]}")
    one = " ".join(words)
    return one if len(one) <= _WIDTH else " \\\n  ".join([" ".join(words[:2]), *words[2:]])


def members(schema: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, str, str]]:
    """Every member of an answer that has a meaning, or members of its own: its path, its kind, its meaning."""
    options = schema.get("anyOf", [schema])
    for option in options:
        if option.get("type") == "array":
            yield from members(option.get("items", {}), f"{path}[]")
        for name, member in option.get("properties", {}).items():
            place = f"{path}.{name}" if path else name
            yield place, kind(member), member.get("description", "")
            yield from members(member, place)
        if isinstance(option.get("additionalProperties"), dict):
            yield from members(option["additionalProperties"], f"{path}.*")


def kind(schema: Mapping[str, Any]) -> str:
    """What a value is, in a word or two."""
    if "anyOf" in schema:
        return " or ".join(dict.fromkeys(kind(option) for option in schema["anyOf"] if option != NOT_FINITE))
    if "enum" in schema:
        return " | ".join(map(str, schema["enum"]))
    return f"list of {kind(schema['items'])}" if "items" in schema else str(schema.get("type", "any"))
