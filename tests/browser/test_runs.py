"""The front and the recommendation, without a run and with one."""

from collections.abc import Callable
from typing import Any

Visits = Callable[..., Any]
FRONT = "#front-plot canvas"


def test_without_a_run_the_page_says_how_to_make_one_and_works(visit: Visits, empty_server: str) -> None:
    page = visit(empty_server + "/").page
    assert page.locator("#front-absent").is_visible()
    assert "phongbench run" in page.locator("#front-absent pre").inner_text()
    assert page.locator("#front-figure").is_hidden()
    assert page.locator("#report-link").is_hidden()
    assert "codes" in page.locator("#verdict").inner_text()
    assert "laws" in page.locator("#choice").inner_text()


def test_a_run_that_is_made_meanwhile_is_found(visit: Visits, empty_server: str, server: str) -> None:
    page = (seen := visit(empty_server + "/")).page

    # the other server's answers stand for the run that was made meanwhile
    def other(route: Any) -> None:
        route.fulfill(response=page.request.get(route.request.url.replace(empty_server, server)))

    for path in ("**/v1/runs?**", "**/v1/runs/**/front?**"):
        page.route(path, other)
    page.get_by_role("button", name="Look again").click()
    page.locator("#front-figure").wait_for()
    seen.idle()
    assert page.locator("#front-absent").is_hidden()


def test_runs_that_could_not_be_asked_for_are_not_said_to_be_none(visit: Visits, server: str) -> None:
    page = (seen := visit(server + "/")).page
    page.route("**/v1/runs?**", lambda route: route.abort())
    page.reload()
    page.locator("#front-problem").wait_for()
    assert page.locator("#front-absent").is_hidden()
    page.unroute("**/v1/runs?**")
    page.locator("#front-problem button").click()
    page.locator("#front-figure").wait_for()
    seen.idle()
    seen.errors.clear()
    assert page.locator("#front-problem").is_hidden()


def test_the_front_of_the_newest_run_is_drawn_and_told(visit: Visits, server: str) -> None:
    page = visit(server + "/").page
    assert "20260101-000000-0123abcd" in page.locator("#front-basis").inner_text()
    assert page.locator("#report-link").get_attribute("href").startswith("/runs/20260101-000000-0123abcd/")
    page.locator("#front-details summary").click()
    points = page.request.get(server + "/v1/runs/latest/front?alpha=50").json()["points"]
    rows = page.locator("#front-details tbody tr")
    assert rows.count() == len(points)
    told = rows.locator("td:nth-child(6)").all_inner_texts()
    assert sorted(told) == sorted(point["state"] for point in points)
    assert set(told) == {"on", "off", "unresolved"}
    assert page.locator("#front-details tbody b").all_inner_texts() == ["chosen"]


def test_an_exponent_that_was_not_measured_shows_its_neighbour_and_says_so(visit: Visits, server: str) -> None:
    page = visit(server + "/#alpha=40").page
    assert "α = 50, the nearest measured to 40" in page.locator("#front-basis").inner_text()


def test_times_that_stand_for_another_precision_are_said_to(visit: Visits, server: str) -> None:
    page = visit(server + "/#precision=float16").page
    assert "float16 with the times of float32" in page.locator("#front-basis").inner_text()


def test_a_precision_that_was_not_measured_is_told_with_its_command(visit: Visits, server: str) -> None:
    page = (seen := visit(server + "/#precision=float64")).page
    assert "phongbench run --precision float64" in page.locator("#front-problem").inner_text()
    assert page.locator("#front-figure").is_hidden()
    page.locator('#precision input[value="float32"]').check(force=True)
    seen.refused()  # the recommendation's own words for the same
    assert page.locator("#front-figure").is_visible()
    assert page.locator("#front-problem").is_hidden()


def test_a_click_on_a_point_chooses_it(visit: Visits, server: str) -> None:
    page = (seen := visit(server + "/")).page
    place = page.locator("#front-plot .u-over")
    place.scroll_into_view_if_needed()
    box = place.bounding_box()
    # walk over the plot until the pointer is at a point, as an eye would
    for share in range(5, 96):
        page.mouse.move(box["x"] + box["width"] * share / 100, box["y"] + box["height"] * (0.9 - 0.005 * share))
        told = page.locator("#front-readout").inner_text()
        if told and "lyon:cross:8:" not in told:
            break
    name = told.split(": ")[0]
    before = seen.picture("#sphere-value")
    page.mouse.down()
    page.mouse.up()
    seen.changed("#sphere-value", before)
    seen.idle()
    assert page.locator("#sphere-name").inner_text() == name


