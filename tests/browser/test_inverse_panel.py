"""The panel on normals from shading says what the service says of the line that it shows."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

Visits = Callable[..., Any]
PANEL = "[data-panel=inverse]"
#: raised digits as plain ones, and the sign for minus
DIGITS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹−", "-0123456789-")
AMBIENT, DIFFUSE = 0.1, 0.7


@pytest.fixture
def opened(visit: Visits, empty_server: str) -> Any:
    """A visit with the panel and its table open."""
    seen = visit(empty_server + "/")
    seen.page.locator(f"{PANEL} summary").click()
    seen.page.locator("#inverse-text").wait_for()
    seen.page.locator(f"{PANEL} details summary").click()
    seen.idle()
    return seen


def columns(seen: Any, *heads: str) -> Any:
    """Columns of the panel's table, as numbers; NaN for what is not known."""
    cells = seen.page.eval_on_selector_all(
        f"{PANEL} tbody tr", "(rows) => rows.map((row) => [...row.cells].map((cell) => cell.textContent))"
    )
    names = seen.page.locator(f"{PANEL} thead th").all_inner_texts()
    told = [[row[names.index(head)].translate(DIGITS).replace("×10", "e") for row in cells] for head in heads]
    return [np.array([np.nan if cell == "–" else float(cell) for cell in one]) for one in told]


def lit(slope: Any, light: tuple[float, float]) -> Any:
    """Intensities of a surface of these slopes."""
    normals = np.stack([-slope, np.ones_like(slope)], axis=1) / np.hypot(slope, 1)[:, None]
    return np.maximum(AMBIENT + DIFFUSE * normals @ light, AMBIENT)


def test_the_cylinder_is_one_and_its_normals_come_out(opened: Any) -> None:
    x, intensity, angle, other, height = columns(opened, "x", "intensity", "angle", "other", "height")
    np.testing.assert_allclose(intensity, lit(-x / np.sqrt(1 - x**2), (0.71, 0.71)), atol=6e-4)
    known = np.isfinite(angle)
    assert 25 < known.sum() < len(x), "some of it lies in shadow"
    np.testing.assert_allclose(angle[known], np.degrees(np.arcsin(x[known])), atol=1)
    np.testing.assert_allclose(angle[known] + other[known], 90, atol=1)
    circle = np.sqrt(1 - x[known] ** 2)
    np.testing.assert_allclose(height[known], circle - circle[0], atol=0.02)
    assert "shadow" in opened.page.locator(PANEL).inner_text()
    assert "length 1.004" in opened.page.locator(PANEL).inner_text()
    opened.page.locator("#inverse-unit").check()
    opened.idle()
    assert "length 1.004" not in opened.page.locator(PANEL).inner_text()


def test_the_wave_is_one_and_the_prior_chooses(opened: Any) -> None:
    opened.page.get_by_role("button", name="A wave").click()
    opened.idle()
    x, intensity, angle, other = columns(opened, "x", "intensity", "angle", "other")
    np.testing.assert_allclose(intensity, lit(0.5 * np.cos(x), (0.8, 0.6)), atol=6e-4)
    np.testing.assert_allclose(angle, -np.degrees(np.arctan(0.5 * np.cos(x))), atol=1)
    before = opened.picture(f"{PANEL} .thirds figure:nth-of-type(2) canvas")
    opened.page.select_option("#inverse-prior", "concave")
    opened.changed(f"{PANEL} .thirds figure:nth-of-type(2) canvas", before)
    opened.idle()
    now, then = columns(opened, "angle", "other")
    assert (now != angle).any()
    np.testing.assert_allclose(np.sort([now, then], axis=0), np.sort([angle, other], axis=0))


def test_a_line_is_typed_pasted_or_drawn(opened: Any) -> None:
    page = opened.page
    page.locator("#inverse-scale").fill("255")
    for text, x in (
        ("x,intensity\n2,120\n3,150\n5,160", [2, 3, 5]),
        ("120 150; 160", [0, 1, 2]),
        ("120\n150\n160\n", [0, 1, 2]),
    ):
        page.locator("#inverse-text").fill(text)
        page.wait_for_function(f"() => document.querySelectorAll('{PANEL} tbody tr').length === 3")
        opened.idle()
        assert [list(one) for one in columns(opened, "x", "intensity")] == [x, [120, 150, 160]]
    page.locator(f"{PANEL} .drawable").scroll_into_view_if_needed()
    box = page.locator(f"{PANEL} .drawable .u-over").bounding_box()
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + 3, middle)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] - 3, middle, steps=4)
    page.mouse.up()
    # the middle one is drawn before the last: a busy browser tells of a move in several frames
    page.wait_for_function("() => !/150|160/.test(document.getElementById('inverse-text').value)")
    drawn = [float(line) for line in page.locator("#inverse-text").input_value().split("\n")]
    assert drawn == pytest.approx([127.5] * 3, abs=4)


#: field, what it is given, and what is then said
WRONG = (
    ("text", "0.5\nhalf\n0.3", "line 2: half is not a number"),
    ("text", "0.5, 0.2\n0.3", "line 2 has 1 number"),
    ("text", "1,2,3\n4,5,6", "line 1 has 3 numbers"),
    ("text", "", "an intensity on each line"),
    ("text", "0.5\n1e999", "line 2"),
    ("text", "0.5\n1.5", "outside 0 .. 1"),
    ("text", "1, 0.5\n1, 0.6", "x does not grow"),
    ("diffuse", "0", "diffuse: outside"),
    ("ambient", "", "ambient is not a number"),
    ("light-z", "-1", "the light comes from behind"),
    ("scale", "0", "intensity[0]"),
)


def test_what_is_no_line_is_told_where(opened: Any) -> None:
    page = opened.page
    for field, text, told in WRONG:
        page.locator(f"#inverse-{field}").fill(text)
        page.wait_for_selector(f'{PANEL} .problem:has-text("{told}")', timeout=60_000)
        page.get_by_role("button", name="A cylinder").click()
        page.wait_for_selector(f"{PANEL} .problem", state="hidden", timeout=60_000)
    opened.refused()
