"""POST /v1/inverse/line: the library's answer, and refusals that name their field."""

from typing import Any

import pytest
from starlette.testclient import TestClient

import phongbench as pb

PATH = "/v1/inverse/line"
REQUEST: dict[str, Any] = {"intensity": [0.45, 0.6, 0.05, 0.8], "ambient": 0.1, "diffuse": 0.7, "light": [0.2, 1.0]}


def test_it_is_the_librarys(client: TestClient) -> None:
    answer = client.post(PATH, json=REQUEST)
    assert answer.status_code == 200
    model = {"ambient": 0.1, "diffuse": 0.7, "light": (0.2, 1.0)}
    assert answer.json() == pb.inverse_line(REQUEST["intensity"], **model).as_dict()
    assert answer.json()["normals"][2] == [None, None]
    more = {"x": [0, 2, 3, 4], "prior": "concave", "noise": 0.01, "bridge": True, "unit_light": True, "start": "right"}
    expected = pb.inverse_line(REQUEST["intensity"], **model, **more).as_dict()
    assert client.post(PATH, json=REQUEST | more).json() == expected
    assert client.post(PATH, json=REQUEST | {"x": None}).json() == answer.json()


@pytest.mark.parametrize(
    ("wrong", "field"),
    [
        ({"intensity": [0.5, 2]}, "intensity[1]"),
        ({"intensity": [0.5, "0.5"]}, "intensity[1]"),
        ({"intensity": []}, "intensity"),
        ({"intensity": 0.5}, "intensity"),
        ({"x": [0, 1]}, "x"),
        ({"x": [0, 1, 1, 2]}, "x[2]"),
        ({"light": [0, -1]}, "light"),
        ({"light": [0, 0, 1]}, "light"),
        ({"diffuse": 0}, "diffuse"),
        ({"prior": "flat"}, "prior"),
        ({"noise": -1}, "noise"),
        ({"bridge": 1}, "bridge"),
        ({"more": 1}, "(unknown)"),
    ],
)
def test_wrong_requests_name_their_field(client: TestClient, wrong: dict[str, Any], field: str) -> None:
    answer = client.post(PATH, json=REQUEST | wrong)
    assert answer.status_code == 422, answer.text
    assert field in answer.text
    assert "flat" not in answer.text


def test_what_is_no_such_request_is_refused(client: TestClient) -> None:
    assert client.post(PATH, content=b"{", headers={"content-type": "application/json"}).status_code == 400
    assert client.post(PATH, json=[1]).status_code == 422
    assert client.post(PATH, content=b"x", headers={"content-type": "text/csv"}).status_code == 415
    assert client.post(PATH, json=REQUEST, headers={"accept": "image/png"}).status_code == 406
    assert client.post(PATH, json=REQUEST | {"intensity": [0.5] * 100_001}).status_code == 413
