"""What the explorer shows follows what its controls say."""

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from phongbench.inputs.optical_constants import GLASS

LOBE, ERROR, SPHERES = "#lobe canvas", "#error canvas", ("#sphere-exact", "#sphere-value", "#sphere-error")
#: everything that shows the highlight
PICTURES = (LOBE, ERROR, "#sphere-value", "#sphere-error")

Visits = Callable[..., Any]


def visible(page: Any) -> set[str]:
    """The controls that are to be seen, by name."""
    return {place.get_attribute("data-field") for place in page.locator("[data-field]").all() if place.is_visible()}


@pytest.mark.parametrize(
    ("slider", "position", "told"),
    [("#alpha-slider", 230, "alpha=200"), ("#gamma", 5, "gamma=32"), ("#length", 40, "length_error=")],
)
def test_a_slider_changes_the_pictures_and_the_address(
    visit: Visits, empty_server: str, slider: str, position: int, told: str
) -> None:
    seen = visit(empty_server + "/#range=all")
    before = {picture: seen.picture(picture) for picture in PICTURES}
    sentence = seen.page.locator("#verdict").inner_text()
    seen.slide(slider, position)
    for picture in PICTURES:
        seen.changed(picture, before[picture])
    seen.idle()
    assert told in seen.page.evaluate("() => location.hash")
    assert seen.page.locator("#verdict").inner_text() != sentence


def test_a_busy_service_is_asked_again_when_it_says(visit: Visits, empty_server: str) -> None:
    page = (seen := visit(empty_server + "/")).page
    refused: list[str] = []

    def busy(route: Any) -> None:
        refused.append(route.request.url)
        if len(refused) > 2:
            return route.fallback()
        problem = {"title": "The service is busy", "detail": "every core is taken"}
        return route.fulfill(status=503, headers={"retry-after": "1"}, json=problem)

    page.route("**/v1/curve**", busy)
    before = seen.picture(LOBE)
    seen.slide("#alpha-slider", 230)
    seen.changed(LOBE, before)
    seen.idle()
    assert len(refused) == 3
    assert not page.locator("#problem").is_visible()


def test_the_exact_sphere_is_left_alone_by_the_approximations_exponent(visit: Visits, empty_server: str) -> None:
    seen = visit(empty_server + "/")
    exact, value = seen.picture("#sphere-exact"), seen.picture("#sphere-value")
    seen.slide("#gamma", 1)
    seen.changed("#sphere-value", value)
    seen.idle()
    assert seen.picture("#sphere-exact") == exact


def test_an_approximation_has_the_controls_it_takes_and_no_others(visit: Visits, empty_server: str) -> None:
    page = (seen := visit(empty_server + "/")).page
    always = {"alpha", "length", "normalise", "precision"}
    assert visible(page) == always | {"gamma", "lambda", "beta", "space"}
    page.select_option("#approximation", "gaussian")
    seen.idle()
    assert visible(page) == always | {"lambda", "beta"}
    page.select_option("#approximation", "phong")
    seen.idle()
    assert visible(page) == always
    assert page.locator("#verdict b").inner_text() == "no"
    page.select_option("#approximation", "lyon")
    seen.idle()
    assert page.locator('#lambda input[value="cross"]').is_checked(), "a wish that did not apply is kept"


def test_the_page_says_what_the_service_says(visit: Visits, empty_server: str) -> None:
    page = visit(empty_server + "/#gamma=4&alpha=20&precision=float64&lambda=difference").page
    question = {"approximation": "lyon", "lambda": "difference", "gamma": "4", "alpha": "20", "points": "9001"}
    answer = page.request.get(empty_server + "/v1/curve", params=question).json()
    worst = f"{255 * answer['max_abs_error']:.3g} codes at {answer['angle_degrees'][answer['worst_index']]:.3g}°"
    assert worst in page.locator("#verdict").inner_text()
    assert page.locator("#verdict b").inner_text() == "yes"


