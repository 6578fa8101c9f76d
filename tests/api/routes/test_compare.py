"""Times of one run against those of another, over HTTP."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

RUN, CORRUPT = "20260101-000000-0123abcd", "20251231-000000-0123abcd"


@pytest.fixture
def of_one_machine(client_of: Callable[..., TestClient], copied: Callable[[], Path]) -> TestClient:
    """A client of runs whose good one says which machine timed it."""
    root = copied()
    manifest = root / RUN / "manifest.json"
    told = json.loads(manifest.read_text())
    manifest.write_text(json.dumps(told | {"provenance": {"machine_fingerprint": "0123456789abcdef"}}))
    return client_of(runs=root)


def test_a_run_differs_from_itself_by_nothing(of_one_machine: TestClient) -> None:
    told = of_one_machine.get(f"/v1/runs/latest/compare?against={RUN}").json()
    assert (told["run"], told["against"], told["why_not"]) == (RUN, RUN, None)
    assert told["rows"]
    for row in told["rows"]:
        assert row["ratio_low"] < 1 < row["ratio_high"]
        assert (row["ratio"], row["verdict"]) == (1, "unresolved")


def test_times_of_unknown_machines_are_not_compared(client: TestClient) -> None:
    told: dict[str, Any] = client.get("/v1/runs/latest/compare?against=latest").json()
    assert told["rows"] == []
    assert "machine" in told["why_not"]


@pytest.mark.parametrize(
    ("run", "query", "status"),
    [
        ("latest", "", 422),
        ("latest", "against=..", 422),
        ("latest", "against=latest&metric=rms", 422),
        ("latest", "against=20200101-000000-0123abcd", 404),
        ("20200101-000000-0123abcd", "against=latest", 404),
        ("latest", f"against={CORRUPT}", 409),
        (CORRUPT, "against=latest", 409),
    ],
)
def test_what_cannot_be_compared_is_refused(client: TestClient, run: str, query: str, status: int) -> None:
    assert client.get(f"/v1/runs/{run}/compare?{query}").status_code == status
