"""Answers for a device that is sent with the question are those that it gets once it was added, and nothing is kept."""

import json
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from phongbench import __version__
from phongbench.targets import measured

RUN = "20260101-000000-0123abcd"
Document = dict[str, Any]
BUDGET = {"alpha": "50", "max_error": "0.05"}


def row(formula: str, cost: float) -> Document:
    return {"formula": formula, "alpha": 50, "cost": cost, "low": 0.99 * cost, "high": 1.01 * cost}


@pytest.fixture
def document() -> Document:
    words = {"adapter": "<b>mine</b>", "tool": "WebGL 2", "tool_version": "1", "phongbench": __version__}
    head = {"schema": 1, "target": "page-mine", "cost_kind": "measured", "unit": "ns", "precision": "float32"}
    rows = [row("phong", 0.4), row("lyon:dot:8", 0.1), row("gaussian:dot", 0.2)]
    return {**head, **words, "dot": {"cost": 0.05, "low": 0.05, "high": 0.05}, "rows": rows}


def test_a_recommendation_is_that_for_the_same_device_once_added(
    client_of: Any, tmp_path: Path, document: Document
) -> None:
    client = client_of(runs=tmp_path)
    sent = client.post("/v1/recommend", params=BUDGET, json=document)
    assert sent.status_code == 200, sent.text
    assert list(tmp_path.iterdir()) == [], "something was kept"
    best = sent.json()["choices"][0]
    assert (best["approximation"], best["cost"], best["target"]) == ("lyon", 0.1, "page-mine")
    (tmp_path / "download.json").write_text(json.dumps(document))
    measured.add(tmp_path / "download.json", tmp_path)
    assert client.get("/v1/recommend", params={**BUDGET, "target": "page-mine"}).json() == sent.json()


def test_a_front_joins_a_runs_errors_with_the_times_that_are_sent(client: TestClient, document: Document) -> None:
    question = {"alpha": "50"}
    answer = client.post(f"/v1/runs/{RUN}/front", params=question, json=document)
    assert answer.status_code == 200, answer.text
    told = answer.json()
    assert (told["target"], told["unit"], told["cost_kind"]) == ("page-mine", "ns", "measured")
    here = client.get(f"/v1/runs/{RUN}/front", params=question).json()
    errors = {point["name"]: point["error"] for point in here["points"]}
    costs = {point["name"]: point["cost"] for point in told["points"]}
    assert {name: errors[name] for name in costs} == {point["name"]: point["error"] for point in told["points"]}
    assert costs["phong"] == 0.4
    assert set(costs.values()) <= {0.4, 0.1, 0.2}


@pytest.mark.parametrize(
    ("change", "field"),
    [
        (lambda d: d.update(schema=2), "schema"),
        (lambda d: d.update(phongbench="0.0.1-mine"), "phongbench"),
        (lambda d: d["rows"].append(row("lion", 1.0)), "rows[3].formula"),
        (lambda d: d["rows"][1].update(cost=-1), "rows[1].cost"),
        (lambda d: d.update(dot={"cost": 0.05, "low": 0.06, "high": 0.07}), "dot.cost"),
        (lambda d: d["rows"].pop(0), "rows"),
        (lambda d: d.update(mine=1), "(unknown)"),
    ],
    ids=["schema", "version", "formula", "negative", "interval", "no exact Phong", "unknown key"],
)
def test_what_cannot_be_is_refused_by_field_and_not_repeated(
    client: TestClient, document: Document, change: Any, field: str
) -> None:
    change(document)
    answer = client.post("/v1/recommend", params=BUDGET, json=document)
    assert answer.status_code == 422, answer.text
    assert field in answer.text
    assert "lion" not in answer.text
    assert "mine" not in answer.text


def test_what_is_no_measurement_is_refused(client: TestClient, document: Document) -> None:
    def status(**sent: Any) -> int:
        return client.post("/v1/recommend", params=BUDGET, **sent).status_code

    assert status(content=b"{", headers={"content-type": "application/json"}) == 400
    assert status(content=b"x", headers={"content-type": "text/plain"}) == 415
    assert status(json=document, headers={"accept": "image/png"}) == 406
    assert status(json=[1]) == 422
    assert status(json=document | {"adapter": "a" * (256 << 10)}) == 413
    assert client.post("/v1/runs/absent00/front", params={"alpha": "50"}, json=document).status_code == 404