def test_small_errors_are_not_called_visible(visit: Visits, empty_server: str) -> None:
    page = visit(empty_server + "/#approximation=integer-power").page
    assert page.locator("#verdict b").inner_text() == "no"


def codes(page: Any) -> float:
    """The largest error that the page tells, in 8-bit codes."""
    return float(re.findall(r"([0-9.]+) codes", page.locator("#verdict").inner_text())[0])


def test_lengths_that_are_removed_change_nothing(visit: Visits, empty_server: str) -> None:
    page = (seen := visit(empty_server + "/#lambda=dot&range=all&perturbation=both")).page
    page.locator('#normalise input[value="none"]').focus()
    page.keyboard.press("ArrowRight")
    seen.idle()
    told = codes(page)
    assert "normalise=each" in page.evaluate("() => location.hash")
    seen.slide("#length", 60)
    seen.idle()
    assert "length_error=0.1" in page.evaluate("() => location.hash")
    assert codes(page) == pytest.approx(told, abs=0.05), "but for rounding"
    page.locator('#normalise input[value="none"]').check(force=True)
    seen.idle()
    assert codes(page) > told + 1


#: red, green and blue of the brightest pixel of the sphere in exact Phong
PEAK = """() => {
  const canvas = document.getElementById('sphere-exact');
  const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
  const sum = (c) => c[0] + c[1] + c[2];
  let best = [0, 0, 0];
  for (let i = 0; i < data.length; i += 4) if (sum(data.slice(i, i + 3)) > sum(best)) best = [...data.slice(i, i + 3)];
  return best;
}"""


def test_a_reflectance_colours_the_highlight_by_its_incidence(visit: Visits, empty_server: str) -> None:
    def peak(fresnel: str, light: str) -> list[int]:
        return list(visit(f"{empty_server}/#fresnel={fresnel}&light={light}&alpha=20").page.evaluate(PEAK))

    bare, copper = peak("", "0,0"), peak("copper", "0,0")
    red, green, blue = (one - other for one, other in zip(bare, copper, strict=True))
    assert 0 < red < green < blue
    lost = [peak("", light)[0] - peak("glass", light)[0] for light in ("0,0", "0.96,0")]
    kept = 1 - GLASS.at(np.array([1.0, 0.28]))[:, 0]  # of a normal so near to the rim
    assert lost[1] / lost[0] == pytest.approx(kept[1] / kept[0], abs=0.05)


def test_the_address_holds_all_that_is_shown(visit: Visits, empty_server: str) -> None:
    page = (seen := visit(empty_server + "/")).page
    page.select_option("#approximation", "gaussian")
    page.locator('#lambda input[value="dot"]').check(force=True)
    page.locator('#beta input[value="minimax"]').check(force=True)
    page.locator('#precision input[value="float16"]').check(force=True)
    page.select_option("#material", "ruby")
    page.select_option("#fresnel", "copper")
    page.locator("#alpha").fill("33.5")
    seen.slide("#length", -30)
    page.locator('#perturbation input[value="opposite"]').check(force=True)
    page.locator('#normalise input[value="once"]').check(force=True)
    page.locator('#scale input[value="log"]').check(force=True)
    page.locator('#range input[value="all"]').check(force=True)
    seen.slide("#amplify", 17)
    page.locator("#closeup").check()
    page.select_option("#budget", "1/1023")
    page.select_option("#target", "gcn4")
    page.locator("#theme").click()
    page.locator("#sphere-exact").focus()
    page.keyboard.press("ArrowDown")
    seen.refused()  # without a run nothing is known about float16
    address = page.url
    again = visit(address)
    again.refused()
    assert again.page.evaluate("() => location.hash") == page.evaluate("() => location.hash")
    for place in ("verdict", "sphere-name", "times", "length-out"):
        assert again.page.locator(f"#{place}").inner_text() == page.locator(f"#{place}").inner_text()
    for picture in (*SPHERES, LOBE, ERROR):
        assert again.picture(picture) == seen.picture(picture), picture
    assert again.page.locator("#alpha").input_value() == "33.5"
    assert again.page.locator("html").get_attribute("data-theme") == "light"


