"""Every error is a problem document; none repeats what was sent, and none is a 5xx."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from phongbench import errors as library
from phongbench_api.http import problems

MARK = "zzMARKzz<script>"
CURVE = "/v1/curve?approximation=lyon&gamma=8&alpha=50"
SPECULAR = {"approximation": "lyon", "gamma": 8, "alpha": 50, "a": [[0, 0, 1]], "b": [[0, 0, 1]]}


def send(client: TestClient, method: str, path: str, **more: Any) -> Any:
    answer = client.request(method, path, **more)
    assert 400 <= answer.status_code < 500, (path, answer.status_code)
    assert answer.headers["content-type"] == problems.MEDIA
    told = json.loads(answer.content, parse_constant=pytest.fail)
    assert told["status"] == answer.status_code
    assert {"type", "title", "status", "detail"} <= told.keys()
    return answer


# The bug that FastAPI's own handler has: NaN passes json.loads, fails the model, and cannot be echoed: a remote 500.
@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999", "-1e999"])
@pytest.mark.parametrize("field", ["alpha", "gamma", "a"])
def test_a_number_that_is_none_is_refused_and_not_echoed(client: TestClient, number: str, field: str) -> None:
    body = json.dumps(SPECULAR | {field: "@"}).replace('"@"', f"[[0, 0, {number}]]" if field == "a" else number)
    answer = send(client, "POST", "/v1/specular", content=body, headers={"content-type": "application/json"})
    assert answer.status_code in (400, 422)


@pytest.mark.parametrize("alpha", ["nan", "inf", "-inf", "1e999"])
def test_a_query_number_that_is_none_is_refused(client: TestClient, alpha: str) -> None:
    assert send(client, "GET", f"/v1/curve?approximation=phong&alpha={alpha}").status_code == 422


@pytest.mark.parametrize(
    ("method", "path", "more"),
    [
        ("GET", f"/v1/curve?approximation={MARK}&alpha=50", {}),
        ("GET", f"/v1/curve?approximation=phong&alpha={MARK}", {}),
        ("GET", f"/v1/curve?approximation=phong&alpha=50&{MARK}=1", {}),
        ("GET", f"/v1/curve?approximation=lyon&alpha=50&gamma=8&beta={MARK}", {}),
        ("GET", f"/v1/approximations/{MARK}", {}),
        ("GET", f"/v1/runs/{MARK}", {}),
        ("GET", f"/v1/runs?cursor={MARK}", {}),
        ("GET", f"/v1/runs/latest/accuracy?alpha={MARK}", {}),
        ("GET", f"/v1/runs/latest/accuracy?{MARK}=1", {}),
        ("GET", f"/v1/runs/latest/accuracy?columns={MARK}", {}),
        ("GET", f"/v1/runs/latest/accuracy?sort={MARK}", {}),
        ("GET", f"/v1/runs/latest/accuracy?cursor={MARK}", {}),
        ("GET", f"/v1/runs/latest/front?alpha={MARK}", {}),
        ("GET", f"/v1/runs/latest/front?alpha=50&metric={MARK}", {}),
        ("GET", f"/v1/recommend?alpha=50&max_error={MARK}", {}),
        ("GET", f"/v1/recommend?alpha=50&max_error=1/255&run={MARK}", {}),
        ("GET", f"/v1/runs/latest/figures/{MARK}.svg", {}),
        ("GET", f"/runs/latest/report/{MARK}", {}),
        ("GET", f"/web/{MARK}", {}),
        ("POST", "/v1/specular", {"json": SPECULAR | {"approximation": MARK}}),
        ("POST", "/v1/specular", {"json": SPECULAR | {MARK: 1}}),
        ("POST", "/v1/specular", {"json": SPECULAR | {"a": MARK}}),
        ("POST", "/v1/specular", {"json": MARK}),
        ("POST", "/v1/specular", {"content": MARK, "headers": {"content-type": "application/json"}}),
        ("POST", "/v1/specular", {"content": b"", "headers": {"content-type": f"text/{MARK}"}}),
        ("GET", CURVE, {"headers": {"accept": f"image/{MARK}"}}),
    ],
)
def test_nothing_that_was_sent_comes_back(client: TestClient, method: str, path: str, more: dict[str, Any]) -> None:
    assert MARK[:10] not in send(client, method, path, **more).text


@pytest.mark.parametrize("path", ["/healthz", "/v1/meta", CURVE, "/v1/runs", "/"])
@pytest.mark.parametrize("method", ["DELETE", "PUT", "PATCH"])
def test_a_method_that_is_not_there_is_405_with_those_that_are(client: TestClient, method: str, path: str) -> None:
    assert send(client, method, path).headers["allow"] == "GET"


def test_what_answers_get_answers_head_with_the_same_head(client: TestClient) -> None:
    for path in ("/healthz", "/", CURVE, "/v1/runs"):
        got, head = client.get(path), client.head(path)
        assert (head.status_code, head.content) == (200, b"")
        assert head.headers["content-length"] == got.headers["content-length"]


def test_accept_that_cannot_be_met_is_406(client: TestClient) -> None:
    assert send(client, "GET", CURVE, headers={"accept": "image/png"}).status_code == 406


def test_every_deliberate_error_has_a_status_and_only_a_failure_of_ours_is_a_5xx() -> None:
    kinds = [
        kind for kind in vars(library).values() if isinstance(kind, type) and issubclass(kind, library.PhongbenchError)
    ]
    for kind in kinds:
        found = next(k for error, k in problems.STATUS if issubclass(kind, error))
        assert found.status < 500 or not issubclass(kind, library.InputError | library.CorruptRunError)


def test_a_fault_of_the_service_is_a_500_without_details(client_of: Callable[..., TestClient]) -> None:
    client = client_of()
    client = TestClient(client.app, base_url="http://localhost", raise_server_exceptions=False)

    def broken(*_: object) -> None:
        raise ZeroDivisionError(MARK)

    client.app.state.service.kernels = None  # type: ignore[attr-defined]
    answer = client.get(CURVE)
    assert (answer.status_code, answer.headers["content-type"]) == (500, problems.MEDIA)
    assert "NoneType" not in answer.text


def test_no_problem_tells_where_the_server_keeps_its_files(client: TestClient, runs: Path) -> None:
    for path in (
        "/v1/runs/20990101-000000-00000000",
        "/v1/runs/20251231-000000-0123abcd/accuracy",
        "/runs/latest/report/x",
    ):
        assert str(runs) not in send(client, "GET", path).text
