"""The report in a real browser: on a wide and on a narrow screen, light and dark, and on paper."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from made_up_run import make_run

import phongbench_reports

#: pixels of a page of A4 between the margins of the style sheet
PAPER_WIDTH, PAPER_HEIGHT = 703, 1032
OVERFLOW = """
() => [...document.querySelectorAll('.wide, img, pre')]
  .map((one) => [one.className || one.tagName, one.scrollWidth - one.clientWidth, one.getBoundingClientRect().right])
"""


@pytest.fixture(scope="session")
def report(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a made-up run's report."""
    folder = tmp_path_factory.mktemp("report")
    run = make_run(folder / "run", alphas=(10.0, 50.0, 200.0), gammas=(8, 16), precisions=("float32",))
    return phongbench_reports.build(run, folder)


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 400)])
def test_axe_finds_nothing_serious(visit: Callable[..., Any], report: Path, scheme: str, width: int) -> None:
    from axe_core_python.sync_playwright import Axe

    seen = visit(report.as_uri(), wait=False, color_scheme=scheme, viewport={"width": width, "height": 900})
    seen.page.evaluate("() => document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    found = Axe().run(seen.page)
    assert [one["id"] for one in found["violations"] if one["impact"] in ("serious", "critical")] == []


def test_a_narrow_screen_scrolls_down_only_and_keeps_every_column(visit: Callable[..., Any], report: Path) -> None:
    page = visit(report.as_uri(), wait=False, viewport={"width": 400, "height": 900}).page
    assert page.evaluate("document.documentElement.scrollWidth") == 400
    assert all(right <= 400 for kind, _, right in page.evaluate(OVERFLOW) if kind == "IMG")
    answer = page.locator("#by_target")
    assert page.evaluate("document.querySelector('#by_target .wide').scrollWidth") <= 400
    headings = answer.locator("thead th").all_text_contents()
    shown = answer.locator("tbody tr").first.locator("td")
    assert [shown.nth(index).get_attribute("data-label") for index in range(shown.count())] == headings
    told = "(cell) => getComputedStyle(cell, '::before').content"
    assert [shown.nth(index).evaluate(told) for index in range(shown.count())] == [f'"{text}"' for text in headings]


def test_paper_holds_all_columns_and_the_answer_on_its_first_page(visit: Callable[..., Any], report: Path) -> None:
    page = visit(report.as_uri(), wait=False, viewport={"width": PAPER_WIDTH, "height": PAPER_HEIGHT}).page
    pages = len(re.findall(rb"/Type\s*/Page\b(?!s)", page.pdf(prefer_css_page_size=True)))
    assert 3 <= pages <= 12
    page.emulate_media(media="print")
    assert page.locator("h1").bounding_box()["y"] < 100
    answer = page.locator("#by_target table").bounding_box()
    assert answer["y"] + answer["height"] < PAPER_HEIGHT
    assert [kind for kind, over, right in page.evaluate(OVERFLOW) if over > 0 or right > PAPER_WIDTH] == []


def test_code_is_folded_and_one_click_opens_it(visit: Callable[..., Any], report: Path) -> None:
    page = visit(report.as_uri(), wait=False).page
    listing = page.locator("#code pre").first
    assert not listing.is_visible()
    page.locator("#code > details > summary").first.click()
    page.locator("#code .listing > summary").first.click()
    assert listing.is_visible()
    assert "highlight" in listing.inner_text()
