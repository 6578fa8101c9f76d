"""The page as such: small, self-contained, usable by everyone."""

import hashlib
import json
import re
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any

import pytest

Visits = Callable[..., Any]
WEB = Path(str(resources.files("phongbench_api"))) / "web"
#: bytes of everything that the page loads, answers of the API left out; and with every panel opened
BUDGET, OPENED = 150_000, 190_000
#: how wide the page is once observers of sizes have had their turn
SETTLED = """() => new Promise((done) => {
  requestAnimationFrame(() => requestAnimationFrame(() => done(document.documentElement.scrollWidth)));
})"""


def unfold(seen: Any) -> None:
    """Open whatever can be opened, and wait for what that loads."""
    for summary in seen.page.locator("summary:visible").all():
        summary.evaluate("(summary) => { summary.parentElement.open = true; }")  # where another one may lie over it
    seen.page.evaluate(SETTLED)
    if seen.page.locator("#main").count():
        seen.idle()


def test_the_page_is_within_its_byte_budget(visit: Visits, server: str) -> None:
    seen = visit(server + "/")

    def size() -> int:
        files = {path for path in seen.asked if not path.startswith(("/v1/", "/runs/"))}
        assert len(files) > 10, "the route of the page's files is not the one this test thinks"
        return sum(len(seen.page.request.get(server + path).body()) for path in files)

    assert (closed := size()) < BUDGET
    unfold(seen)
    assert closed < size() < OPENED, "panels are loaded when they are opened"


def test_vendored_files_are_what_was_published() -> None:
    told = json.loads((WEB / "vendor" / "vendored.json").read_text())
    found = {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in (WEB / "vendor").iterdir()}
    found.pop("vendored.json")
    assert found == told["files"]
    assert told["license"] in (WEB / "vendor" / "uPlot.LICENSE.txt").read_text()


def test_nothing_is_written_inline() -> None:
    text = (WEB / "index.html").read_text()
    assert not re.search(r"<style|\sstyle=|\son\w+=|javascript:", text)
    assert not re.search(r"<script(?![^>]*\ssrc=)", text)


def test_no_formula_is_written_a_second_time() -> None:
    # what a highlight is made of: powers, exponentials, logarithms of values; the page only reads tables
    for name in ("lookup.js", "spheres.js"):
        assert not re.search(r"Math\.(pow|exp|log\w*)\b", (WEB / name).read_text()), name


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 390)])
@pytest.mark.parametrize("path", ["/#length_error=0.01", "/docs", "/runs/latest/rows"])
def test_axe_finds_nothing_serious(visit: Visits, server: str, path: str, scheme: str, width: int) -> None:
    from axe_core_python.sync_playwright import Axe

    view = {"width": width, "height": 900}
    page = (seen := visit(server + path, color_scheme=scheme, viewport=view, wait=path[1] in "#r")).page
    unfold(seen)
    # The sections of the documentation are made alike, and all of them take axe ten times as long.
    part = "header, nav, section:nth-of-type(-n + 6)" if path == "/docs" else "html"
    found = Axe().run(page, part)["violations"]
    assert [(v["id"], [n["html"] for n in v["nodes"]]) for v in found if v["impact"] in ("serious", "critical")] == []


@pytest.mark.parametrize("path", ["/", "/docs", "/runs/latest/rows", "/guide/columns.md"])
def test_no_width_scrolls_sideways(visit: Visits, server: str, path: str) -> None:
    page = (seen := visit(server + path, wait=path in ("/", "/runs/latest/rows"))).page
    unfold(seen)
    found = {}
    for width in (1920, 1280, 1000, 700, 390, 320):
        page.set_viewport_size({"width": width, "height": 800})
        found[width] = page.evaluate(SETTLED)
    assert {width: wide for width, wide in found.items() if wide > width} == {}


def test_the_theme_follows_the_system_and_the_button(visit: Visits, empty_server: str) -> None:
    page = (seen := visit(empty_server + "/", color_scheme="dark")).page
    colour = "() => getComputedStyle(document.body).backgroundColor"
    dark = page.evaluate(colour)
    page.locator("#theme").click()
    light = page.evaluate(colour)
    seen.idle()
    assert light != dark
    assert "theme=light" in page.url
    page.locator("#theme").click()
    assert page.evaluate(colour) == dark
    page.locator("#theme").click()
    seen.idle()
    assert "theme" not in page.url


