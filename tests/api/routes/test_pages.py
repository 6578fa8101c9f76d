"""The pages: no outside host, nothing inline, and documentation that says what the service does."""

import re
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import ALPHA
from phongbench.inputs.optical_constants import EXACT
from phongbench_api.http import problems
from phongbench_api.routes import guide, pages


def operations(client: TestClient) -> dict[tuple[str, str], dict[str, Any]]:
    document = client.get("/openapi.json").json()
    return {(path, method): found for path, members in document["paths"].items() for method, found in members.items()}


def parameter(found: dict[str, Any], name: str) -> dict[str, Any]:
    [schema] = [p["schema"] for p in found["parameters"] if p["name"] == name]
    [told] = [s for s in schema.get("anyOf", [schema]) if s.get("type") != "null"]
    return dict(told)


def outside(text: str) -> list[str]:
    """Addresses that a browser would fetch from somewhere else."""
    fetched = re.findall(r"""(?:src|href|action|url\()\s*=?\s*["'(]?((?:https?:)?//[^"')\s>]+)""", text)
    return [address for address in fetched if "www.w3.org" not in address]


@pytest.mark.parametrize(
    "path", ["/", "/docs", "/runs/latest/rows", "/guide/", *(f"/guide/{name}" for name in guide.texts())]
)
def test_a_page_fetches_nothing_from_outside_and_has_nothing_inline(client: TestClient, path: str) -> None:
    page = client.get(path)
    assert page.headers["content-type"] == "text/html; charset=utf-8"
    assert outside(page.text) == []
    assert not re.search(r"<script(?![^>]*\bsrc=)|<style|\son\w+=|\sstyle=", page.text)
    for link in re.findall(r'(?:src|href)="(/[^"#]*)"', page.text):
        assert client.get(link).status_code == 200, link


def test_the_guide_leads_to_every_page_and_every_heading_that_it_links_to(client: TestClient) -> None:
    listed = re.findall(r'<li><a href="([^"]+)">', client.get("/guide/").text)
    assert listed == list(guide.texts())
    for name in listed:
        text = client.get(f"/guide/{name}").text
        assert "generated:" not in text
        for page, _, anchor in (link.partition("#") for link in re.findall(r'href="(?!/|https?:|data:)([^"]+)"', text)):
            led = client.get(f"/guide/{page or name}")
            assert led.status_code == 200, (name, page)
            assert not anchor or f'id="{anchor}"' in led.text, (name, anchor)


@pytest.mark.parametrize("name", ["nothing.md", "..%2fREADME.md", "method", "%00"])
def test_no_other_page_is_served(client: TestClient, name: str) -> None:
    assert client.get(f"/guide/{name}").status_code == 404


def test_every_file_of_the_page_is_served_with_its_type_and_tag(client: TestClient) -> None:
    assert pages.files()
    for name, (content, media) in pages.files().items():
        answer = client.get(f"/web/{name}")
        assert (answer.content, answer.headers["content-type"]) == (content, media)
        again = client.get(f"/web/{name}", headers={"if-none-match": f'"other", {answer.headers["etag"]}'})
        assert again.status_code == 304
        if media.startswith(("text/css", "text/javascript")):
            assert outside(content.decode()) == []


@pytest.mark.parametrize(
    "path", ["../app.py", "%2e%2e/app.py", "..%2fapp.py", "", "/etc/passwd", "%00", "docs.css%00.html"]
)
def test_no_other_file_is_served(client: TestClient, path: str) -> None:
    assert client.get(f"/web/{path}").status_code == 404


def test_the_documentation_lists_every_operation_and_problem(client: TestClient) -> None:
    page = client.get("/docs").text
    for found in operations(client).values():
        assert f'id="{found["operationId"]}"' in page
    for _, kind in problems.STATUS:
        assert f'id="{kind.slug}"' in page


def test_every_operation_documents_its_problems_as_problem_documents(client: TestClient) -> None:
    for (path, method), found in operations(client).items():
        assert found["summary"], path
        for status, response in found["responses"].items():
            if int(status) >= 400:
                assert list(response["content"]) == [problems.MEDIA], (path, method, status)


def test_names_and_bounds_come_from_the_registry(client: TestClient) -> None:
    found = operations(client)[("/v1/curve", "get")]
    assert parameter(found, "approximation")["enum"] == list(REGISTRY)
    lowest = 0  # cardboard, where a formula takes it
    assert (parameter(found, "alpha")["minimum"], parameter(found, "alpha")["maximum"]) == (lowest, ALPHA.high)
    assert parameter(found, "gamma")["enum"] == [1 << n for n in range(9)]
    body = operations(client)[("/v1/specular", "post")]["requestBody"]["content"]["application/json"]["schema"]
    assert body["properties"]["approximation"]["anyOf"][0]["enum"] == list(REGISTRY)
    assert {"a", "b", "alpha"} <= set(body["required"])
    assert body["anyOf"] == [{"required": ["approximation"]}, {"required": ["formula"]}]


def test_the_catalogue_is_the_registry(client: TestClient) -> None:
    told = client.get("/v1/approximations").json()["approximations"]
    assert [entry["name"] for entry in told] == list(REGISTRY)
    wanted = {"name", "title", "kind", "formula", "parameters", "lambda_forms", "source", "cost", "support"}
    for entry in told:
        assert wanted <= entry.keys()
        assert client.get(f"/v1/approximations/{entry['name']}").json() == entry
        assert (entry["support"] is None) == (REGISTRY[entry["name"]].cutoff is None)


def test_meta_tells_versions_and_limits(client: TestClient) -> None:
    told = client.get("/v1/meta").json()
    assert told["limits"]["max_rows"] == 50_000
    assert told["versions"]["numpy"]


def test_the_reflectances_that_the_page_reads_are_those_of_the_library(client: TestClient) -> None:
    told = client.get("/v1/meta").json()["reflectances"]
    assert set(told) == set(EXACT)
    cosines = np.linspace(0, 1, 129)
    for name, table in told.items():
        np.testing.assert_allclose(table, EXACT[name].at(cosines), atol=1e-12)
    assert told["glass"][0] == [1.0, 1.0, 1.0]
    assert told["glass"][-1] == pytest.approx([0.04] * 3)
