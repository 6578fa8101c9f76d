"""No request finds a 5xx, an echo, JSON that is not strict, or growing memory: by schema, by corpus, by mutation."""

import asyncio
import itertools
import os
from collections.abc import Callable
from typing import Any
from urllib.parse import quote

import pytest
import schemathesis
from fastapi import FastAPI
from hypothesis import HealthCheck, given, seed, settings
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi import checks
from starlette.testclient import TestClient

from fuzzing import hostile
from fuzzing.requests import Sent, Source
from fuzzing.run import ask, faults, fuzz
from phongbench_api.app import create_app
from phongbench_api.settings import Settings

#: of the random stream; `PYTHONPATH=tests/api python -m fuzzing --requests 100000` sends more
REQUESTS = int(os.environ.get("PHONGBENCH_FUZZ", "2000"))
#: examples for each operation of the document
EXAMPLES = 12
#: the largest picture that is drawn here; larger ones are refused, which costs no time
PIXELS = 4096


@pytest.fixture(scope="session")
def schema(client_of: Callable[..., TestClient]) -> dict[tuple[str, str], Any]:
    """The operations of the document as schemathesis reads it, over an application of its own."""
    app: Any = client_of(allowed_hosts=("testserver",), max_pixels=PIXELS).app
    read = schemathesis.openapi.from_asgi("/openapi.json", app)
    return {(found.path, found.method): found for found in (one.ok() for one in read.get_all_operations())}


OPERATIONS = sorted((path, kind) for path, members in create_app().openapi()["paths"].items() for kind in members)


@pytest.mark.parametrize(("path", "method"), OPERATIONS)
def test_the_document_tells_what_the_service_does(schema: dict[tuple[str, str], Any], path: str, method: str) -> None:
    # schemathesis' own parametrize reaches into pytest's inside, which pytest 9 has changed
    operation = schema[path, method]

    @seed(1)
    @settings(max_examples=EXAMPLES, database=None, deadline=None, suppress_health_check=list(HealthCheck))
    @given(operation.as_strategy())
    def conforms(case: Any) -> None:
        case.validate_response(case.call(), checks=CHECKS)

    conforms()


def not_a_server_error_but_busy(ctx: Any, response: Any, case: Any) -> bool | None:
    """503 with Retry-After is how a full server says no."""
    if response.status_code == 503 and "retry-after" in response.headers:
        return None
    return bool(not_a_server_error(ctx, response, case))


CHECKS = [
    not_a_server_error_but_busy,
    checks.status_code_conformance,
    checks.content_type_conformance,
    checks.response_schema_conformance,
]


def answers(app: FastAPI, requests: list[Sent]) -> list[tuple[Sent, list[str]]]:
    """The faults in the answers to some requests."""

    async def run() -> list[tuple[Sent, list[str]]]:
        return [(sent, faults(*await ask(app, sent))) for sent in requests]

    return asyncio.run(run())


@pytest.fixture
def fresh(client_of: Callable[..., TestClient]) -> FastAPI:
    """A warm application of its own, for an event loop of its own."""
    app: Any = client_of(max_pixels=PIXELS).app
    return app


@pytest.mark.parametrize("kind", hostile.BODIES)
def test_no_hostile_body_breaks_an_endpoint_that_reads_one(fresh: FastAPI, kind: str) -> None:
    query = "approximation=lyon&lambda=cross&gamma=8&alpha=50"
    requests = [
        Sent("POST", path, query if binary else "", (("content-type", kind), ("content-length", str(len(body)))), body)
        for path, body, binary in itertools.product(
            ("/v1/specular", "/v1/shade", "/v1/render", "/v1/recommend"), hostile.BODIES[kind], (True, False)
        )
    ]
    assert [told for told in answers(fresh, requests) if told[1]] == []


def test_no_hostile_word_breaks_a_parameter(fresh: FastAPI) -> None:
    names = {
        (path.format(run="latest", name="front", kind="svg", path=""), parameter["name"])
        for path, method, operation in Source(fresh.openapi(), 1).operations
        for parameter in operation.get("parameters", ())
        if method == "GET" and parameter["in"] == "query"
    }
    pairs = itertools.product(sorted(names), hostile.WORDS)
    requests = [
        Sent("GET", path, f"{name}={quote(word, safe='', errors='surrogatepass')}") for (path, name), word in pairs
    ]
    assert [told for told in answers(fresh, requests[::7]) if told[1]] == []


def test_random_requests_find_no_fault_and_memory_stays(fresh: FastAPI) -> None:
    found = fuzz(REQUESTS, 1, Settings().runs, app=fresh)
    assert found.faults == []
    assert sum(found.statuses.values()) == REQUESTS
    # a stream that is refused at the door would prove nothing
    assert found.statuses[200] > REQUESTS / 10


def test_equal_seeds_send_equal_requests(fresh: FastAPI) -> None:
    first, again, other = (list(itertools.islice(Source(fresh.openapi(), seed), 50)) for seed in (1, 1, 2))
    assert first == again != other


def test_the_fuzzer_sees_what_is_wrong() -> None:
    guarded = {"content-security-policy": "x"}
    assert faults(200, guarded | {"content-type": "application/json"}, b'{"a": 1}') == []
    assert faults(200, guarded | {"content-type": "application/json"}, b"NaN")
    assert faults(500, guarded, b"")
    assert faults(503, guarded, b"")
    assert not faults(503, guarded | {"retry-after": "1"}, b"")
    assert faults(404, guarded | {"content-type": "text/html"}, b"no")
    assert faults(422, guarded | {"content-type": "application/problem+json"}, f'"{hostile.MARK}"'.encode())
    assert faults(200, {}, b"")
