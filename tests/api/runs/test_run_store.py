"""Stored runs over HTTP: looked up, never joined to a path, checked against their manifests, told as they are."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
from starlette.testclient import TestClient

from phongbench.analysis import claims
from phongbench.analysis.front import points
from phongbench.analysis.recommend import recommend
from phongbench.results import runs as results

RUN, CORRUPT = "20260101-000000-0123abcd", "20251231-000000-0123abcd"


def test_the_list_is_newest_first_and_pages(client: TestClient) -> None:
    found = client.get("/v1/runs").json()
    assert ([run["id"] for run in found["runs"]], found["total"], found["next"]) == ([RUN, CORRUPT], 2, None)
    first = client.get("/v1/runs?limit=1").json()
    second = client.get("/v1/runs", params={"limit": 1, "cursor": first["next"]}).json()
    assert ([run["id"] for run in first["runs"] + second["runs"]], second["next"]) == ([RUN, CORRUPT], None)


def test_a_run_is_told_by_its_manifest(client: TestClient, runs: Path) -> None:
    found = client.get(f"/v1/runs/{RUN}").json()
    assert found | dict(results.load(runs / RUN).manifest) == found
    assert found["report"] is True


@pytest.mark.parametrize(
    "name",
    [
        "..",
        "%2e%2e",
        "..%2f..%2fetc",
        "%2fetc%2fpasswd",
        "%00",
        "20260101-000000-0123abcd%00",
        ".hidden-file",
        "A" * 20,
        "a" * 65,
        "20260101-000000-0123abcd%2f..",
        "20990101-000000-00000000",
        "%252e%252e",
        "link-to-a-run",
        "..%5c..",
        "~root-home",
    ],
)
@pytest.mark.parametrize("rest", ["", "/accuracy", "/front?alpha=50", "/claims", "/figures/front.svg"])
def test_a_name_that_no_run_has_is_404_whatever_it_looks_like(
    client: TestClient, runs: Path, name: str, rest: str
) -> None:
    link = runs / "link-to-a-run"
    if not link.is_symlink():
        link.symlink_to(runs / RUN)
    answer = client.get(f"/v1/runs/{name}{rest}")
    assert answer.status_code == 404
    assert "root:" not in answer.text
    link.unlink()


@pytest.mark.parametrize("rest", ["accuracy", "front?alpha=50", "timing", "figures/front.png"])
def test_a_flipped_byte_makes_that_run_a_problem_and_no_other(
    client: TestClient, copied: Callable[[], Path], client_of: Callable[..., TestClient], rest: str
) -> None:
    root = copied()
    spoiled = client_of(runs=root)
    shutil.copytree(root / RUN / "report", root / CORRUPT / "report", dirs_exist_ok=True)
    answer = spoiled.get(f"/v1/runs/{CORRUPT}/{rest}")
    assert answer.status_code == 409
    assert answer.json()["type"].endswith("corrupt-result")
    assert spoiled.get(f"/v1/runs/{RUN}/{rest}").status_code == 200


def test_a_corrupt_run_is_not_asked_for_a_recommendation_unless_it_is_named(
    copied: Callable[[], Path], client_of: Callable[..., TestClient]
) -> None:
    root = copied()
    shutil.copytree(root / CORRUPT, root / "20260909-000000-0123abcd")
    client = client_of(runs=root)
    budget = {"alpha": "50", "max_error": "1/20"}
    assert client.get("/v1/recommend", params=budget).json()["run"] == RUN
    assert client.get("/v1/recommend", params=budget | {"run": CORRUPT}).status_code == 409
    shutil.rmtree(root / RUN)
    assert client.get("/v1/recommend", params=budget).json()["basis"] == "laws"


def test_a_byte_that_flips_while_the_server_runs_is_noticed(
    copied: Callable[[], Path], client_of: Callable[..., TestClient]
) -> None:
    root = copied()
    client, file = client_of(runs=root), root / RUN / "timing.parquet"
    assert client.get(f"/v1/runs/{RUN}/timing").status_code == 200
    data = bytearray(file.read_bytes())
    data[len(data) // 3] ^= 4
    file.write_bytes(data)
    assert client.get(f"/v1/runs/{RUN}/timing").status_code == 409


@pytest.mark.parametrize("text", ["", "{", "[]", "null", '{"schema": 1}', '"x"', '{"schema": 99}', "\xff"])
def test_a_broken_manifest_is_listed_as_corrupt_and_spoils_no_list(
    copied: Callable[[], Path], client_of: Callable[..., TestClient], text: str
) -> None:
    root = copied()
    (root / RUN / "manifest.json").write_bytes(text.encode("latin-1"))
    client = client_of(runs=root)
    listed = {run["id"]: run["state"] for run in client.get("/v1/runs").json()["runs"]}
    assert listed == {CORRUPT: "complete", RUN: "corrupt"}
    assert client.get(f"/v1/runs/{RUN}").status_code == 409


@pytest.mark.parametrize(
    "change",
    [
        {"files": 3},
        {"files": {"accuracy.parquet": None}},
        {"plan": 7},
        {"run": None},
        {"state": []},
        {"files": {"../x.parquet": {"sha256": "0", "rows": 1, "bytes": 1}}},
        {"provenance": None},
    ],
)
def test_a_manifest_of_wrong_values_never_fails_the_service(
    copied: Callable[[], Path], client_of: Callable[..., TestClient], change: dict[str, object]
) -> None:
    root = copied()
    folder = root / RUN
    results.write_manifest(folder, dict(results.load(folder).manifest) | change)
    client = client_of(runs=root)
    for rest in ("", "/accuracy", "/timing", "/front?alpha=50", "/figures/front.png", "/figures/front.svg"):
        assert client.get(f"/v1/runs/{RUN}{rest}").status_code < 500
    assert client.get("/v1/recommend?alpha=50&max_error=0.1").status_code < 500
    assert client.get("/v1/runs").status_code == 200


@pytest.mark.parametrize("stored", [(), ("accuracy.parquet", "worst.parquet")])
def test_an_interrupted_run_gives_what_it_has_and_promises_nothing(
    copied: Callable[[], Path], client_of: Callable[..., TestClient], stored: tuple[str, ...]
) -> None:
    root = copied()
    manifest = dict(results.load(root / RUN).manifest)
    files = {name: facts for name, facts in manifest["files"].items() if name in stored}
    results.write_manifest(root / RUN, manifest | {"state": "partial", "files": files})
    client = client_of(runs=root)
    assert client.get(f"/v1/runs/{RUN}").json()["state"] == "partial"
    assert client.get(f"/v1/runs/{RUN}/accuracy?limit=1").status_code == (200 if stored else 404)
    assert client.get(f"/v1/runs/{RUN}/timing").status_code == 404
    for question in (f"runs/{RUN}/front?alpha=50", f"runs/{RUN}/claims", f"recommend?alpha=50&max_error=1&run={RUN}"):
        answer = client.get(f"/v1/{question}")
        assert answer.status_code == 422
        assert "the run" in answer.json()["detail"]


def test_without_runs_there_is_an_empty_list_and_the_laws_answer(
    tmp_path: Path, client_of: Callable[..., TestClient]
) -> None:
    client = client_of(runs=tmp_path / "none")
    assert client.get("/v1/runs").json() == {"runs": [], "total": 0, "next": None}
    assert client.get("/v1/runs/latest").status_code == 404
    assert client.get("/v1/recommend?alpha=50&max_error=1/255").json()["basis"] == "laws"


def test_the_front_is_the_librarys(client: TestClient, runs: Path) -> None:
    told = client.get(f"/v1/runs/{RUN}/front?alpha=50").json()
    assert told == points(results.load(runs / RUN), alpha=50)
    assert {point["state"] for point in told["points"]} <= {"on", "off", "unresolved"}
    assert client.get(f"/v1/runs/{RUN}/front?alpha=10..50").json()["alphas"] == [10, 50]


def test_the_recommendation_is_the_librarys(client: TestClient, runs: Path) -> None:
    asked = {"alpha": "50", "max_error": "1/20", "run": RUN}
    told = client.get("/v1/recommend", params=asked).json()
    assert told == recommend(results.load(runs / RUN), alpha="50", max_error="1/20")


@pytest.mark.parametrize(
    ("query", "status"),
    [
        ("alpha=51", 422),
        ("alpha=0", 422),
        ("alpha=10..", 422),
        ("alpha=50&precision=float64", 422),
        ("", 422),
        ("alpha=50&working_set=memory", 422),
    ],
)
def test_what_a_run_did_not_measure_is_422(client: TestClient, query: str, status: int) -> None:
    assert client.get(f"/v1/runs/{RUN}/front?{query}").status_code == status


def test_a_figure_is_that_of_the_report(client: TestClient, runs: Path) -> None:
    answer = client.get(f"/v1/runs/{RUN}/figures/front.svg")
    assert answer.content == (runs / RUN / "report" / "figures" / "front.svg").read_bytes()
    assert answer.headers["content-type"] == "image/svg+xml"
    drawn = client.get(f"/v1/runs/{RUN}/figures/front.png")
    assert drawn.content.startswith(b"\x89PNG")
    assert client.get(f"/v1/runs/{RUN}/figures/front.gif").status_code == 422
    assert client.get(f"/v1/runs/{RUN}/figures/nothing.png").status_code == 404


def test_the_report_works_from_the_service(client: TestClient, runs: Path) -> None:
    import re

    page = client.get(f"/runs/{RUN}/report/")
    assert page.content == (runs / RUN / "report" / "index.html").read_bytes()
    assert "script" not in page.headers["content-security-policy"]
    linked = set(re.findall(r'(?:src|href|srcset)="([^"#:]+)"', page.text))
    assert linked
    for link in linked:
        assert client.get(f"/runs/{RUN}/report/{link}").status_code == 200, link


@pytest.mark.parametrize(
    "path",
    [
        "../manifest.json",
        "..%2fmanifest.json",
        "%2e%2e/accuracy.parquet",
        "figures",
        "data/",
        "/etc/passwd",
        "secret.txt",
        "out.svg",
    ],
)
def test_only_the_reports_own_files_are_told(client: TestClient, runs: Path, path: str) -> None:
    report = runs / RUN / "report"
    (report / "secret.txt").write_text("secret")
    (report / "out.svg").unlink(missing_ok=True)
    (report / "out.svg").symlink_to(runs / RUN / "manifest.json")
    answer = client.get(f"/runs/{RUN}/report/{path}")
    assert answer.status_code == 404
    (report / "out.svg").unlink()
    (report / "secret.txt").unlink()


def test_a_file_that_is_there_already_is_not_sent_again(client: TestClient) -> None:
    first = client.get(f"/runs/{RUN}/report/style.css")
    again = client.get(f"/runs/{RUN}/report/style.css", headers={"if-none-match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_a_run_named_with_markup_is_inert(copied: Callable[[], Path], client_of: Callable[..., TestClient]) -> None:
    root = copied()
    evil = "<script>alert(1)</script>"
    results.write_manifest(root / RUN, dict(results.load(root / RUN).manifest) | {"run": evil})
    client = client_of(runs=root)
    for path in (f"/v1/runs/{RUN}", "/v1/runs", f"/v1/runs/{RUN}/front?alpha=50"):
        answer = client.get(path)
        assert answer.headers["content-type"] == "application/json"
        assert answer.headers["x-content-type-options"] == "nosniff"
    assert client.get(f"/v1/runs/{RUN}/figures/front.svg").headers["content-security-policy"].endswith("sandbox")


def test_the_claims_are_the_librarys(client: TestClient, runs: Path) -> None:
    told = client.get(f"/v1/runs/{RUN}/claims").json()
    assert told == json.loads(json.dumps(claims.answer(results.load(runs / RUN))))
    assert told["claims"]


def test_the_row_count_of_the_manifest_is_that_of_the_table(client: TestClient, accuracy: pd.DataFrame) -> None:
    assert client.get(f"/v1/runs/{RUN}").json()["files"]["accuracy.parquet"]["rows"] == len(accuracy)


def test_what_a_recommendation_promises_is_within_its_budget(client: TestClient) -> None:
    told = client.get("/v1/recommend", params={"alpha": "50", "max_error": "1/20", "run": RUN}).json()
    assert [choice["coverage"] for choice in told["choices"]] == ["certified"] * len(told["choices"])
    assert all(choice["max_abs"] <= choice["bound"] <= 0.05 for choice in told["choices"])


def test_a_recommendation_by_contract_holds_on_every_device(client: TestClient) -> None:
    asked = {"alpha": "50", "max_error": "1/20", "run": RUN, "contract": "true"}
    told = client.get("/v1/recommend", params=asked).json()
    assert told["contract"] is True
    assert {choice["coverage"] for choice in told["choices"]} == {"contract"}
    refused = client.get("/v1/recommend", params=asked | {"precision": "float64"})
    assert refused.status_code == 422
    assert "no accuracies of float64" in refused.json()["detail"]


def test_a_question_with_more_proofs_than_a_request_may_take_is_refused(client: TestClient) -> None:
    """Each exponent is proven by itself; what that takes is known before."""
    refused = client.get("/v1/recommend", params={"alpha": "0.001..100000", "max_error": "1/20"})
    assert refused.status_code == 413
    assert "a request may take" in refused.json()["detail"]