def test_the_table_chooses_too(visit: Visits, server: str) -> None:
    page = (seen := visit(server + "/")).page
    page.locator("#front-details summary").click()
    page.get_by_role("button", name="Choose gaussian:difference:minimax").click()
    seen.idle()
    assert page.locator("#approximation").input_value() == "gaussian"
    assert page.locator('#lambda input[value="difference"]').is_checked()
    assert page.locator('#beta input[value="minimax"]').is_checked()


def test_the_recommendation_is_the_services_and_can_be_shown(visit: Visits, server: str) -> None:
    page = (seen := visit(server + "/")).page
    before = seen.picture(FRONT)
    page.select_option("#budget", "2/255")
    seen.changed(FRONT, before)  # where the budget lies
    seen.idle()
    best = page.request.get(server + "/v1/recommend?alpha=50&max_error=2/255").json()["choices"][0]
    assert best["why"] in page.locator("#choice").inner_text()
    page.locator("#choice button").first.click()
    seen.idle()
    assert page.locator("#approximation").input_value() == best["approximation"]
    assert page.locator("#sphere-name").inner_text().startswith(best["approximation"])


def test_front_and_recommendation_are_those_of_the_target(visit: Visits, server: str) -> None:
    page = (seen := visit(server + "/")).page
    before = seen.picture(FRONT)
    page.select_option("#target", "rdna2")
    seen.changed(FRONT, before)
    seen.idle()
    assert "target=rdna2" in page.url
    assert "costs on rdna2" in page.locator("#front-basis").inner_text()
    page.locator("#front-details summary").click()
    page.locator("#front-details th").first.wait_for()
    heads = page.locator("#front-details th").all_inner_texts()
    assert "cost / exact Phong (cycles, counted)" in heads
    points = page.request.get(server + "/v1/runs/latest/front?alpha=50&target=rdna2").json()["points"]
    rows = page.locator("#front-details tbody tr")
    assert sorted(rows.locator("td:first-child").all_inner_texts()) == sorted(point["name"] for point in points)
    assert f"{points[0]['bound_by']}" in rows.first.inner_text()
    best = page.request.get(server + "/v1/recommend?alpha=50&max_error=1/255&target=rdna2").json()["choices"][0]
    assert best["why"] in page.locator("#choice").inner_text()
    assert page.locator("#commands code").last.inner_text().endswith("--target rdna2")
    page.locator("#target").focus()
    page.keyboard.press("ArrowDown")
    seen.idle()
    assert "target=rdna3" in page.url
    again = visit(page.url).page
    assert again.locator("#target").input_value() == "rdna3"
    assert "costs on rdna3" in again.locator("#front-basis").inner_text()


def test_a_run_that_does_not_reach_an_exponent_says_what_to_do(visit: Visits, server: str) -> None:
    page = (seen := visit(server + "/#alpha=5000")).page
    assert "phongbench run --alpha 5000" in page.locator("#choice .problem").inner_text()
    assert page.locator("#front-figure").is_visible()
    seen.refused()


def test_commands_give_what_is_shown(visit: Visits, server: str) -> None:
    page = (seen := visit(server + "/#alpha=20&gamma=16&lambda=dot&precision=float64&length_error=0.01")).page
    seen.refused()  # the run has no float64
    curl, code, run, pick = page.locator("#commands code").all_inner_texts()
    answer, source = (page.request.get(one.removeprefix("curl '").removesuffix("'")) for one in (curl, code))
    assert answer.ok
    assert "gamma = 16, lambda form dot" in source.text()
    assert f"{255 * answer.json()['max_abs_error']:.3g} codes" in page.locator("#verdict").inner_text()
    assert run == "phongbench run --only lyon --alpha 20 --gamma 16 --lambda dot --precision float64"
    assert pick == "phongbench recommend --alpha 20 --max-error 1/255 --precision float64 --length-error 0.01"


def test_a_command_is_copied(visit: Visits, server: str) -> None:
    page = visit(server + "/", permissions=["clipboard-read", "clipboard-write"]).page
    page.get_by_role("button", name="Copy: This curve, from the service").click()
    page.get_by_text("Copied").wait_for()
    assert page.evaluate("() => navigator.clipboard.readText()") == page.locator("#commands code").first.inner_text()
