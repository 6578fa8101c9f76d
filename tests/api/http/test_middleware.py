"""What happens to every request: host, encoding, body limits, deadlines, headers."""

import asyncio
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from starlette.testclient import TestClient

from phongbench_api.app import create_app
from phongbench_api.http import media, middleware
from phongbench_api.settings import Settings

QUERY = "/v1/specular?approximation=lyon&gamma=8&alpha=50&lambda=cross"
OCTETS = {"content-type": media.OCTETS}


@pytest.mark.parametrize("host", ["localhost", "localhost:8000", "LOCALHOST", "127.0.0.1:1", "[::1]", "[::1]:80"])
def test_loopback_is_answered_under_its_own_names(client: TestClient, host: str) -> None:
    assert client.get("/healthz", headers={"host": host}).status_code == 200


@pytest.mark.parametrize(
    "host", ["evil.example", "localhost.evil.example", "127.0.0.1.nip.io", "", "[::2]", "0", "10.0.0.1"]
)
def test_a_foreign_host_is_refused_on_loopback(client: TestClient, host: str) -> None:
    # DNS rebinding: a page of evil.example lets its own name resolve to 127.0.0.1 and reads what is served there
    answer = client.get("/v1/runs", headers={"host": host})
    assert answer.status_code == 421
    assert "runs" not in answer.json()


def test_a_name_may_be_allowed_and_elsewhere_any_is(client_of: Callable[..., TestClient]) -> None:
    named = client_of(allowed_hosts=("phong.example",))
    assert named.get("/healthz", headers={"host": "phong.example:80"}).status_code == 200
    assert named.get("/healthz", headers={"host": "evil.example"}).status_code == 421
    anywhere = client_of(host="0.0.0.0")
    assert anywhere.get("/healthz", headers={"host": "evil.example"}).status_code == 200
    strict = client_of(host="0.0.0.0", allowed_hosts=("phong.example",))
    assert strict.get("/healthz", headers={"host": "evil.example"}).status_code == 421


def test_no_other_origin_may_read_an_answer(client: TestClient) -> None:
    for method, more in (("GET", {}), ("OPTIONS", {"access-control-request-method": "POST"})):
        answer = client.request(method, "/v1/runs", headers={"origin": "https://evil.example"} | more)
        assert not [name for name in answer.headers if name.startswith("access-control-")]


@pytest.mark.parametrize("path", ["/", "/docs", "/healthz", "/v1/runs", "/nowhere", "/v1/curve", "/web/docs.css"])
def test_every_answer_has_the_security_headers(client: TestClient, path: str) -> None:
    headers = client.get(path).headers
    assert {name: headers[name] for name in middleware.HEADERS} == middleware.HEADERS
    assert "unsafe" not in headers["content-security-policy"]


@pytest.mark.parametrize("encoding", ["gzip", "br", "deflate", "gzip, identity", "x"])
def test_compressed_bodies_are_refused_so_that_no_bomb_can_be(client: TestClient, encoding: str) -> None:
    answer = client.post(QUERY, content=b"\x1f\x8b", headers=OCTETS | {"content-encoding": encoding})
    assert answer.status_code == 415


LIMIT = 24 * 100


@pytest.mark.parametrize("declared", [True, False], ids=["declared", "chunked"])
@pytest.mark.parametrize(
    ("size", "status"), [(LIMIT - 24, 200), (LIMIT - 1, 400), (LIMIT, 200), (LIMIT + 1, 413), (10 * LIMIT, 413)]
)
def test_the_limit_of_a_body_is_exact(
    client_of: Callable[..., TestClient], declared: bool, size: int, status: int
) -> None:
    def pieces() -> Iterator[bytes]:
        for start in range(0, size, 777):
            yield bytes(min(777, size - start))

    client = client_of(max_body=LIMIT)
    answer = client.post(QUERY, content=bytes(size) if declared else pieces(), headers=OCTETS)
    assert answer.status_code == status, answer.text
    assert (answer.headers["content-type"] == "application/problem+json") == (status != 200)


@pytest.mark.parametrize(("excess", "status"), [(-1, 200), (0, 200), (1, 413)])
def test_json_has_a_limit_of_its_own(client_of: Callable[..., TestClient], excess: int, status: int) -> None:
    body = b'{"approximation": "phong", "alpha": 50, "a": [[0, 0, 1]], "b": [[0, 0, 1]]}'
    client = client_of(max_json=200)
    answer = client.post("/v1/specular", content=body.ljust(200 + excess), headers={"content-type": media.JSON})
    assert answer.status_code == status


