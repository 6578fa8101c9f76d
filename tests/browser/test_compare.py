"""Which run answers, and the front of one run beside another's."""

from collections.abc import Callable
from typing import Any

import pytest

Visits = Callable[..., Any]
#: the runs of the fixture: one, an older one whose kernels were slower by a quarter, and one of another machine
RUN, SLOWER, ELSEWHERE = (f"{date}-000000-0123abcd" for date in ("20260101", "20251231", "20251230"))
PANEL = "[data-panel=compare]"


@pytest.fixture
def opened(visit: Visits, server: str) -> Callable[..., Any]:
    """A factory of visits of the page with the panel open, by the address's hash and the other run."""

    def make(state: str, other: str) -> Any:
        seen = visit(f"{server}/{state}")
        seen.page.locator(f"{PANEL} summary").click()
        seen.page.locator(f"{PANEL} th").first.wait_for()
        seen.page.select_option(f"{PANEL} select", other)
        seen.idle()
        return seen

    return make


def cells(seen: Any, number: int) -> list[str]:
    return list(seen.page.locator(f"{PANEL} td:nth-child({number})").all_inner_texts())


def test_a_run_is_picked_and_answers(visit: Visits, server: str) -> None:
    page = (seen := visit(server + "/")).page
    assert page.locator("#run option").count() == 3
    before = page.locator("#choice").inner_text()
    page.select_option("#run", SLOWER)
    seen.idle()
    assert f"run={SLOWER}" in page.url
    assert SLOWER in page.locator("#front-basis").inner_text()
    assert page.locator("#rows-link").get_attribute("href") == f"/runs/{SLOWER}/rows"
    assert SLOWER in page.locator("#choice").inner_text() != before
    assert page.locator("#commands code").last.inner_text().endswith(f"--run {SLOWER}")
    again = visit(page.url).page
    assert again.locator("#run").input_value() == SLOWER
    page.select_option("#run", "")
    seen.idle()
    assert "run=" not in page.url
    assert RUN in page.locator("#front-basis").inner_text()


def test_a_run_that_is_gone_leaves_the_newest(visit: Visits, server: str) -> None:
    page = visit(server + "/#run=20200101-000000-0123abcd&budget=0.05").page
    assert RUN in page.locator("#front-basis").inner_text()
    assert RUN in page.locator("#choice").inner_text()


def test_both_fronts_are_shown_and_changes_are_the_services(opened: Any, server: str) -> None:
    seen = opened("", SLOWER)
    told = seen.page.request.get(f"{server}/v1/runs/{RUN}/compare?against={SLOWER}").json()
    assert {row["verdict"] for row in told["rows"]} >= {"faster"}
    points = {
        run: {p["name"]: p for p in seen.page.request.get(f"{server}/v1/runs/{run}/front?alpha=50").json()["points"]}
        for run in (RUN, SLOWER)
    }
    either = {name for front in points.values() for name, point in front.items() if point["state"] != "off"}
    assert set(cells(seen, 1)) == either
    for name, before, after, change in zip(*(cells(seen, i) for i in (1, 4, 5, 6)), strict=True):
        assert float(before) == pytest.approx(points[SLOWER][name]["ratio"], rel=5e-3)
        assert float(after) == pytest.approx(points[RUN][name]["ratio"], rel=5e-3)
        assert name == "phong" or change.startswith("0.8 (")
    assert seen.page.locator(f"{PANEL} canvas").is_visible()
    assert "98 %" in seen.page.locator(PANEL).inner_text()


def test_times_of_another_machine_are_not_compared_but_errors_are(opened: Any) -> None:
    seen = opened("", ELSEWHERE)
    assert "different machines" in seen.page.locator(f"{PANEL} .problem").inner_text()
    assert not seen.page.locator(f"{PANEL} canvas").is_visible()
    assert set(cells(seen, 4)) == set(cells(seen, 6)) == {"–"}
    assert cells(seen, 2) == cells(seen, 3) != []


def test_costs_by_a_compiler_are_the_same_on_every_machine(opened: Any) -> None:
    seen = opened("#target=rdna2", ELSEWHERE)
    assert not seen.page.locator(f"{PANEL} .problem").is_visible()
    assert set(cells(seen, 6)) == {"1"}


def test_without_another_run_it_says_how_to_make_one(visit: Visits, empty_server: str) -> None:
    page = visit(empty_server + "/").page
    page.locator(f"{PANEL} summary").click()
    page.locator(f"{PANEL} .problem").wait_for()
    assert "phongbench run" in page.locator(f"{PANEL} .problem").inner_text()
