"""A window that a visit leaves shows the next one nothing of it."""

from typing import Any

from visits import IDLE, VIEW, Window


def test_a_visit_leaves_nothing_to_the_next(browser: Any, empty_server: str) -> None:
    window = Window.opened(browser, {})
    page = window.page
    try:
        first = window.load(empty_server + "/#alpha=7&theme=dark")
        first.idle()
        page.route("**/v1/curve**", lambda route: route.abort())
        page.context.route("**/v1/meta", lambda route: route.fulfill(json={}))
        page.set_viewport_size({"width": 400, "height": 300})
        page.evaluate(
            "() => { window.left = 1; document.querySelector('summary').click(); console.error('the first'); }"
        )
        first.slide("#gamma", 2)
        page.locator("#problem").wait_for()
        window.leave()
        page.evaluate("() => console.error('nobody')")
        second = window.load(empty_server + "/")
        page.wait_for_selector(IDLE)
        assert (page.viewport_size, page.locator("#alpha").input_value()) == (VIEW, "50")
        assert page.evaluate("() => [window.left ?? null, window.reports.length]") == [None, 0]
        assert page.locator("details[open]").count() == 0
        assert not page.locator("#problem").is_visible()
        assert {"/v1/meta", "/v1/approximations"} <= set(second.asked)
        assert (second.errors, second.foreign, second.reports()) == ([], [], [])
        assert any("the first" in error for error in first.errors)
        assert not any("nobody" in error for error in first.errors)
    finally:
        page.context.close()