def test_more_pairs_than_allowed_are_refused(client_of: Callable[..., TestClient]) -> None:
    client = client_of(max_points=10)
    assert client.post(QUERY, content=bytes(240), headers=OCTETS).status_code == 200
    assert client.post(QUERY, content=bytes(264), headers=OCTETS).status_code == 413


def _scope(**headers: str) -> dict[str, Any]:
    told = [
        (name.replace("_", "-").encode(), value.encode()) for name, value in ({"host": "localhost"} | headers).items()
    ]
    return {
        "type": "http",
        "method": "POST",
        "path": "/v1/specular",
        "raw_path": b"/v1/specular",
        "root_path": "",
        "scheme": "http",
        "http_version": "1.1",
        "server": ("localhost", 80),
        "client": ("localhost", 1),
        "query_string": QUERY.partition("?")[2].encode(),
        "headers": told,
        "asgi": {"version": "3.0"},
        "state": {},
    }


def _asked(settings: Settings, receive: Any, scope: dict[str, Any]) -> list[dict[str, Any]]:
    """What an application answers to a client whose every move `receive` makes."""
    sent: list[dict[str, Any]] = []

    async def send(message: Any) -> None:
        sent.append(message)

    async def run() -> None:
        app = create_app(settings)
        app.state.service.admission.open = True
        await app(scope, receive, send)

    asyncio.run(run())
    return sent


def test_a_body_that_trickles_is_cut_off_by_a_deadline() -> None:
    async def receive() -> Any:
        await asyncio.Event().wait()

    scope = _scope(content_type=media.OCTETS, content_length="24")
    sent = _asked(Settings(read_seconds=0.05), receive, scope)
    assert sent[0]["status"] == 408
    assert (b"connection", b"close") in sent[0]["headers"]


def test_what_is_left_of_a_refused_body_is_read_within_bounds() -> None:
    # A socket closed on unread bytes resets the connection: the client would not see why it was refused.
    taken = []

    async def receive() -> Any:
        taken.append(1)
        return {"type": "http.request", "body": bytes(1000), "more_body": len(taken) < 5}

    scope = _scope(content_type="text/plain", content_length="5000")
    sent = _asked(Settings(), receive, scope)
    assert sent[0]["status"] == 415
    assert len(taken) == 5
    assert [message.get("more_body", False) for message in sent[1:]] == [True, False]
    taken.clear()
    _asked(
        Settings(max_body=2000),
        receive,
        scope | {"headers": _scope(content_type="a/b", content_length="4000")["headers"]},
    )
    assert len(taken) == 2


def test_a_client_that_waits_for_leave_to_send_is_not_waited_for() -> None:
    async def receive() -> Any:
        raise AssertionError("asked for a body that was refused")

    scope = _scope(content_type="text/plain", content_length="5000", expect="100-continue")
    assert _asked(Settings(), receive, scope)[0]["status"] == 415


def test_a_client_that_does_not_take_its_answer_is_given_up() -> None:
    async def run() -> None:
        async def send(message: Any) -> None:
            await asyncio.Event().wait()

        async def receive() -> Any:
            return {"type": "http.request", "body": b"", "more_body": False}

        app = create_app(Settings(write_seconds=0.05))
        await app(_scope() | {"method": "GET", "path": "/healthz", "raw_path": b"/healthz"}, receive, send)

    asyncio.run(run())


@pytest.mark.parametrize("length", ["-1", "1e3", "0x10", "9" * 30, "٣"])
def test_a_content_length_that_is_none_is_malformed(length: str) -> None:
    async def receive() -> Any:
        return {"type": "http.request", "body": b"", "more_body": False}

    scope = _scope(content_type=media.OCTETS)
    scope["headers"].append((b"content-length", length.encode("latin-1", "replace")))
    assert _asked(Settings(), receive, scope)[0]["status"] == 400


@pytest.mark.parametrize("value", ["bytes=0-", "bytes=" + ",".join(f"{n}-" for n in range(1000)), "bytes=9-1", "x"])
def test_ranges_are_not_served_however_they_are_asked_for(client: TestClient, value: str) -> None:
    whole = client.get("/docs")
    answer = client.get("/docs", headers={"range": value})
    assert (answer.status_code, answer.content) == (200, whole.content)
    assert "accept-ranges" not in answer.headers