JUNK = (
    "#alpha=-3&gamma=7&length_error=9&precision=float3000&approximation=nonsense&lambda=<b>&light=3,4&amplify=NaN",
    "#constructor=1&__proto__=2&toString=3&hasOwnProperty",
    "#%E0%A4%A&&&==&alpha=&gamma=8.5&theme=pink&budget=2&material=kryptonite&closeup=maybe&target=geforce",
)


def test_junk_in_the_address_is_ignored(visit: Visits, empty_server: str) -> None:
    plain = visit(empty_server + "/")
    for junk in JUNK:
        seen = visit(empty_server + "/" + junk)
        assert seen.page.locator("#verdict").inner_text() == plain.page.locator("#verdict").inner_text()
        assert seen.picture(LOBE) == plain.picture(LOBE)


def test_another_address_is_shown_without_loading_the_page_anew(visit: Visits, empty_server: str) -> None:
    page = (seen := visit(empty_server + "/")).page
    before = seen.picture(LOBE)
    page.evaluate("() => { location.hash = '#alpha=7&range=all'; }")
    seen.changed(LOBE, before)
    seen.idle()
    assert page.locator("#alpha").input_value() == "7"


def test_what_the_service_refuses_is_told_in_its_words(visit: Visits, empty_server: str) -> None:
    page = (seen := visit(empty_server + "/#approximation=integer-power")).page
    page.locator("#alpha").fill("50.5")
    page.locator("#problem").wait_for()
    assert "integer-power does not take alpha = 50.5" in page.locator("#problem").inner_text()
    page.locator("#alpha").fill("51")
    page.locator("#problem").wait_for(state="hidden")
    seen.refused()


def test_a_service_that_is_gone_is_told_and_asked_again(visit: Visits, empty_server: str) -> None:
    page = (seen := visit(empty_server + "/")).page
    page.route("**/v1/curve**", lambda route: route.abort())
    seen.slide("#gamma", 2)
    page.locator("#problem").wait_for()
    assert "The service does not answer" in page.locator("#problem").inner_text()
    page.unroute("**/v1/curve**")
    page.get_by_role("button", name="Try again").click()
    page.locator("#problem").wait_for(state="hidden")
    seen.idle()
    seen.errors.clear()


def test_a_slider_on_the_move_shows_what_it_passes(visit: Visits, empty_server: str) -> None:
    page = (seen := visit(empty_server + "/")).page
    # resolves only if an answer is shown while the slider still moves with every frame
    page.evaluate("""() => new Promise((done) => {
      const slider = document.getElementById('alpha-slider'), verdict = document.getElementById('verdict');
      const before = verdict.textContent;
      const move = () => {
        if (verdict.textContent !== before) return done();
        slider.value = 150 + (Number(slider.value) + 3) % 150;
        slider.dispatchEvent(new Event('input'));
        requestAnimationFrame(move);
      };
      move();
    })""")
    seen.idle()


def test_the_newest_question_wins(visit: Visits, empty_server: str) -> None:
    page = (seen := visit(empty_server + "/")).page
    held: list[Any] = []

    def hold(route: Any) -> None:
        held.append(route)

    page.route("**/v1/curve**alpha=20&**", hold)
    with page.expect_request("**/v1/curve**alpha=20&**"):
        page.locator("#alpha").fill("20")
    page.locator("#alpha").fill("90")
    seen.idle()
    sentence = page.locator("#verdict").inner_text()
    for route in held:
        route.abort()
    assert page.locator("#verdict").inner_text() == sentence
    assert visit(empty_server + "/#alpha=90").page.locator("#verdict").inner_text() == sentence
