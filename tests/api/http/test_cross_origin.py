"""`serve --cors`: pages of named origins may read answers, no others, and never with credentials."""

from collections.abc import Callable

import pytest
from click.testing import CliRunner
from starlette.testclient import TestClient

from phongbench.cli.main import main
from phongbench.errors import InputError
from phongbench_api.app import create_app
from phongbench_api.http import middleware, problems
from phongbench_api.http.cross_origin import origin
from phongbench_api.settings import Settings

NOTEBOOK, OTHER = "http://localhost:8888", "https://notes.example"
ASKS = {"access-control-request-method": "POST", "access-control-request-headers": "content-type"}


@pytest.fixture
def open_client(client_of: Callable[..., TestClient]) -> TestClient:
    return client_of(cors=(NOTEBOOK, "HTTPS://Notes.Example:443"))


def granted(headers: dict[str, str]) -> str | None:
    return headers.get("access-control-allow-origin")


@pytest.mark.parametrize(
    ("text", "sent"),
    [
        ("http://localhost:8888", "http://localhost:8888"),
        ("HTTPS://Notes.Example:443", "https://notes.example"),
        ("http://a.b-c.example:80", "http://a.b-c.example"),
        ("https://a:80", "https://a:80"),
        ("http://[::1]:8888", "http://[::1]:8888"),
        ("http://127.0.0.1", "http://127.0.0.1"),
    ],
)
def test_an_origin_is_kept_as_browsers_send_it(text: str, sent: str) -> None:
    assert origin(text) == sent == origin(sent)


@pytest.mark.parametrize(
    "text",
    [
        *("*", "null", "", " ", "localhost", "localhost:8888", "//localhost", "http:/a", "http://", "http://:80"),
        *("ftp://a", "ws://a", "javascript:alert(1)", "http://*.example", "http://a b", "http://a,b"),
        *("http://a/", "http://a/lab", "http://a?x", "http://a#x", "http://me@a", "http://a:", "http://a:0x1"),
        *("http://a:99999", "http://a:080", "http://ä.example", "http://a..b", "http://-a", "http://[::1", " http://a"),
        *("http://a\n", "http://a\r\nset-cookie: x", "http://a\x00", "http://a.", "http://" + "a" * 64, "http://[a]b"),
    ],
)
def test_what_is_no_origin_is_refused_with_what_to_give(text: str) -> None:
    with pytest.raises(InputError) as refused:
        origin(text)
    assert refused.value.where == "--cors"
    assert refused.value.fix
    with pytest.raises(InputError):
        create_app(Settings(cors=(NOTEBOOK, text)))


@pytest.mark.parametrize(("text", "told"), [("http://a/lab", "give http://a"), ("*", "any page"), ("a", "8888")])
def test_the_command_refuses_it_before_it_listens(text: str, told: str) -> None:
    found = CliRunner().invoke(main, ["serve", "--port", "0", "--cors", text])
    assert found.exit_code == 2
    assert told in " ".join(found.output.split())


@pytest.mark.parametrize("asking", [NOTEBOOK, OTHER])
def test_a_preflight_of_a_named_origin_is_answered(open_client: TestClient, asking: str) -> None:
    answer = open_client.options("/v1/specular", headers={"origin": asking} | ASKS)
    assert answer.status_code == 200
    assert granted(dict(answer.headers)) == asking
    assert "POST" in answer.headers["access-control-allow-methods"]
    assert "content-type" in answer.headers["access-control-allow-headers"].lower()
    assert "Origin" in answer.headers["vary"]
    assert middleware.HEADERS.items() <= dict(answer.headers).items()


@pytest.mark.parametrize(
    ("asking", "more"),
    [
        ("https://evil.example", {}),
        ("null", {}),
        ("http://localhost:8888.evil.example", {}),
        ("http://localhost", {}),
        (NOTEBOOK, {"access-control-request-method": "DELETE"}),
        (NOTEBOOK, {"access-control-request-headers": "authorization"}),
    ],
)
def test_any_other_preflight_is_refused_as_a_problem(
    open_client: TestClient, asking: str, more: dict[str, str]
) -> None:
    answer = open_client.options("/v1/specular", headers={"origin": asking} | ASKS | more)
    assert answer.status_code == 400
    assert answer.headers["content-type"] == problems.MEDIA
    assert granted(dict(answer.headers)) == (NOTEBOOK if asking == NOTEBOOK else None)
    assert asking not in answer.text


@pytest.mark.parametrize(
    ("method", "path", "headers", "status"),
    [
        ("GET", "/healthz", {}, 200),
        ("HEAD", "/healthz", {}, 200),
        ("GET", "/v1/runs/none-such", {}, 404),
        ("DELETE", "/healthz", {}, 405),
        ("GET", "/healthz", {"host": "evil.example"}, 421),
        ("GET", "/healthz", {"content-encoding": "gzip"}, 415),
        ("GET", "/v1/curve", {}, 422),
    ],
)
def test_answers_and_problems_may_be_read_by_named_origins_only(
    open_client: TestClient, client: TestClient, method: str, path: str, headers: dict[str, str], status: int
) -> None:
    for asking in (NOTEBOOK, OTHER, "https://evil.example"):
        answer = open_client.request(method, path, headers=headers | {"origin": asking})
        assert answer.status_code == status
        assert granted(dict(answer.headers)) == (None if "evil" in asking else asking)
        assert "Origin" in answer.headers["vary"]
        assert "access-control-allow-credentials" not in answer.headers
    assert "phongbench-next" in answer.headers["access-control-expose-headers"]
    plain = client.request(method, path, headers=headers | {"origin": NOTEBOOK})
    assert not [name for name in plain.headers if name.startswith("access-control-")]


def test_a_page_elsewhere_reads_rows_of_any_kind(open_client: TestClient) -> None:
    headers = {"origin": NOTEBOOK, "accept": "text/csv"}
    answer = open_client.get("/v1/runs/latest/timing?limit=1", headers=headers)
    assert answer.headers["phongbench-next"]
    assert granted(dict(answer.headers)) == NOTEBOOK
