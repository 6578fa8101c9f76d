"""GET /v1/targets: the library's list."""

from starlette.testclient import TestClient

from phongbench.targets.listing import listing


def test_it_is_the_librarys(client: TestClient) -> None:
    answer = client.get("/v1/targets")
    assert answer.status_code == 200
    assert answer.json() == {"targets": listing()}