def test_everything_is_within_reach_of_the_keyboard(visit: Visits, server: str) -> None:
    page = visit(server + "/#length_error=0.01").page
    wanted = {
        "theme",
        "sphere-exact",
        "amplify",
        "closeup",
        "approximation",
        "alpha",
        "alpha-slider",
        "material",
        "gamma",
        "length",
        "lobe",
        "error",
        "target",
        "front-plot",
        "budget",
        "reset",
    }
    reached: set[str] = set()
    unseen = []
    look = """() => {
      const at = document.activeElement;
      if (at === document.body) return null;
      const shown = at.type === 'radio' ? at.nextElementSibling : at;
      const style = getComputedStyle(shown);
      return [at.id || at.name || at.textContent.trim(), style.outlineStyle !== 'none' && style.outlineWidth !== '0px'];
    }"""
    # From the top to the end, where the focus leaves the page; a page that traps it is found by the bound.
    for _ in range(100):
        page.keyboard.press("Tab")
        if (found := page.evaluate(look)) is None:
            break
        name, outlined = found
        reached.add(name)
        if not outlined:
            unseen.append(name)
    else:
        pytest.fail("the focus does not leave the page")
    assert wanted | {"lambda", "beta", "space", "perturbation", "precision", "scale", "range"} <= reached
    assert unseen == []


def test_keys_move_the_light_the_sliders_and_the_cursors(visit: Visits, server: str) -> None:
    page = (seen := visit(server + "/")).page
    moves = (("#sphere-exact", ["ArrowLeft", "ArrowUp"]), ("#gamma", ["ArrowRight"]), ("#alpha-slider", ["PageDown"]))
    for place, keys in moves:
        before = seen.picture("#sphere-value")
        page.locator(place).focus()
        for key in keys:
            page.keyboard.press(key)
        seen.changed("#sphere-value", before)
        seen.idle()
    assert {"light", "gamma", "alpha"} <= set(re.findall(r"(\w+)=", page.url))
    page.locator("#error").focus()
    page.keyboard.press("End")
    page.keyboard.press("ArrowLeft")
    told = page.locator("#error-readout").inner_text()
    page.keyboard.press("Home")
    assert told.startswith("at ")
    assert page.locator("#error-readout").inner_text().startswith("at 0°")
    page.locator("#front-plot").focus()
    page.keyboard.press("ArrowRight")
    name = page.locator("#front-readout").inner_text().split(":")[0]
    page.keyboard.press("Enter")
    seen.idle()
    assert page.locator("#sphere-name").inner_text() == name


def test_the_light_follows_the_pointer(visit: Visits, empty_server: str) -> None:
    page = (seen := visit(empty_server + "/")).page
    box = page.locator("#sphere-error").bounding_box()
    before = seen.picture("#sphere-exact")
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 0.6 * box["height"])
    page.mouse.down()
    page.mouse.move(box["x"] + 0.75 * box["width"], box["y"] + 0.5 * box["height"], steps=3)
    page.mouse.up()
    seen.changed("#sphere-exact", before)
    seen.idle()
    x, y = map(float, re.search(r"light=([-\d.]+),([-\d.]+)", page.url).groups())
    assert x == pytest.approx(0.52, abs=0.02)
    assert y == pytest.approx(0.0, abs=0.02)


def test_the_highlight_stands_where_the_light_puts_it(visit: Visits, empty_server: str) -> None:
    page = visit(empty_server + "/#alpha=1000&light=0.4,-0.5").page
    brightest = """(canvas) => {
      const { width, height } = canvas, { data } = canvas.getContext('2d').getImageData(0, 0, width, height);
      let best = 0;
      for (let i = 0; i < data.length; i += 4) if (data[i] > data[best]) best = i;
      return [((best / 4) % width) / width, Math.floor(best / 4 / width) / height];
    }"""
    x, y = page.eval_on_selector("#sphere-exact", brightest)
    assert x == pytest.approx(0.5 + 0.4 / 2.08, abs=0.015)
    assert y == pytest.approx(0.5 + 0.5 / 2.08, abs=0.015)


def test_tables_hold_what_the_plots_show(visit: Visits, empty_server: str) -> None:
    page = (seen := visit(empty_server + "/")).page
    page.locator("#curve-details summary").click()
    first = page.locator("#curve-details tbody").inner_text()
    assert page.locator("#curve-details tbody tr").count() > 20
    seen.slide("#gamma", 6)
    seen.idle()
    assert page.locator("#curve-details tbody").inner_text() != first
