"""The OpenAPI document and /docs: every answer has a schema and an example, and they are what the server answers."""

import html
import json
import re
from collections.abc import Iterator
from typing import Any

import jsonschema_rs
import pytest
from curl_words import sent
from hypothesis import given, settings
from hypothesis import strategies as st
from starlette.testclient import TestClient

from phongbench_api.app import create_app
from phongbench_api.http import documentation, media, problems, shapes

DOCUMENT = create_app().openapi()
OPERATIONS = {
    found["operationId"]: (path, method, found)
    for path, members in DOCUMENT["paths"].items()
    for method, found in members.items()
}


def answers(operation: dict[str, Any]) -> dict[str, Any]:
    return dict(operation["responses"]["200"]["content"])


#: operations that answer JSON
DOCUMENTS = {
    name: answers(found[2])[media.JSON] for name, found in OPERATIONS.items() if media.JSON in answers(found[2])
}


def leaves(schema: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Every part of a schema that says nothing of parts of its own."""
    parts = [*schema.get("anyOf", ()), *schema.get("properties", {}).values()]
    parts += [schema[name] for name in ("items", "additionalProperties") if isinstance(schema.get(name), dict)]
    yield from [leaf for part in parts for leaf in leaves(part)] if parts else [schema]


def undocumented(schema: dict[str, Any], answer: Any, path: str = "") -> Iterator[str]:
    """Members of an answer that no branch of its schema knows."""
    options = schema.get("anyOf", [schema])
    if isinstance(answer, list):
        items = next((option["items"] for option in options if "items" in option), {})
        for one in answer[:3]:
            yield from undocumented(items, one, f"{path}[]")
    known = next((option["properties"] for option in options if "properties" in option), None)
    if isinstance(answer, dict) and known is not None:
        yield from (f"{path}.{name}" for name in answer if name not in known)
        for name in answer.keys() & known.keys():
            yield from undocumented(known[name], answer[name], f"{path}.{name}")


@pytest.mark.parametrize("name", OPERATIONS)
def test_every_operation_says_what_it_answers(name: str) -> None:
    found = answers(OPERATIONS[name][2])
    assert found
    for about in found.values():
        assert all(set(leaf) & {"type", "enum"} for leaf in leaves(about["schema"]))


@pytest.mark.parametrize("name", DOCUMENTS)
def test_every_example_is_one(name: str) -> None:
    schema, example = DOCUMENTS[name]["schema"], DOCUMENTS[name]["example"]
    assert example
    jsonschema_rs.validator_for(schema).validate(example)
    assert list(undocumented(schema, example)) == []
    spoilt = {key: value for key, value in example.items() if key != schema["required"][0]}
    assert not jsonschema_rs.validator_for(schema).is_valid(spoilt), "a schema that takes anything shows nothing"


def commands(client: TestClient) -> dict[str, str]:
    """The command that /docs shows for each operation, by its id."""
    sections = re.findall(r'<section id="(\w+)">(.*?)</section>', client.get("/docs").text, re.DOTALL)
    shown = {name: re.search(r"<pre[^>]*><code>(curl .*?)</code>", text, re.DOTALL) for name, text in sections}
    return {name: html.unescape(found[1]) for name, found in shown.items() if found}


def test_every_command_shown_is_answered_as_it_is_documented(client: TestClient) -> None:
    shown = commands(client)
    assert shown.keys() == OPERATIONS.keys()
    unmeasured, unknown = [], []
    for name, command in shown.items():
        method, path, options, out = sent(command)
        answer = client.request(method, path, **options)
        if answer.status_code == 404 and "has no table" in answer.json()["detail"]:
            unmeasured.append(name)
            continue
        assert answer.status_code == 200, (command, answer.text)
        assert (out is not None) == (answer.headers["content-type"] == media.SVG)
        if name in DOCUMENTS:
            schema = DOCUMENTS[name]["schema"]
            jsonschema_rs.validator_for(schema).validate(answer.json())
            unknown += [(name, member) for member in undocumented(schema, answer.json())]
    assert unknown == []
    assert {"rows_accuracy", "rows_timing"} & set(unmeasured) == set()


def test_the_columns_of_rows_are_documented_with_meaning_and_unit() -> None:
    row = DOCUMENTS["rows_timing"]["schema"]["properties"]["rows"]["items"]["properties"]
    assert row["ns_min"]["description"].endswith(", in ns")
    assert {"type": "null"} in row["gamma"]["anyOf"]


def test_the_page_shows_examples_and_no_marks_of_markdown(client: TestClient) -> None:
    page = client.get("/docs").text
    text = html.unescape(page)
    for name, about in DOCUMENTS.items():
        assert documentation.laid_out(about["example"]) in text, name
    prose = re.sub(r"<pre.*?</pre>", "", page, flags=re.DOTALL)
    assert "`" not in prose
    assert "<code>next</code>" in prose
    for _, kind in problems.STATUS:
        assert f'id="{kind.slug}"' in page


plain = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text()


@settings(max_examples=200, deadline=None, database=None)
@given(st.recursive(plain, lambda inner: st.lists(inner, max_size=5) | st.dictionaries(st.text(), inner, max_size=5)))
def test_layout_changes_nothing(value: Any) -> None:
    assert json.loads(documentation.laid_out(value)) == value


def test_a_list_of_plain_values_stands_on_one_line_however_long() -> None:
    numbers = [i / 7 for i in range(40)]
    lines = documentation.laid_out({"values": numbers, "rows": [{"a": numbers}, {"b": 1}], "none": []}).splitlines()
    assert sum(json.dumps(numbers) in line for line in lines) == 2
    assert '    {"b": 1}' in lines


def test_prose_marks_code_and_nothing_else() -> None:
    assert documentation.prose("`a<b` & <i>") == "<code>a&lt;b</code> &amp; &lt;i&gt;"


@pytest.mark.parametrize(
    ("schema", "told"),
    [
        (shapes.REAL, "number"),
        (shapes.or_none(shapes.REAL), "number or null"),
        (shapes.list_of(shapes.TEXT), "list of string"),
        ({"enum": ["on", "off"]}, "on | off"),
    ],
)
def test_kinds_in_words(schema: dict[str, Any], told: str) -> None:
    assert documentation.kind(schema) == told


def test_a_schema_of_an_example_tells_what_may_be_missing() -> None:
    schema = shapes.of({"a": 1, "b": [{"c": 0.5, "d": "x"}], "e": True}, "c")
    check = jsonschema_rs.validator_for(schema)
    assert check.is_valid({"a": 2, "b": [{"c": None, "d": ""}], "e": False, "more": 1})
    assert not check.is_valid({"a": None, "b": [], "e": False})
    assert not check.is_valid({"a": 1, "b": [{"c": "large", "d": ""}], "e": False})
    assert check.is_valid({"a": 1, "b": [{"c": "NaN", "d": ""}], "e": False})
