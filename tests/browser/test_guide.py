"""Every page of the guide in a real browser: nothing hinders a reader, in either colour scheme, on a narrow screen."""

from collections.abc import Callable
from typing import Any

from phongbench_api.routes import guide

WIDTH = 400
#: what is looked for in each scheme: of the second one only what colours change
LOOKED_FOR: dict[str, dict[str, Any]] = {"light": {}, "dark": {"runOnly": ["color-contrast"]}}


def test_every_page_reads_well_in_both_schemes_and_scrolls_down_only(visit: Callable[..., Any], server: str) -> None:
    from axe_core_python.sync_playwright import Axe

    seen = visit(f"{server}/guide/", wait=False, viewport={"width": WIDTH, "height": 900})
    pages, found = ["", *guide.texts()], []
    for name in pages:
        seen.page.goto(f"{server}/guide/{name}")
        assert seen.page.locator("h1").count() == 1, name
        assert seen.page.evaluate("document.documentElement.scrollWidth") == WIDTH, name
        for scheme, options in LOOKED_FOR.items():
            seen.page.emulate_media(color_scheme=scheme)
            checked = Axe().run(seen.page, options=options)
            assert checked["passes"], "axe looked at nothing"
            serious = [one for one in checked["violations"] if one["impact"] in ("serious", "critical")]
            found += [(name, scheme, one["id"], [node["html"] for node in one["nodes"]]) for one in serious]
        assert seen.reports() == []
    assert len(pages) > 10
    assert found == []
