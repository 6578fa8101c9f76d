"""The panel that shows a formula as code."""

from collections.abc import Callable
from typing import Any

import pytest

Visits = Callable[..., Any]
PANEL = "[data-panel=code]"


@pytest.fixture
def opened(visit: Visits, empty_server: str) -> Callable[..., Any]:
    """A factory of visits of the page with the panel open, by the address's hash."""

    def make(state: str = "", **options: Any) -> Any:
        seen = visit(f"{empty_server}/{state}", **options)
        seen.page.locator(f"{PANEL} summary").click()
        seen.page.locator(f"{PANEL} .choices label").first.wait_for()
        seen.idle()
        return seen

    return make


def source(seen: Any) -> str:
    return str(seen.page.locator(f"{PANEL} .source").inner_text())


def choose(seen: Any, language: str) -> None:
    seen.page.locator(f'{PANEL} input[value="{language}"]').check(force=True)
    seen.idle()


def test_it_is_the_services_code_in_every_language_that_the_service_knows(opened: Any, empty_server: str) -> None:
    seen = opened("#gamma=4&lambda=dot")
    languages = seen.page.request.get(f"{empty_server}/v1/meta").json()["languages"]
    tabs = [tab.get_attribute("value") for tab in seen.page.locator(f"{PANEL} input").all()]
    assert tabs == list(languages)
    for language in ("glsl", "wgsl", "numpy"):
        choose(seen, language)
        query = {"formula": "lyon:dot:4", "alpha": "50", "language": language}
        assert source(seen).strip() == seen.page.request.get(f"{empty_server}/v1/shader", params=query).text().strip()
    assert "--language numpy" in seen.page.locator(f"{PANEL} pre").last.inner_text()


def test_it_follows_the_page_while_it_is_open(opened: Any) -> None:
    seen = opened("#target=rdna2")
    assert "cycles beyond the dot product" in source(seen)
    seen.page.select_option("#target", "rdna3")
    seen.idle()
    assert "on rdna3:" in source(seen)
    seen.slide("#gamma", 5)
    seen.slide("#length", 60)
    seen.idle()
    assert "gamma = 32" in source(seen)
    assert "wrong by up to 0.1" in source(seen)
    seen.page.locator(f"{PANEL} summary").click()
    before = len(seen.asked)
    seen.slide("#gamma", 2)
    seen.idle()
    assert not [path for path in seen.asked[before:] if path.startswith("/v1/shader")], "closed, it asks nothing"


def test_float16_is_written_as_the_language_has_it(opened: Any) -> None:
    seen = opened("#precision=float16")
    assert "float16_t" in source(seen)
    choose(seen, "essl300")
    assert "--precision mediump" in source(seen)
    seen.refused()  # without a run nothing is known of float16


def test_what_a_language_cannot_write_is_told_and_the_others_stay(opened: Any) -> None:
    seen = opened("#approximation=table-x")
    choose(seen, "essl100")
    assert "essl300" in seen.page.locator(f"{PANEL} .problem").inner_text()
    assert not seen.page.locator(f"{PANEL} .source").is_visible()
    seen.refused()
    choose(seen, "essl300")
    assert "highlight(" in source(seen)
    assert not seen.page.locator(f"{PANEL} .problem").is_visible()


def test_it_is_copied_whole(opened: Any) -> None:
    seen = opened(permissions=["clipboard-read", "clipboard-write"])
    seen.page.get_by_role("button", name="Copy: the source text").click()
    seen.page.get_by_text("Copied").wait_for()
    copied = seen.page.evaluate("() => navigator.clipboard.readText()")
    assert copied.rstrip().endswith("}")
    assert copied.strip() == source(seen).strip()
