"""Targets over HTTP: the library's list, with those that were added among the served runs, and answers for them."""

import json
from pathlib import Path
from typing import Any

from starlette.testclient import TestClient

from phongbench import __version__
from phongbench.targets import measured
from phongbench.targets.listing import listing

QUESTION = {"alpha": "50", "max_error": "0.05"}


def test_it_is_the_librarys(client: TestClient, runs: Path) -> None:
    answer = client.get("/v1/targets")
    assert answer.status_code == 200
    assert answer.json() == {"targets": listing(runs)}


def test_one_that_was_added_answers_at_once_and_again_after_it_changed(client_of: Any, tmp_path: Path) -> None:
    client = client_of(runs=tmp_path)
    absent = client.get("/v1/recommend", params={**QUESTION, "target": "page-mine"})
    assert absent.status_code == 422
    assert "page-mine" not in absent.text
    for cost in (0.1, 0.9):
        rows = [("phong", 0.4), ("lyon:dot:8", cost), ("gaussian:dot", 0.2)]
        document = {
            "schema": 1, "target": "page-mine", "cost_kind": "measured", "unit": "ns", "precision": "float32",
            "adapter": "<b>mine</b>", "tool": "WebGPU", "tool_version": "1", "phongbench": __version__,
            "dot": {"cost": 0.05, "low": 0.05, "high": 0.05},
            "rows": [{"formula": f, "alpha": 50, "cost": c, "low": c, "high": 1.01 * c} for f, c in rows],
        }  # fmt: skip
        (tmp_path / "download.json").write_text(json.dumps(document))
        measured.add(tmp_path / "download.json", tmp_path)
        assert client.get("/v1/targets").json()["targets"][-1]["name"] == "page-mine"
        best = client.get("/v1/recommend", params={**QUESTION, "target": "page-mine"}).json()["choices"][0]
        assert best["approximation"] == ("lyon" if cost < 0.2 else "gaussian")
        assert best["cost"] == min(cost, 0.2)


def test_a_name_that_is_none_is_refused(client: TestClient) -> None:
    for name in ("geforce", "../x", "", "RDNA2", "page-" + "a" * 80):
        answer = client.get("/v1/recommend", params={**QUESTION, "target": name})
        assert answer.status_code == 422, name
        assert answer.headers["content-type"] == "application/problem+json"
